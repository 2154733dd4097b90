"""What shape and display files may contain, key by key, in the units people write.

The descriptions are shown to users who left a key out or gave it the wrong type. What depends on more than one key is
in `rules`.
"""

from __future__ import annotations

import math
from typing import Annotated, Any, Literal

from pydantic import BaseModel, ConfigDict, Field, PlainValidator, TypeAdapter
from pydantic_core import PydanticCustomError

from curveline.drive_settings import ADDRESS, MAX_CHANNEL, MAX_NODES
from curveline.material.relaxation import (
    COLDEST_C,
    HOTTEST_C,
    LEAST_EXPONENT,
    LEAST_STRENGTH,
    LONGEST,
    MOST_EXPONENT,
    MOST_STRENGTH,
    MOST_TERMS,
    REFERENCE_C,
    SHORTEST,
)

MAX_LOADS = 1000
MAX_PLACES = 10_000
PAIR = 2
TRIPLE = 3
LEAST_GPA, MOST_GPA = 1e-6, 1e4
"""Moduli that a material may have."""

Length = Annotated[float, Field(ge=1e-6, le=1e9)]
Height = Annotated[float, Field(ge=-1e9, le=1e9)]
Angle = Annotated[float, Field(ge=-180.0, le=180.0)]
Yaw = Annotated[float, Field(ge=-90.0, le=90.0)]
Roll = Annotated[float, Field(ge=-36000.0, le=36000.0)]
Component = Annotated[float, Field(ge=-1e6, le=1e6)]
Speed = Annotated[float, Field(ge=1e-6, le=1e6)]
Force = Annotated[float, Field(ge=-1e6, le=1e6)]
Positive = Annotated[float, Field(ge=1e-6, le=1e6)]
Seconds = Annotated[float, Field(ge=SHORTEST, le=LONGEST)]
Fraction = Annotated[float, Field(gt=0.0, lt=1.0)]
Address = Annotated[str, Field(pattern=ADDRESS)]
LONGEST_NAME = 100
MAX_LINES = 64
LONGEST_LINE_NAME = 24
"""Room for it there must be beside a bar."""
Name = Annotated[str, Field(max_length=LONGEST_NAME)]


class Table(BaseModel):
    """A TOML table: no other keys, no conversions, no infinities."""

    model_config = ConfigDict(extra="forbid", strict=True, allow_inf_nan=False, frozen=True)


_DIRECTION: TypeAdapter[list[float]] = TypeAdapter(
    Annotated[list[Component], Field(min_length=TRIPLE, max_length=TRIPLE)],
    config=ConfigDict(strict=True, allow_inf_nan=False),
)


def _flag_or_direction(value: Any) -> bool | list[float]:
    """`value` if it is a truth value, or three numbers; a union of models would report both as wrong."""
    if isinstance(value, bool):
        return value
    if not isinstance(value, list):
        raise PydanticCustomError("flag_or_list_type", "neither a truth value nor an array")
    return _DIRECTION.validate_python(value)


Place = Annotated[list[Component], Field(min_length=PAIR, max_length=PAIR)]
"""A pair of numbers."""


class NodeTable(Table):
    """One item of `nodes`."""

    height_mm: Height = Field(description="height of the node's pivot")
    angle_deg: Angle = Field(description="direction of the rod, left to right, counter-clockwise from the horizontal")
    yaw_deg: Yaw = Field(default=0.0, description="turn of the rod's direction out of the plane, towards the viewer")
    roll_deg: Roll = Field(
        default=0.0, description="turn of the rod about its own direction; several turns may be given"
    )


class SegmentTable(Table):
    """One item of `segments`."""

    length_mm: Length = Field(description="rod between the pivots of the two nodes")
    state: Literal["peak", "valley", "straight"] = Field(
        description='the curve that is wanted, "peak" or "valley", or "straight" without rod to spare'
    )


class LoadTable(Table):
    """One item of `loads`."""

    segment: int = Field(ge=1, le=MAX_NODES, description="number of the segment, the leftmost being 1")
    at: float = Field(gt=0.0, lt=1.0, description="where the load acts, as a fraction of the segment's length")
    force_N: list[Force] = Field(
        min_length=PAIR, max_length=TRIPLE, description="[horizontal, vertical] force, or a third towards the viewer"
    )


class ShapeTable(Table):
    """A shape file."""

    name: Name = Field(description="the name of the shape")
    display: str = Field(description="a built-in display, or the path of a display file")
    nodes: list[NodeTable] = Field(max_length=MAX_NODES, description="one table per node, left to right")
    segments: list[SegmentTable] = Field(max_length=MAX_NODES, description="one table per gap between nodes")
    loads: list[LoadTable] = Field(default=[], max_length=MAX_LOADS, description="point loads on the rod")


class RodTable(Table):
    """`[rod]` of a display file."""

    youngs_modulus_GPa: float | None = Field(
        default=None, ge=LEAST_GPA, le=MOST_GPA, description="stiffness of the rod's material"
    )
    bending_stiffness_Nmm2: float | None = Field(
        default=None, ge=1e-12, le=1e30, description="stiffness of the rod as measured by bending it in the plane"
    )
    width_mm: Length | None = Field(default=None, description="width of the rod, out of the display's plane")
    thickness_mm: Length | None = Field(default=None, description="effective thickness of the rod in bending")
    diameter_mm: Length | None = Field(default=None, description="diameter of a round rod, or of a tube outside")
    inner_diameter_mm: float | None = Field(default=None, ge=0.0, le=1e9, description="diameter of a tube inside")
    mass_g_per_m: float = Field(ge=0.0, le=1e6, description="mass of the rod per length")
    max_strain: float = Field(gt=0.0, le=1.0, description="largest strain that a plan may ask for")
    natural_curvature_per_m: float = Field(default=0.0, ge=-1e6, le=1e6, description="curvature of the free rod")
    natural_curvature_along: list[Place] | None = Field(
        default=None,
        min_length=1,
        max_length=MAX_PLACES,
        description="pairs of a place in mm from the rod's left end and what the free rod is bent there besides",
    )
    natural_curvature_file: Name | None = Field(
        default=None, description="the same in a CSV file with the columns place_mm and curvature_per_m"
    )
    total_length_mm: Length = Field(description="length of the whole rod")
    shear_modulus_GPa: float | None = Field(
        default=None,
        ge=LEAST_GPA,
        le=MOST_GPA,
        description="stiffness of the rod's material in shear, which resists twist",
    )
    lateral_curvature_per_m: float = Field(
        default=0.0, ge=-1e6, le=1e6, description="curvature of the free rod out of the display's plane"
    )
    set_strength: float | None = Field(
        default=None,
        ge=LEAST_STRENGTH,
        le=MOST_STRENGTH,
        description="how much the rod creeps within an hour, 1 being the estimate for acetal; none for no set",
    )
    set_exponent: float | None = Field(
        default=None,
        ge=LEAST_EXPONENT,
        le=MOST_EXPONENT,
        description="power of time by which it goes on creeping; acetal's is estimated as 0.295",
    )
    relaxation_times_s: list[Seconds] | None = Field(
        default=None,
        max_length=MOST_TERMS,
        description="times within which a bend that is held goes over into set, at 23 C",
    )
    relaxation_fractions: list[Fraction] | None = Field(
        default=None, max_length=MOST_TERMS, description="fraction of a bend for each of them, together below 1"
    )
    temperature_C: float = Field(
        default=REFERENCE_C,
        ge=COLDEST_C,
        le=HOTTEST_C,
        description="of the rod, which takes a set sooner where it is warm",
    )


class LimitsTable(Table):
    """`[limits]` of a display file."""

    height_mm: list[Height] = Field(min_length=PAIR, max_length=PAIR, description="[lowest, highest] of each node")
    angle_deg: list[Angle] = Field(min_length=PAIR, max_length=PAIR, description="[lowest, highest] of each node")
    length_mm: list[Length] = Field(min_length=PAIR, max_length=PAIR, description="[shortest, longest] segment")
    yaw_deg: list[Yaw] = Field(
        default=[-75.0, 75.0], min_length=PAIR, max_length=PAIR, description="[lowest, highest] of each node"
    )
    roll_deg: list[Roll] = Field(
        default=[-3600.0, 3600.0], min_length=PAIR, max_length=PAIR, description="[lowest, highest] of each node"
    )


class DriveTable(Table):
    """`[drive]` of a display file; the accelerations default to what the reference node does."""

    counts_per_turn: Positive = Field(description="encoder counts per turn of a gearbox's output")
    extrude_mm_per_turn: Positive = Field(description="rod fed per turn")
    translate_mm_per_turn: Positive = Field(description="height gained per turn")
    bias_deg_per_turn: Positive = Field(description="angle turned per turn")
    extrude_mm_per_s: Speed = Field(description="fastest feed")
    translate_mm_per_s: Speed = Field(description="fastest lift")
    bias_deg_per_s: Speed = Field(description="fastest turn of a node")
    extrude_mm_per_s2: Speed = Field(default=100.0, description="acceleration of the feed")
    translate_mm_per_s2: Speed = Field(default=50.0, description="acceleration of the lift")
    bias_deg_per_s2: Speed = Field(default=200.0, description="acceleration of the turn")
    max_force_N: Positive = Field(description="what the translate and extrude motors give")
    max_moment_Nmm: Positive = Field(description="what the bias motor gives")


class RadioTable(Table):
    """`[radio]` of a display file."""

    channel: int = Field(ge=0, le=MAX_CHANNEL, description="radio channel, 0 to 125, in MHz above 2400")
    data_rate: Literal["250kbps", "1Mbps", "2Mbps"] = Field(description='"250kbps", "1Mbps" or "2Mbps"')
    addresses: list[Address] = Field(max_length=MAX_NODES, description="ten hexadecimal digits for each node")


Relative = Annotated[float, Field(ge=-90.0, le=900.0)]
Giving = Annotated[float, Field(ge=1e-6, allow_inf_nan=True)]
Play = Annotated[float, Field(ge=0.0, le=45.0)]
Held = Annotated[float, Field(ge=0.0, le=1e9)]
Kept = Annotated[float, Field(ge=-100.0, le=100.0)]


def _range(example: list[float], description: str) -> Any:
    return Field(
        default=None, min_length=PAIR, max_length=PAIR, examples=[example], description=f"[from, to] {description}"
    )


class ErrorsTable(Table):
    """`[errors]` of a display file: what the display may be in truth, for `plan --monte-carlo`."""

    stiffness_percent: list[Relative] | None = _range([-20.0, 5.0], "by which the rod is stiffer than this file says")
    mass_percent: list[Relative] | None = _range([-3.0, 3.0], "by which the rod is heavier than this file says")
    clamp_stiffness_Nmm_per_deg: list[Giving] | None = _range(
        [50.0, math.inf], "of the bearings' stiffness; inf for a rigid one"
    )
    clamp_play_deg: list[Play] | None = _range([0.0, 0.5], "of how far a bearing tilts, either way, at no moment")
    clamp_mm: list[Held] | None = _range([10.0, 20.0], "of the rod that a bearing holds straight")
    span_error_mm: list[Height] | None = _range([-1.0, 1.0], "by which a gap between nodes is wider, drawn for each")
    friction_mm: list[Held] | None = _range(
        [0.0, 0.5], "of the rod that a bearing holds back, either way, before it slides"
    )
    set_percent: list[Kept] | None = _range([0.0, 10.0], "of the other state's curvature that the rod keeps")


Turned = Annotated[float, Field(ge=-10.0, le=10.0)]
Longer = Annotated[float, Field(ge=-20.0, le=20.0)]


class OffsetsTable(Table):
    """`[offsets]` of a display file: between what the display is told and what it does."""

    angle_deg: list[Turned] | None = Field(
        default=None,
        max_length=MAX_NODES,
        examples=[[0.2, -0.1]],
        description="by which each node turns further than it is told",
    )
    length_mm: list[Longer] | None = Field(
        default=None,
        max_length=MAX_NODES,
        examples=[[0.3]],
        description="by which each segment has more rod than it is told",
    )


class DisplayTable(Table):
    """A display file."""

    name: Name = Field(description="the name of the display")
    nodes: int = Field(ge=2, le=MAX_NODES, description="number of nodes")
    span_mm: Length = Field(description="distance between neighbouring nodes")
    clamp_mm: float = Field(ge=0.0, le=1e9, description="rod held straight by a node's bearing, 0 for none")
    clamp_stiffness_Nmm_per_deg: Positive | None = Field(
        default=None, description="moment under which a bearing tilts by one degree; none for a rigid one"
    )
    clamp_play_deg: float = Field(
        default=0.0, ge=0.0, le=45.0, description="how far a bearing tilts, either way, at no moment"
    )
    gravity: Annotated[bool | list[float], PlainValidator(_flag_or_direction)] = Field(
        description="true if the display stands upright, false for no weight, or [x, y, z], the direction of gravity"
    )
    rod: RodTable = Field(description="the table of the rod's properties")
    limits: LimitsTable = Field(description="the table of what nodes and segments may be asked for")
    drive: DriveTable = Field(description="the table of the motors")
    radio: RadioTable = Field(description="the table of the radio's settings")
    errors: ErrorsTable = Field(default=ErrorsTable(), description="the table of what the display may be in truth")
    offsets: OffsetsTable = Field(
        default=OffsetsTable(), description="the table of how the display differs from what it is told"
    )


class LineTable(Table):
    """One item of `lines` of a folder's manifest."""

    name: str = Field(max_length=LONGEST_LINE_NAME, description="what the line is called")
    plan: Name = Field(description="the plan of the line, or a shape, as a path within the folder")
    display: Name | None = Field(
        default=None,
        description="the display of the line, built in or a file within the folder, which its plan must fit",
    )
    radio: Name | None = Field(default=None, description='how its nodes are reached, such as "serial:/dev/ttyACM0"')
    current_A: float | None = Field(default=None, gt=0.0, le=1e6, description="what the line draws while it moves")


class LinesTable(Table):
    """The manifest of a folder of lines, `lines.toml`."""

    name: Name | None = Field(
        default=None, description="what all lines together are called; that of the folder if left out"
    )
    current_limit_A: float | None = Field(
        default=None, gt=0.0, le=1e6, description="what all lines that move at the same time may draw together"
    )
    lines: list[LineTable] = Field(min_length=1, max_length=MAX_LINES, description="one table per line, front to back")
    surface: dict[str, Any] = Field(default={}, description="what made the folder, of which sending takes no notice")

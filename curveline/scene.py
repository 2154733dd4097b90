"""What is to be shown: frozen descriptions of rod, display and shape, in SI units and radians.

A `Scene` is complete: physics and planning need nothing else. `shapes.files` builds scenes from files.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass, fields, replace
from functools import cache, cached_property
from numbers import Real
from typing import TYPE_CHECKING, Any

from curveline.errors import InvalidInput
from curveline.material.relaxation import Relaxation
from curveline.sections import CrossSection
from curveline.units import STANDARD_GRAVITY, deg, nmm, to_gpa, to_nmm2

if TYPE_CHECKING:
    from curveline.material.past import Past

PEAK = "peak"
VALLEY = "valley"
STRAIGHT = "straight"
"""What the state of a segment is called: the last one if it has no rod to spare."""
WANTABLE = (PEAK, VALLEY, STRAIGHT)
"""The states that a shape may ask for."""
LOST = "lost"
BUCKLED = "buckled"
UNNAMED = (LOST, BUCKLED)
"""What a segment is said to be whose rod is in no stable state, or out of the plane; it is not known again by that."""

Vector = tuple[float, float, float]
DOWN: Vector = (0.0, -1.0, 0.0)
"""Gravity's direction in a display that stands upright; +x runs along the row of nodes, +z towards the viewer."""


_MEASURES = ("float", "Vector", "tuple[float, float]", "tuple[float, ...]")
"""Types of the fields that are measured; what is counted stays whole."""


class _Measured:
    """Makes floats of whole numbers where something is measured: kernels are compiled for floats and take no others."""

    def __post_init__(self) -> None:
        kind: Any = type(self)
        for name in _measures(kind):
            value = getattr(self, name)
            if type(value) is not float:
                object.__setattr__(self, name, _measured(value))


@cache
def _measures(kind: Any) -> tuple[str, ...]:
    """The fields of a description that are numbers in SI, or several of them."""
    return tuple(each.name for each in fields(kind) if each.type in _MEASURES)


def _measured(value: Any) -> Any:
    if isinstance(value, tuple):
        return tuple(map(_measured, value))
    return float(value) if isinstance(value, Real) else value


@dataclass(frozen=True)
class Profile(_Measured):
    """A curvature that varies along the rod: `values` [1/m] at `places` [m] from its left end, a smooth curve between.

    Beyond the first and the last place it stays as it is there.
    """

    places: tuple[float, ...]
    values: tuple[float, ...]


@dataclass(frozen=True)
class Rod(_Measured):
    """The flexible rod.

    `section` is an effective one where a rod is no plain strip: see the display files. Where the bending stiffness
    itself was measured (`is_stiffness_measured`), `youngs_modulus` is the one that gives it with this section.
    """

    youngs_modulus: float  # [Pa]
    section: CrossSection
    mass_per_length: float  # [kg/m]
    max_strain: float  # of the surface, beyond which a plan is refused
    natural_curvature: float  # [1/m]
    total_length: float  # [m]
    shear_modulus: float  # [Pa]
    lateral_curvature: float = 0.0  # [1/m] of the free rod out of the plane, positive where it turns towards the viewer
    is_stiffness_measured: bool = False
    profile: Profile | None = None  # of natural curvature beside the uniform one, where it varies along the rod
    relaxation: Relaxation | None = None  # by which it takes a set; None if it takes none

    @property
    def width(self) -> float:
        """Size across the display's plane [m]."""
        return self.section.width

    @property
    def thickness(self) -> float:
        """Size in the display's plane [m]."""
        return self.section.thickness

    @property
    def bending_stiffness(self) -> float:
        """EI [N m^2] for bending in the display's plane."""
        return self.youngs_modulus * self.section.second_moment

    @property
    def lateral_bending_stiffness(self) -> float:
        """EI [N m^2] for bending out of the display's plane."""
        return self.youngs_modulus * self.section.lateral_second_moment

    @property
    def stretching_stiffness(self) -> float:
        """EA [N]."""
        return self.youngs_modulus * self.section.area

    @property
    def twisting_stiffness(self) -> float:
        """GJ [N m^2]."""
        return self.shear_modulus * self.section.torsion_constant

    @property
    def polar_gyration(self) -> float:
        """Radius of gyration [m] of the section about the rod's axis."""
        section = self.section
        return math.sqrt((section.second_moment + section.lateral_second_moment) / section.area)

    @property
    def weight_per_length(self) -> float:
        """Weight per length [N/m] under standard gravity."""
        return self.mass_per_length * STANDARD_GRAVITY

    @property
    def max_curvature(self) -> float:
        """Largest bending curvature [1/m] away from the natural one that keeps the strain below `max_strain`."""
        return 2.0 * self.max_strain / self.thickness

    @property
    def stiffness_key(self) -> str:
        """The key of a display file that its stiffness came from."""
        return "bending_stiffness_Nmm2" if self.is_stiffness_measured else "youngs_modulus_GPa"

    @property
    def as_given(self) -> dict[str, float]:
        """Cross-section and stiffness by the keys and in the units of a display file, those that follow, too."""
        return {
            **self.section.sizes_mm,
            "youngs_modulus_GPa": to_gpa(self.youngs_modulus),
            "bending_stiffness_Nmm2": to_nmm2(self.bending_stiffness),
            "shear_modulus_GPa": to_gpa(self.shear_modulus),
        }

    def surface_strain(self, curvature: float) -> float:
        """Strain of the surface where the rod bends in the plane by `curvature` [1/m] away from its natural one."""
        return 0.5 * self.thickness * curvature


@dataclass(frozen=True)
class Range(_Measured):
    """A closed interval."""

    low: float  # inclusive
    high: float  # inclusive

    def contains(self, value: float, slack: float = 0.0) -> bool:
        """True if `value` lies inside, or outside by at most `slack`."""
        return self.low - slack <= value <= self.high + slack

    def at(self, share: float) -> float:
        """The value at a share of the way from the low end to the high one."""
        return self.low + share * (self.high - self.low)


@dataclass(frozen=True)
class DisplayErrors:
    """What a display may be in truth, the same in a whole run: a range of each number; None if it is as its file says.

    No part of a range is likelier than another; of `clamp_stiffness`, no part of the compliance, so that it may end in
    an infinite one. `stiffness` and `mass` are parts of what the file says: -0.1 is a tenth less; the first is that of
    every stiffness of the rod. `span` says by how much a gap is wider, and is drawn for each. `friction` is how much
    rod a bearing holds back, either way, before it slides. `set_share` is what part of the other state's curvature the
    rod keeps. Raises InvalidInput for a range that is empty, or that no display can have.
    """

    stiffness: Range | None = None
    mass: Range | None = None
    clamp_stiffness: Range | None = None  # [N m/rad]
    clamp_play: Range | None = None  # [rad]
    clamp: Range | None = None  # [m]
    span: Range | None = None  # [m]
    friction: Range | None = None  # [m]
    set_share: Range | None = None

    def __post_init__(self) -> None:
        for name, (least, most) in POSSIBLE.items():
            drawn: Range | None = getattr(self, name)
            if drawn is None:
                continue
            if not drawn.low <= drawn.high:
                message = f"the error {name} has no range: {drawn.low:g} to {drawn.high:g}"
                raise InvalidInput(message, "give the lower end first")
            if drawn.low < least or drawn.high > most:
                message = f"the error {name} is {drawn.low:g} to {drawn.high:g}, in SI, which no display can have"
                raise InvalidInput(message, f"stay within {least:g} to {most:g}")

    @cached_property
    def given(self) -> dict[str, Range]:
        """Those of which there is a range, by name."""
        named = ((each.name, getattr(self, each.name)) for each in fields(self))
        return {name: drawn for name, drawn in named if drawn is not None}

    def over(self, others: DisplayErrors) -> DisplayErrors:
        """These, and what others there are beside them."""
        return replace(others, **self.given)


POSSIBLE = {
    "stiffness": (-0.9, 9.0),
    "mass": (-0.9, 9.0),
    "clamp_stiffness": (nmm(1e-6) / deg(1.0), math.inf),
    "clamp_play": (0.0, deg(45.0)),
    "clamp": (0.0, 1e6),
    "span": (-1e6, 1e6),
    "friction": (0.0, 1e6),
    "set_share": (-1.0, 1.0),
}
"""The least and the most that a display may be in truth, as in `DisplayErrors`."""


@dataclass(frozen=True)
class Limits:
    """What a display may be asked for."""

    height: Range  # [m] of each node
    angle: Range  # [rad] of each node
    length: Range  # [m] of each segment
    yaw: Range  # [rad] of each node
    roll: Range  # [rad] of each node


@dataclass(frozen=True)
class Axis(_Measured):
    """One motorised degree of freedom: `counts_per_unit` is per metre (extrude, translate) or radian (bias)."""

    counts_per_unit: float
    speed: float  # [m/s] or [rad/s]
    acceleration: float  # [m/s^2] or [rad/s^2]


@dataclass(frozen=True)
class Drive(_Measured):
    """The three motors of a node."""

    extrude: Axis  # feeds the rod
    bias: Axis  # turns the node
    translate: Axis  # lifts the node
    max_force: float  # [N]
    max_moment: float  # [N m]


@dataclass(frozen=True)
class RadioSettings:
    """How the nodes are reached; one 5-byte address per node, as hexadecimal digits."""

    channel: int  # 0 to 125, 2400 MHz and so many more
    data_rate: str  # such as 1Mbps
    addresses: tuple[str, ...]  # left to right


@dataclass(frozen=True)
class Offsets(_Measured):
    """How much further than told each node turns, and how much more rod each segment has; empty for none."""

    angles: tuple[float, ...] = ()  # [rad] one per node
    lengths: tuple[float, ...] = ()  # [m] one per segment

    def angle(self, node: int) -> float:
        """That of a node, from 0 [rad]."""
        return self.angles[node] if self.angles else 0.0

    def length(self, segment: int) -> float:
        """That of a segment, from 0 [m]."""
        return self.lengths[segment] if self.lengths else 0.0


@dataclass(frozen=True)
class Display(_Measured):
    """A row of nodes `span` apart, the rod that runs through them, and what they can do."""

    name: str  # of the display
    node_count: int  # at least 2
    span: float  # [m] between neighbouring nodes
    clamp: float  # [m] of rod held straight by a node's bearing, centred on its pivot
    gravity: bool  # False for a rod that lies on a table
    rod: Rod  # that runs through all nodes
    limits: Limits  # what shapes may ask for
    drive: Drive  # the motors of every node
    radio: RadioSettings  # how the nodes are reached
    digest: str = ""  # sha256 of the display file
    path: str = ""  # absolute, of the display file; empty for a built-in one
    down: Vector = DOWN  # unit vector along which gravity acts, if it does
    clamp_stiffness: float = math.inf  # [N m/rad] of a bearing, against a turn of the rod at its mouth
    clamp_play: float = 0.0  # [rad] by which the rod turns there, either way, before it meets that stiffness
    errors: DisplayErrors = DisplayErrors()  # what it may be in truth
    offsets: Offsets = Offsets()  # between what it is told and what it does

    @property
    def as_told(self) -> Display:
        """The same display that does what it is told."""
        return replace(self, offsets=Offsets())

    def material_at(self, node: int, feed: float) -> float:
        """What of the rod a `node`, from 0, holds that has fed `feed` [m]: arc length from the rod's left end [m].

        At home the rod lies centred. It is 0 for a rod that is alike all along, which is as it was, however it is fed.
        """
        if self.rod.profile is None:
            return 0.0
        return 0.5 * (self.rod.total_length - self.span * (self.node_count - 1)) + node * self.span - feed

    @property
    def weight(self) -> Vector:
        """Weight per length of the rod as a vector [N/m]; zero without gravity."""
        size = self.rod.weight_per_length if self.gravity else 0.0
        x, y, z = self.down
        return size * x, size * y, size * z


@dataclass(frozen=True)
class Node(_Measured):
    """Where a node holds the rod: pivot height and direction of the tangent from +x, counter-clockwise.

    `yaw` turns the tangent out of the plane, towards the viewer, then `roll` the rod about its tangent, right-handed.
    The rod between two nodes is twisted by the roll of the right one less that of the left one, full turns included.
    """

    height: float  # [m]
    angle: float  # [rad]
    yaw: float = 0.0  # [rad]
    roll: float = 0.0  # [rad]


@dataclass(frozen=True)
class Segment(_Measured):
    """The rod between two neighbouring nodes, measured pivot to pivot, and the state wanted of it."""

    length: float  # [m]
    state: str  # "peak", "valley" or "straight"


@dataclass(frozen=True)
class Load(_Measured):
    """A dead point load on the rod."""

    segment: int  # counted from 0
    at: float  # fraction of the segment's arc length, pivot to pivot
    force: tuple[float, float]  # [N]
    lateral: float = 0.0  # [N] out of the plane, towards the viewer


@dataclass(frozen=True)
class Scene:
    """A shape on a display: node poses left to right, one segment between neighbours, loads."""

    name: str  # of the shape
    display: Display  # the row of nodes and the rod
    nodes: tuple[Node, ...]  # left to right
    segments: tuple[Segment, ...]  # one fewer than nodes, left to right
    loads: tuple[Load, ...] = ()  # dead loads that stay on
    path: str = ""  # of the shape file, as the user named it
    digest: str = ""  # sha256 of the shape file
    begin: float | None = None  # [m] of the rod's material at the first node; None if both tails are equally long
    past: Past | None = None  # what the rod went through before; None for one that remembers nothing
    last: Scene | None = None  # the last shape of that which was not straight, where it is known

    @property
    def beyond_the_plane(self) -> tuple[str, ...]:
        """In words, everything that a planar rod under its weight downwards knows nothing of; empty for most scenes."""
        return tuple(self._beyond_the_plane())

    def _beyond_the_plane(self) -> Iterator[str]:
        for number, node in enumerate(self.nodes, start=1):
            if node.yaw != 0.0:
                yield f"yaw at node {number}"
            if node.roll != 0.0:
                yield f"roll at node {number}"
        for number, load in enumerate(self.loads, start=1):
            if load.lateral != 0.0:
                yield f"load {number} pushing out of the plane"
        if self.display.gravity and self.display.down != DOWN:
            yield "gravity that does not point straight down"
        if self.display.rod.lateral_curvature != 0.0:
            yield "a rod curved out of the plane"

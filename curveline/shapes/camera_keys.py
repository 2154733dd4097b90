"""What a camera file may contain, key by key, in the units people write."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field

from curveline.shapes.file_keys import PAIR, Name, Place, Positive, Table

MOST_TAGS = 587
"""Of the family 36h11."""
COEFFICIENTS = 5

Depth = Annotated[float, Field(ge=-1e4, le=1e4)]
Size = Annotated[float, Field(ge=0.0, le=1e4)]
Pixels = Annotated[int, Field(ge=64, le=65_535)]
Number = Annotated[int, Field(ge=0, lt=MOST_TAGS)]
Coefficient = Annotated[float, Field(ge=-1e3, le=1e3)]
Focal = Annotated[float, Field(ge=10.0, le=1e7)]


class LensTable(Table):
    """`[lens]`."""

    picture_px: list[Pixels] = Field(
        min_length=PAIR, max_length=PAIR, description="[width, height] of the pictures as the sensor takes them"
    )
    focal_px: list[Focal] = Field(min_length=PAIR, max_length=PAIR, description="[across, down] focal length in pixels")
    centre_px: list[float] = Field(
        min_length=PAIR, max_length=PAIR, description="[across, down] where the axis of the lens meets the picture"
    )
    distortion: list[Coefficient] = Field(
        default=[0.0] * COEFFICIENTS,
        min_length=COEFFICIENTS,
        max_length=COEFFICIENTS,
        description="[k1, k2, p1, p2, k3] as OpenCV has them",
    )
    rms_px: Size = Field(default=0.0, description="of the corners that it was calibrated on")
    focal_length_mm: Positive | None = Field(default=None, description="as the pictures tell it")
    film_focal_length_mm: Positive | None = Field(
        default=None, description="the same for 35 mm film, as the pictures tell it"
    )
    camera: Name | None = Field(default=None, description="maker and model, as the pictures tell them")


class TagTable(Table):
    """One item of `tags`."""

    number: Number = Field(description="the number that is printed beside the tag")
    at_mm: Place = Field(description="[x, y] of its middle, from the first rail, heights as those of nodes")
    turn_deg: Annotated[float, Field(ge=-360.0, le=360.0)] = Field(
        default=0.0, description="turn of the tag, counter-clockwise; 0 where its label reads upright"
    )


class FrameTable(Table):
    """`[frame]`."""

    tag_mm: Annotated[float, Field(ge=1.0, le=1e4)] = Field(description="side of the black square of a tag")
    depth_mm: Depth = Field(description="of the tags before the middle of the rod, negative behind it")
    tags: list[TagTable] = Field(
        min_length=PAIR, max_length=MOST_TAGS, description="one table per tag: number, at_mm and turn_deg"
    )


class SeenRodTable(Table):
    """`[rod]`."""

    back_mm: Positive | None = Field(default=None, description="thickness of what has no teeth")
    depth_mm: Positive | None = Field(default=None, description="width of the rod, towards the viewer")
    teeth: Literal["up", "down", "none"] = Field(default="none", description='"up", "down" or "none"')
    teeth_mm: Size = Field(default=0.0, description="height of the teeth")
    pitch_mm: Size = Field(default=0.0, description="from tooth to tooth")
    fibre_mm: Depth = Field(
        default=0.0, description="from the middle of the back to what bends without stretching, towards the teeth"
    )


class SeenNodesTable(Table):
    """`[nodes]`."""

    half_width_mm: Positive | None = Field(default=None, description="of what hides the rod, to either side of a rail")
    half_height_mm: Positive | None = Field(
        default=None, description="of what hides the rod, above and below the pivot of a node"
    )


class CameraTable(Table):
    """A camera file."""

    lens: LensTable = Field(description="`[lens]`, which `curveline camera calibrate PICTURES -o FILE` writes")
    frame: FrameTable = Field(description="`[frame]`, which `curveline camera board -o FILE` writes")
    rod: SeenRodTable = Field(default=SeenRodTable(), description="`[rod]`, what of the rod is seen")
    nodes: SeenNodesTable = Field(default=SeenNodesTable(), description="`[nodes]`, what hides the rod")

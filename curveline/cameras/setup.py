"""What a camera file tells: the lens, the tags on the display's frame, and what a photograph shows of rod and nodes."""

from __future__ import annotations

from dataclasses import dataclass

from curveline.cameras.view import Frame, Lens, SeenRod


@dataclass(frozen=True)
class SeenNode:
    """What of a node hides the rod: a rectangle that is centred on the pivot and stays upright."""

    half_width: float  # [m] along the row
    half_height: float  # [m]


@dataclass(frozen=True)
class CameraSetup:
    """A camera before a display, but for where it stands: that each photograph tells by the tags in it."""

    lens: Lens  # as it was calibrated, for pictures as the camera's sensor takes them
    frame: Frame  # the tags
    rod: SeenRod  # what is seen of it
    node: SeenNode  # what hides the rod
    source: str = ""  # the camera file as the user named it

"""What is legal in a shape file, and hardly meant, is said once, beside the results."""

from __future__ import annotations

from collections.abc import Iterable

from curveline.cli.printing import screen
from curveline.scene import Scene


def remark_on(path: str, scene: Scene) -> None:
    """Say what is odd about a shape that was read from a path."""
    from curveline.shapes.radians import remark_on_radians

    if sentence := remark_on_radians(scene):
        screen.note(f"{path}: {sentence}")


def remark_on_each(scenes: Iterable[Scene]) -> None:
    """As `remark_on`, once per file."""
    for path, scene in {scene.path or scene.name: scene for scene in scenes}.items():
        remark_on(path, scene)

"""`curveline shapes`: the shapes that come with the package."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

from curveline.cli.options import JsonOption
from curveline.cli.printing import screen

if TYPE_CHECKING:
    from curveline.scene import Scene


def shapes(json: JsonOption = False) -> None:
    """List the built-in shapes, each of which can be named wherever a shape file can.

    A file of the same name comes first.
    """
    from curveline._version import __version__
    from curveline.shapes.files import read_shape
    from curveline.shapes.library import builtin_shapes

    found = [(name, file, read_shape(file)) for name, file in builtin_shapes().items()]
    if json:
        screen.emit({"curveline": __version__, "shapes": [_document(*each) for each in found]})
        return
    head = ("shape", "display", "segments", "wanted")
    rows = [(name, scene.display.name, str(len(scene.segments)), ", ".join(_wanted(scene))) for name, _, scene in found]
    screen.result("\n".join(screen.table([head, *rows], frozenset({0, 1, 3}))))


def _document(name: str, file: Path, scene: Scene) -> dict[str, Any]:
    wanted = _wanted(scene)
    return {
        "name": name,
        "display": scene.display.name,
        "segments": len(wanted),
        "wanted": wanted,
        "file": str(file),
    }


def _wanted(scene: Scene) -> list[str]:
    """The state that each segment is to show."""
    return [segment.state for segment in scene.segments]

"""`curveline load`: push at a point of a shape until it snaps through, or at all points, one after another."""

from __future__ import annotations

import sys
from enum import StrEnum
from typing import Annotated

import typer

from curveline.cli import show
from curveline.errors import EXIT_NO, InvalidInput


class State(StrEnum):
    """What `--state` takes."""

    PEAK = "peak"
    VALLEY = "valley"


class Model(StrEnum):
    """What `--model` takes: `MODELS` of a push, which would cost numpy to look at."""

    AUTO = "auto"
    PLANAR = "planar"
    EXTENSIBLE = "extensible"


def _positive(value: float | None) -> float | None:
    """A load that is given must be one."""
    if value is not None and not value > 0.0:
        raise typer.BadParameter(f"{value:g} N is no load: make it more than 0")
    return value


def load(
    shape: Annotated[str, typer.Argument(metavar="SHAPE", help="Shape file (.toml).")],
    at: Annotated[
        float | None, typer.Option(metavar="FRACTION", help="Where, along the rod from pivot to pivot.  [default: 0.5]")
    ] = None,
    segment: Annotated[
        int | None, typer.Option(min=1, metavar="N", help="Segment, from 1; needed where there are several.")
    ] = None,
    direction: Annotated[
        str,
        typer.Option(
            metavar="down|normal|X,Y", help="Which way; normal is across the unloaded curve, from above like a finger."
        ),
    ] = "down",
    step_n: Annotated[
        float | None,
        typer.Option(
            "--step-N", callback=_positive, metavar="N", help="By how much the load grows.  [default: 0.5, as --most-N]"
        ),
    ] = None,
    most_n: Annotated[
        float | None,
        typer.Option(
            "--most-N",
            callback=_positive,
            metavar="N",
            help="The largest load.  [default: 20, or by powers of ten more or less, as suits the rod]",
        ),
    ] = None,
    state: Annotated[
        State | None, typer.Option(help="The state to push, in place of the one that the shape wants.")
    ] = None,
    model: Annotated[
        Model, typer.Option(help="What of the rod is computed: extensible also stretches; with auto the scene decides.")
    ] = Model.AUTO,
    over_all: Annotated[bool, typer.Option("--map", help="Push all points of the curve, one after another.")] = False,
    points: Annotated[
        int | None, typer.Option(min=3, max=10_001, metavar="N", help="Points of a map.  [default: 41]")
    ] = None,
    output: Annotated[
        list[str] | None,
        typer.Option(
            "-o", "--output", metavar="FILE", help="Write .json, .svg or .png; - is JSON on stdout. May be repeated."
        ),
    ] = None,
    force: Annotated[bool, typer.Option("--force", help="Overwrite files that exist.")] = False,
    json: Annotated[bool, typer.Option("--json", help="JSON on stdout, one document.")] = False,
) -> None:
    """Push at a point of the curve, harder and harder, until it snaps through.

    The nodes stay where they are and the load keeps its direction; loads in the shape file stay on. The table gives
    load and deflection, along the load, up to the load at which the state ceases to be stable, at a fold or at a
    bifurcation; below it the state that the rod lands in and the stiffness of the unloaded point.

    With --map every point of the free rod is pushed, and the answer is the weakest point and whether the shape
    withstands 1 N, of a finger that searches for a target, and 2 to 5 N, of one that follows a contour.
    """
    from curveline.cli import pushed
    from curveline.loading import files as loadfiles
    from curveline.loading.pushes import Push
    from curveline.shapefile import read_shape

    if (at if over_all else points) is not None:
        raise InvalidInput(
            *(
                ("--at is one point, --map are all", "leave one out")
                if over_all
                else ("--points is for a map", "add --map")
            )
        )
    files = [path for path in output or () if path != "-"]
    for path in files:
        loadfiles.check_output(path, force=force)
    scene = read_shape(shape)
    index = _index(segment, len(scene.segments))
    push = Push(
        index,
        0.5 if at is None else at,
        direction,
        step_n or 0.0,
        most_n or 0.0,
        state.value if state else "",
        model.value,
    )
    show.announce_compilation()
    found = pushed.mapped(scene, push, points or pushed.MAP_POINTS) if over_all else pushed.pushed(scene, push)
    argv = tuple(sys.argv[1:])
    if json or len(files) < len(output or ()):
        show.result(loadfiles.to_json(found, argv).decode().rstrip("\n"))
    else:
        show.result("\n".join(pushed.describe(found)))
    for path in files:
        loadfiles.write(found, path, argv, force=force)
        show.note(f"wrote {path}")
    if pushed.is_lost(found):
        show.note("the branch could not be followed to where it ends: the load said is one that it withstands")
        raise typer.Exit(EXIT_NO)


def _index(segment: int | None, count: int) -> int:
    """Number, from 0, of the segment that is meant."""
    if segment is None and count > 1:
        raise InvalidInput(f"the shape has {count} segments", f"say which to push, with --segment 1 to {count}")
    return (segment or 1) - 1

"""`curveline load`: push at a point of a shape until it snaps through, or at all points, one after another."""

from __future__ import annotations

import sys
from collections.abc import Sequence
from enum import StrEnum
from typing import TYPE_CHECKING, Annotated

import typer

from curveline.cli.options import RESULTS, BriefOption, ForceOption, JsonOption
from curveline.cli.printing import screen
from curveline.cli.terminal import TERMINAL
from curveline.errors import EXIT_NO, InvalidInput

if TYPE_CHECKING:
    from curveline.loading.snap_through import Loading
PUSH = "The push"


class StateOption(StrEnum):
    """What `--state` takes."""

    PEAK = "peak"
    VALLEY = "valley"
    STRAIGHT = "straight"


class PushModelOption(StrEnum):
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
        float | None,
        typer.Option(
            metavar="FRACTION",
            rich_help_panel=PUSH,
            show_default="0.5",
            help="Where, along the rod from pivot to pivot.",
        ),
    ] = None,
    segment: Annotated[
        int | None,
        typer.Option(
            "-s",
            "--segment",
            min=1,
            metavar="N",
            rich_help_panel=PUSH,
            help="Segment, from 1; needed where there are several.",
        ),
    ] = None,
    direction: Annotated[
        str,
        typer.Option(
            metavar="down|normal|X,Y",
            rich_help_panel=PUSH,
            help="Which way; normal is across the unloaded curve, from above like a finger.",
        ),
    ] = "down",
    step_n: Annotated[
        float | None,
        typer.Option(
            "--step-N",
            callback=_positive,
            metavar="N",
            rich_help_panel=PUSH,
            show_default="0.5, or as suits the rod",
            help="By how much the load grows, in N.",
        ),
    ] = None,
    most_n: Annotated[
        float | None,
        typer.Option(
            "--most-N",
            callback=_positive,
            metavar="N",
            rich_help_panel=PUSH,
            show_default="20, or by powers of ten more or less, as suits the rod",
            help="The largest load, in N.",
        ),
    ] = None,
    state: Annotated[
        StateOption | None,
        typer.Option(rich_help_panel=PUSH, help="The state to push, in place of the one that the shape wants."),
    ] = None,
    model: Annotated[
        PushModelOption,
        typer.Option(
            "-m",
            "--model",
            metavar="MODEL",
            rich_help_panel=PUSH,
            help="What of the rod is computed: extensible also stretches; with auto the scene decides.",
        ),
    ] = PushModelOption.AUTO,
    over_all: Annotated[
        bool, typer.Option("--map", rich_help_panel=PUSH, help="Push all points of the curve, one after another.")
    ] = False,
    points: Annotated[
        int | None,
        typer.Option(
            "-p",
            "--points",
            min=3,
            max=10_001,
            metavar="N",
            rich_help_panel=PUSH,
            show_default="41",
            help="Points of a map.",
        ),
    ] = None,
    output: Annotated[
        list[str] | None,
        typer.Option(
            "-o",
            "--output",
            metavar="FILE",
            rich_help_panel=RESULTS,
            help="Write .json, .svg, .png or .pdf; - is JSON on stdout.",
        ),
    ] = None,
    film: Annotated[
        str | None,
        typer.Option(
            metavar="FILE",
            rich_help_panel=RESULTS,
            help="Film the fall of the shape that snaps: .gif, or .svg, .png, .pdf for a strobe picture.",
        ),
    ] = None,
    force: ForceOption = False,
    json: JsonOption = False,
    brief: BriefOption = False,
) -> None:
    """Push at a point of the curve, harder and harder, until it snaps through.

    The nodes stay where they are and the load keeps its direction; loads in the shape file stay on. The table gives
    load and deflection, along the load, up to the load at which the state ceases to be stable, at a fold or at a
    bifurcation; below it the state that the rod lands in and the stiffness of the unloaded point.

    With --map every point of the free rod is pushed, and the answer is the weakest point and whether the shape
    withstands 1 N, of a finger that searches for a target, and 2 to 5 N, of one that follows a contour.

    With --film the shape is shown as it is pushed, snaps and falls with its inertia into the state where it lands,
    slowed down so that it can be watched.
    """
    from curveline.cli.printing.reports import load_report
    from curveline.loading.pushes import Push
    from curveline.loading.results import to_json
    from curveline.loading.snap_through import Loading
    from curveline.outputs import LOADING, write_output
    from curveline.shapes.files import read_shape
    from curveline.shapes.radians import tell_of_radians

    if over_all:
        _check_map(at=at, film=film)
    elif points is not None:
        raise InvalidInput("--points is for a map", "add --map")
    files = [path for path in output or () if path != "-"]
    _check_files(files, film, force=force)
    scene = read_shape(shape)
    tell_of_radians([scene], TERMINAL)
    push = Push(
        _index(segment, len(scene.segments)),
        0.5 if at is None else at,
        direction,
        step_n or 0.0,
        most_n or 0.0,
        state.value if state else "",
        model.value,
        tuple(sys.argv[1:]),
    )
    TERMINAL.computing()
    found = load_report.found(scene, push, points or load_report.MAP_POINTS if over_all else None)
    if json or len(files) < len(output or ()):
        screen.result(to_json(found).decode().rstrip("\n"))
    else:
        screen.result("\n".join(load_report.describe(found)))
    for path in files:
        write_output(LOADING, path, (found,), force=force)
        screen.note(f"wrote {path}")
    if film is not None and isinstance(found, Loading):
        _film(found, film, force=force)
    if load_report.is_lost(found):
        screen.note("the branch could not be followed to where it ends: the load said is one that it withstands")
        raise typer.Exit(EXIT_NO)


def _check_map(at: float | None, film: str | None) -> None:
    """InvalidInput for what makes sense of one point only."""
    if at is not None:
        raise InvalidInput("--at is one point, --map are all", "leave one out")
    if film is not None:
        raise InvalidInput("--film shows one push, --map makes many", "leave one out")


def _check_files(files: Sequence[str], film: str | None, *, force: bool) -> None:
    """Refuse what could not be written, before anything is computed."""
    from curveline.outputs import FALL, LOADING, check_output

    for path in files:
        check_output(LOADING, path, force=force)
    if film is not None:
        check_output(FALL, film, force=force)
        if film in files:
            raise InvalidInput(f"{film} is named by -o and by --film", "give each a file of its own")


def _index(segment: int | None, count: int) -> int:
    """Number, from 0, of the segment that is meant."""
    if segment is None and count > 1:
        raise InvalidInput(f"the shape has {count} segments", f"say which to push, with --segment 1 to {count}")
    return (segment or 1) - 1


def _film(loading: Loading, path: str, *, force: bool) -> None:
    """Film the fall of a pushed shape, or draw it; Infeasible if it does not snap."""
    from curveline.cli.printing.progress.progress_bar import Bar
    from curveline.figures import falls
    from curveline.loading.falling import PARTS, fall_of
    from curveline.outputs import FALL, FILM, write_output

    with Bar("falling, parts", PARTS) as bar:
        fall = fall_of(loading, bar.reach)
    is_film = FALL.suffix_of(path) == FILM
    with Bar("film, frames" if is_film else "figure", falls.parts_of(fall) if is_film else 1) as bar:
        write_output(FALL, path, (fall, bar.reach), force=force)
    screen.note(f"wrote {path}: falls for {falls.seconds_of(fall):.3g} s, {falls.ending_of(fall)}")

"""`curveline fit`: from a drawn curve to the shape of a display that shows it."""

from __future__ import annotations

import os
import sys
from collections.abc import Sequence
from enum import StrEnum
from typing import TYPE_CHECKING, Annotated

import typer

from curveline.cli import completion
from curveline.cli.options import RESULTS, BriefOption, ForceOption, JsonOption
from curveline.cli.printing import screen
from curveline.cli.terminal import TERMINAL
from curveline.drive_settings import DEFAULT_DISPLAY
from curveline.errors import EXIT_NO, InvalidInput
from curveline.units import mm, to_mm

if TYPE_CHECKING:
    from curveline.drawings.drawing import Drawing
    from curveline.drawings.sketch import HowToRead
    from curveline.fitting.fewest import FewestNodes
    from curveline.fitting.fit import Fit, FitRequest
    from curveline.scene import Display

DRAWING = "The drawing"
FITTING = "The fit"


class PlaceOption(StrEnum):
    """What `--place` takes."""

    FIT = "fit"
    AS_DRAWN = "as-drawn"


class EdgeOption(StrEnum):
    """What `--edge` takes."""

    UPPER = "upper"
    LOWER = "lower"


class ScaleOption(StrEnum):
    """What `--scale` takes."""

    WIDTH = "width"


class MinimiseOption(StrEnum):
    """What `--minimise` takes."""

    RMS = "rms"
    MAX = "max"


class EffortOption(StrEnum):
    """What `--effort` takes."""

    QUICK = "quick"
    THOROUGH = "thorough"


def fit(
    target: Annotated[
        str | None, typer.Argument(metavar="TARGET", help="The drawing: .csv, .svg, .dxf, .png or .jpg.")
    ] = None,
    formula: Annotated[
        str | None,
        typer.Option(
            metavar="TEXT",
            rich_help_panel=DRAWING,
            help="Instead of a file: the height in mm at x in mm, such as 60*sin(pi*x/500).",
        ),
    ] = None,
    unit: Annotated[
        str | None,
        typer.Option(metavar="UNIT", rich_help_panel=DRAWING, help="What a unit of the file is: mm, cm, m, in, ..."),
    ] = None,
    curve: Annotated[
        str | None, typer.Option(metavar="NAME", rich_help_panel=DRAWING, help="Which of several curves of the file.")
    ] = None,
    edge: Annotated[
        EdgeOption | None, typer.Option(rich_help_panel=DRAWING, help="Which side of an outline or of a silhouette.")
    ] = None,
    width_mm: Annotated[
        float | None,
        typer.Option(metavar="MM", rich_help_panel=DRAWING, help="How wide the curve is, of a file without a scale."),
    ] = None,
    place: Annotated[
        PlaceOption | None,
        typer.Option(
            rich_help_panel=DRAWING,
            show_default="fit, a formula as-drawn",
            help="Put its left end on the first rail, or take its coordinates as they are.",
        ),
    ] = None,
    shift_mm: Annotated[
        float, typer.Option(metavar="MM", rich_help_panel=DRAWING, help="Move it along the row.")
    ] = 0.0,
    flip: Annotated[bool, typer.Option("--flip", rich_help_panel=DRAWING, help="Turn it upside down.")] = False,
    scale: Annotated[
        ScaleOption | None, typer.Option(rich_help_panel=DRAWING, help="Make it as wide as the display.")
    ] = None,
    display: Annotated[
        str,
        typer.Option(
            "-d",
            "--display",
            metavar="NAME|FILE",
            autocompletion=completion.displays,
            rich_help_panel=FITTING,
            help="A built-in display, or a display file.",
        ),
    ] = DEFAULT_DISPLAY,
    minimise: Annotated[
        MinimiseOption, typer.Option(rich_help_panel=FITTING, help="The mean distance, or the largest.")
    ] = MinimiseOption.RMS,
    margin: Annotated[
        float,
        typer.Option(
            metavar="PART",
            rich_help_panel=FITTING,
            help="Stability that every state keeps, 1 being a straight rod's; with less fewer shapes have a plan.",
        ),
    ] = 0.12,
    within_mm: Annotated[
        float | None,
        typer.Option(metavar="MM", rich_help_panel=FITTING, help="Exit with 1 if the distance is larger."),
    ] = None,
    nodes: Annotated[
        int | None,
        typer.Option(
            min=2,
            metavar="N",
            rich_help_panel=FITTING,
            help="As few nodes as come within --within-mm, at most N, rails equally spaced over the width of the "
            "display; it goes beside the shape.",
        ),
    ] = None,
    effort: Annotated[
        EffortOption, typer.Option(rich_help_panel=FITTING, help="How many starts to search from.")
    ] = EffortOption.QUICK,
    seed: Annotated[int, typer.Option(min=0, metavar="N", rich_help_panel=FITTING, help="Of the starts.")] = 1,
    no_plan: Annotated[bool, typer.Option("--no-plan", rich_help_panel=FITTING, help="Do not plan the shape.")] = False,
    output: Annotated[
        list[str] | None,
        typer.Option(
            "-o",
            "--output",
            metavar="FILE",
            rich_help_panel=RESULTS,
            help="Write the shape (.toml), all of it (.json), or a figure (.svg, .png, .pdf); - is JSON on stdout.",
        ),
    ] = None,
    plan_file: Annotated[
        str | None, typer.Option(metavar="FILE", rich_help_panel=RESULTS, help="Write the plan (.json), to be sent.")
    ] = None,
    force: ForceOption = False,
    json: JsonOption = False,
    brief: BriefOption = False,
) -> None:
    """Find the shape of a display whose stable curve is nearest to a drawn one, and plan it.

    Node heights and angles, lengths of rod and states are sought within the display's limits, its motor forces, the
    strain and the length of its rod, so that every state is stable with a margin. The distance that is told is measured
    on the curve that `curveline simulate` gives, from the curve to the drawing and back; where it is large it says why.
    The search is as good as its starts: it says how many led to the shape, and proves nothing.

    A drawing is never scaled unless --scale says so. Its left end is put on the first rail, at the home height or as
    near to it as the display can; --place as-drawn takes x from the first rail on and y from the home height.

    Exit code 1 says that --within-mm is missed, or that the shape has no plan; it is written all the same.
    """
    from curveline.cli.printing.reports.fit_text import describe
    from curveline.fitting.fit import FitRequest, fit_drawing
    from curveline.fitting.results import to_json
    from curveline.shapes.files import given_display

    files = [path for path in output or () if path != "-"]
    _check_files(files, plan_file, force=force, is_planned=not no_plan)
    if within_mm is not None and not within_mm > 0.0:
        raise InvalidInput(f"no curve is within {within_mm:g} mm", "choose a distance above 0, such as 2")
    request = FitRequest(margin, minimise.value, effort.value, not no_plan, seed, _name(files, target))
    given = given_display(display)
    drawing = _read(target, formula, _how(unit, curve, edge, width_mm), given)
    where = place or (PlaceOption.AS_DRAWN if formula else PlaceOption.FIT)
    target_curve = _placed(drawing, given, where, (shift_mm, flip, scale))
    if nodes is None:
        found = fit_drawing(target_curve, given, request, TERMINAL)
    else:
        found = _fewest(target_curve, given, _fewest_nodes(nodes, within_mm, files, force=force), request)
    _write(found, files, plan_file, force=force)
    if json or len(files) < len(output or ()):
        screen.result(to_json(found, argv=tuple(sys.argv[1:])).decode().rstrip("\n"))
    else:
        screen.result("\n".join(describe(found)))
    _conclude(found, files, within_mm)


def _check_files(files: Sequence[str], plan_file: str | None, *, force: bool, is_planned: bool) -> None:
    """Refuse what could not be written, before anything is computed."""
    from curveline.outputs import FIT, PLAN, PLAN_FILE, check_output

    for path in files:
        check_output(FIT, path, force=force)
    named = [os.path.realpath(path) for path in files]
    if twice := next((path for path, real in zip(files, named, strict=True) if named.count(real) > 1), None):
        raise InvalidInput(f"{twice} is named twice by -o", "give each a file of its own")
    if plan_file is None:
        return
    if not is_planned:
        raise InvalidInput("--plan-file is for a plan, and --no-plan for none", "leave one out")
    if PLAN.suffix_of(plan_file) != PLAN_FILE:
        raise InvalidInput(f"{plan_file}: a plan to be sent ends in {PLAN_FILE}", "name it so")
    check_output(PLAN, plan_file, force=force)
    if os.path.realpath(plan_file) in named:
        raise InvalidInput(f"{plan_file} is named by -o and by --plan-file", "give each a file of its own")


def _name(files: Sequence[str], target: str | None) -> str:
    """What the shape calls itself: as the file that it goes to, or as the drawing's file."""
    named = next((path for path in files if path.endswith(".toml")), target or "")
    return os.path.splitext(os.path.basename(named))[0]


def _how(unit: str | None, curve: str | None, edge: EdgeOption | None, width_mm: float | None) -> HowToRead:
    """How to read a file."""
    from curveline.drawings.sketch import HowToRead

    return HowToRead(unit or "", curve or "", edge.value if edge else "", width_mm)


def _read(target: str | None, formula: str | None, how: HowToRead, display: Display) -> Drawing:
    """The drawing that was named; InvalidInput unless it is one, from a file or by a formula."""
    from curveline.drawings.formulas import drawing_of_formula
    from curveline.drawings.reading import read_drawing
    from curveline.drawings.sketch import HowToRead
    from curveline.fitting.targets import width_of

    if (target is None) is (formula is None):
        raise InvalidInput("name one drawing", 'a file, or --formula "60*sin(pi*x/500)"')
    if target is not None:
        return read_drawing(target, how)
    if how != HowToRead():
        raise InvalidInput("--unit, --curve, --edge and --width-mm are for files", "a formula is in mm: leave them out")
    return drawing_of_formula(formula or "", width_of(display))


def _placed(
    drawing: Drawing, display: Display, place: PlaceOption, others: tuple[float, bool, ScaleOption | None]
) -> Drawing:
    """The drawing where it goes on the display."""
    from curveline.drawings.placing import Placing
    from curveline.fitting.targets import placed_on

    shift_mm, flip, scale = others
    return placed_on(display, drawing, Placing(place.value, shift_mm, flip, scale.value if scale else ""))


def _fewest_nodes(nodes: int, within_mm: float | None, files: Sequence[str], *, force: bool) -> FewestNodes:
    """What `--nodes` asks for; the file of the display goes beside that of the shape."""
    from curveline.fitting.fewest import FewestNodes
    from curveline.system.files import check_writable

    if within_mm is None:
        raise InvalidInput("--nodes is for as few nodes as come near enough", "say how near with --within-mm")
    shape = next((path for path in files if path.endswith(".toml")), None)
    if shape is None:
        raise InvalidInput("--nodes makes a display, which goes beside its shape", "name that with -o SHAPE.toml")
    path = f"{os.path.abspath(shape).removesuffix('.toml')}-display.toml"
    check_writable(path, force=force)
    return FewestNodes(mm(within_mm), nodes, path)


def _fewest(drawing: Drawing, display: Display, wanted: FewestNodes, request: FitRequest) -> Fit:
    """The fit with as few nodes as are enough, whose display's file is written: its shape and its plan name that."""
    from curveline.fitting.fewest import fit_fewest
    from curveline.system.files import write_file

    found = fit_fewest(drawing, display, wanted, request, TERMINAL)
    write_file(wanted.path, found.display_text.encode(), force=True)
    screen.note(f"wrote {os.path.relpath(wanted.path)}, a display of {found.fit.scene.display.node_count} nodes")
    return found.fit


def _write(found: Fit, files: Sequence[str], plan_file: str | None, *, force: bool) -> None:
    """Write the fit in every format that is asked for, and its plan, if there is one."""
    from curveline.outputs import FIT, PLAN, write_output

    for path in files:
        write_output(FIT, path, (found, path, tuple(sys.argv[1:])), force=force)
        screen.note(f"wrote {path}")
    if plan_file is not None and found.plan is not None:
        write_output(PLAN, plan_file, (found.plan,), force=force)
        screen.note(f"wrote {plan_file}")


def _conclude(found: Fit, files: Sequence[str], within_mm: float | None) -> None:
    """Say what to do next, or what is missing, with the exit code for that."""
    shape = next((path for path in files if path.endswith(".toml")), None)
    if found.refusal:
        screen.note("no plan: a larger --margin, or a drawing that bends less, may have one")
    is_within = within_mm is None or found.off <= mm(within_mm)
    if not is_within:
        screen.note(f"{to_mm(found.off):.3g} mm off, {within_mm:g} were asked for")
    if found.refusal or not is_within:
        raise typer.Exit(EXIT_NO)
    if shape is None:
        screen.note("keep the shape with -o SHAPE.toml")

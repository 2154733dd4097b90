"""`curveline surface`: from a surface to a folder of lines that show it together."""

from __future__ import annotations

import os
import sys
from collections.abc import Sequence
from enum import StrEnum
from typing import TYPE_CHECKING, Annotated

import typer

from curveline.cli import completion
from curveline.cli.commands.fit import EffortOption, MinimiseOption, ScaleOption
from curveline.cli.options import RESULTS, BriefOption, ForceOption, JsonOption
from curveline.cli.printing import screen
from curveline.cli.terminal import TERMINAL
from curveline.drive_settings import DEFAULT_DISPLAY
from curveline.errors import EXIT_NO, InvalidInput
from curveline.units import mm, to_mm

if TYPE_CHECKING:
    from curveline.surfaces.fit_surface import FittedSurface
    from curveline.surfaces.height_field import HeightField
    from curveline.surfaces.how_to_read import HowToReadSurface

SURFACE = "The surface"
LINES = "The lines"
FITTING = "The fit"


class UpOption(StrEnum):
    """What `--up` takes."""

    X = "x"
    Y = "y"
    Z = "z"


def surface(
    target: Annotated[
        str | None, typer.Argument(metavar="SURFACE", help="The surface: .stl, .obj, .ply, or a grey .png or .jpg.")
    ] = None,
    formula: Annotated[
        str | None,
        typer.Option(
            metavar="TEXT",
            rich_help_panel=SURFACE,
            help="Instead of a file: the height in mm at x and y in mm, such as 60*sin(pi*x/500)*cos(pi*y/900).",
        ),
    ] = None,
    unit: Annotated[
        str | None,
        typer.Option(metavar="UNIT", rich_help_panel=SURFACE, help="What a unit of a mesh is: mm, cm, m, in, ..."),
    ] = None,
    up: Annotated[
        UpOption, typer.Option(rich_help_panel=SURFACE, help="The axis of a mesh that points upwards.")
    ] = UpOption.Z,
    width_mm: Annotated[
        float | None,
        typer.Option(metavar="MM", rich_help_panel=SURFACE, help="How wide a mesh or a picture is, without a scale."),
    ] = None,
    height_mm: Annotated[
        str | None,
        typer.Option(metavar="LOW:HIGH", rich_help_panel=SURFACE, help="Heights of black and white in a picture."),
    ] = None,
    scale: Annotated[
        ScaleOption | None, typer.Option(rich_help_panel=SURFACE, help="Make it as wide as the display.")
    ] = None,
    shift_mm: Annotated[
        float, typer.Option(metavar="MM", rich_help_panel=SURFACE, help="Move it along the lines.")
    ] = 0.0,
    depth_from_mm: Annotated[
        float | None,
        typer.Option(
            metavar="MM",
            rich_help_panel=SURFACE,
            show_default="in the middle",
            help="How far behind its front edge the first line is.",
        ),
    ] = None,
    lines: Annotated[int, typer.Option(metavar="N", rich_help_panel=LINES, help="How many, front to back.")] = 8,
    pitch_mm: Annotated[
        float, typer.Option(metavar="MM", rich_help_panel=LINES, help="From one line to the next.")
    ] = 75.0,
    display: Annotated[
        str,
        typer.Option(
            "-d",
            "--display",
            metavar="NAME|FILE",
            autocompletion=completion.displays,
            rich_help_panel=LINES,
            help="The display of one line, built in or a file; each gets addresses of its own.",
        ),
    ] = DEFAULT_DISPLAY,
    current_A_per_motor: Annotated[
        float | None,
        typer.Option(
            "--current-A-per-motor",
            metavar="A",
            rich_help_panel=LINES,
            show_default="0.6",
            help="What a held motor draws, for the worst case.",
        ),
    ] = None,
    minimise: Annotated[
        MinimiseOption, typer.Option(rich_help_panel=FITTING, help="The mean distance, or the largest.")
    ] = MinimiseOption.RMS,
    margin: Annotated[
        float,
        typer.Option(metavar="PART", rich_help_panel=FITTING, help="Stability that every state keeps."),
    ] = 0.12,
    within_mm: Annotated[
        float | None,
        typer.Option(metavar="MM", rich_help_panel=FITTING, help="Exit with 1 if a line's distance is larger."),
    ] = None,
    effort: Annotated[
        EffortOption, typer.Option(rich_help_panel=FITTING, help="How many starts to search from.")
    ] = EffortOption.QUICK,
    seed: Annotated[int, typer.Option(min=0, metavar="N", rich_help_panel=FITTING, help="Of the starts.")] = 1,
    no_plan: Annotated[bool, typer.Option("--no-plan", rich_help_panel=FITTING, help="Do not plan the lines.")] = False,
    jobs: Annotated[
        int | None,
        typer.Option(
            "-j", "--jobs", min=0, metavar="N", rich_help_panel=FITTING, help="Processes, one per core if left out."
        ),
    ] = None,
    output: Annotated[
        list[str] | None,
        typer.Option(
            "-o",
            "--output",
            metavar="FOLDER|FILE",
            rich_help_panel=RESULTS,
            help="A new folder for send; a figure (.svg, .png, .pdf), or all of it (.json); - is JSON on stdout.",
        ),
    ] = None,
    force: ForceOption = False,
    json: JsonOption = False,
    brief: BriefOption = False,
) -> None:
    """Find the shapes of several lines in parallel that show a surface together, and plan them.

    A surface is a mesh as it is seen from above, a picture whose greys are heights, or a formula of x and y. Every line
    is a display of its own that shows the surface's section at one y; it is fitted as `curveline fit` fits a drawing.

    Nothing is scaled unless --scale says so. The left edge goes on the first rail, and from front to back the lines are
    in the middle. Heights of pictures and formulas count from the home height; a mesh is moved until its lowest place
    under the lines is there, or as near to it as nodes can be.

    The folder has a shape, a plan and a display per line, `lines.toml`, which `curveline send` reads, and
    `surface.json`: how near every line comes, how neighbours stand to each other, and what it takes of rod, nodes,
    current and radio.

    Exit code 1 says that a line misses --within-mm or has no plan; the folder is written all the same.
    """
    from curveline.cli.printing.reports.surface_text import describe
    from curveline.fitting.fit import FitRequest
    from curveline.surfaces.budget import STALL_A
    from curveline.surfaces.fit_surface import SurfaceRequest
    from curveline.surfaces.fit_surface import surface as fit_surface
    from curveline.surfaces.laying import Laying
    from curveline.surfaces.results import to_json

    folder, files = _outputs([path for path in output or () if path != "-"])
    _check(folder, files, force=force)
    if within_mm is not None and not within_mm > 0.0:
        raise InvalidInput(f"no line is within {within_mm:g} mm", "choose a distance above 0, such as 2")
    laying = Laying(lines, mm(pitch_mm), scale.value if scale else "", shift_mm, depth_from_mm)
    request = FitRequest(margin, minimise.value, effort.value, not no_plan, seed)
    current = STALL_A if current_A_per_motor is None else current_A_per_motor
    source = _read(target, formula, _how(unit, up, width_mm, height_mm))
    found = fit_surface(source, display, SurfaceRequest(laying, request, jobs or 0, current), TERMINAL)
    _write(found, folder, files, force=force)
    if json or "-" in (output or ()):
        screen.result(to_json(found, argv=tuple(sys.argv[1:])).decode().rstrip("\n"))
    else:
        screen.result("\n".join(describe(found)))
    _conclude(found, folder, within_mm)


def _outputs(paths: Sequence[str]) -> tuple[str | None, list[str]]:
    """The folder among what is to be written, if there is one, and the files; InvalidInput for two folders."""
    from curveline.outputs import SURFACE as KIND

    files = [path for path in paths if os.path.splitext(path)[1].lower() in KIND.suffixes]
    folders = [path for path in paths if path not in files]
    if len(folders) > 1:
        raise InvalidInput(f"{folders[1]}: a surface goes into one folder", "name one folder, and figures or .json")
    return (folders[0] if folders else None), files


def _check(folder: str | None, files: Sequence[str], *, force: bool) -> None:
    """Refuse what could not be written, before anything is computed."""
    from curveline.outputs import SURFACE as KIND
    from curveline.outputs import check_output
    from curveline.surfaces.folder import check_folder

    if folder is not None:
        check_folder(folder, force=force)
    for path in files:
        check_output(KIND, path, force=force)


def _how(unit: str | None, up: UpOption, width_mm: float | None, height_mm: str | None) -> HowToReadSurface:
    """How to read a file."""
    from curveline.surfaces.how_to_read import HowToReadSurface

    return HowToReadSurface(unit or "", width_mm, _heights(height_mm), up.value)


def _heights(text: str | None) -> tuple[float, float] | None:
    if text is None:
        return None
    try:
        low, high = (float(each) for each in text.split(":"))
    except ValueError:
        raise InvalidInput(f"{text!r} are no heights of black and white", "such as --height-mm 0:60") from None
    return low, high


def _read(target: str | None, formula: str | None, how: HowToReadSurface) -> HeightField:
    """The surface that was named; InvalidInput unless it is one, from a file or by a formula."""
    from curveline.surfaces.how_to_read import HowToReadSurface
    from curveline.surfaces.reading import read_surface, surface_of_formula

    if (target is None) is (formula is None):
        raise InvalidInput("name one surface", 'a file, or --formula "60*sin(pi*x/500)*cos(pi*y/900)"')
    if target is not None:
        return read_surface(target, how)
    if how != HowToReadSurface():
        raise InvalidInput(
            "--unit, --up, --width-mm and --height-mm are for files", "a formula is in mm: leave them out"
        )
    return surface_of_formula(formula or "")


def _write(found: FittedSurface, folder: str | None, files: Sequence[str], *, force: bool) -> None:
    """Write the surface in every format that is asked for."""
    from curveline.outputs import SURFACE as KIND
    from curveline.outputs import write_output
    from curveline.writing import write_surface

    if folder is not None:
        names = write_surface(found, folder, force=force)
        screen.note(f"wrote {folder}, {len(names)} files")
    for path in files:
        write_output(KIND, path, (found, path, tuple(sys.argv[1:])), force=force)
        screen.note(f"wrote {path}")


def _conclude(found: FittedSurface, folder: str | None, within_mm: float | None) -> None:
    """Say what to do next, or what is missing, with the exit code for that."""
    if found.unplanned:
        screen.note("a larger --margin, or a surface that bends less, may have plans for all lines")
    is_within = within_mm is None or found.off <= mm(within_mm)
    if not is_within:
        screen.note(f"{to_mm(found.off):.3g} mm off, {within_mm:g} were asked for")
    if found.unplanned or not is_within:
        raise typer.Exit(EXIT_NO)
    if folder is None:
        screen.note("keep the lines with -o FOLDER")

"""`curveline plan --monte-carlo`: the options, and what is done with them."""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping
from dataclasses import fields
from typing import TYPE_CHECKING, Annotated, Any

import typer

from curveline.cli.printing import screen
from curveline.cli.terminal import TERMINAL
from curveline.errors import EXIT_DONE, EXIT_NO, InvalidInput

if TYPE_CHECKING:
    from curveline.plan_file import Plan
    from curveline.replay.monte_carlo import Errors
    from curveline.replay.trials import TrialsRequest
    from curveline.scene import Display, DisplayErrors

MOST_RUNS = 1_000_000
MOST_JOBS = 256
LARGEST_SEED = 2**53
MONTE_CARLO = "Many runs with errors (--monte-carlo)"
OF_DISPLAY = "The display in truth (--monte-carlo)"


def _size(default: str, text: str) -> Any:
    return typer.Option(min=0.0, metavar="SIZE", show_default=default, rich_help_panel=MONTE_CARLO, help=text)


def _range(flag: str, text: str) -> Any:
    return typer.Option(flag, metavar="FROM:TO", show_default=False, rich_help_panel=OF_DISPLAY, help=text)


Runs = Annotated[
    int | None,
    typer.Option(
        min=1,
        max=MOST_RUNS,
        metavar="RUNS",
        rich_help_panel=MONTE_CARLO,
        help="Play the plan so often with errors of the nodes drawn at random.",
    ),
]
Seed = Annotated[
    int,
    typer.Option(
        min=0, max=LARGEST_SEED, metavar="N", rich_help_panel=MONTE_CARLO, help="Seed of the first run; then N+1, ..."
    ),
]
FeedError = Annotated[float | None, _size("0.3", "Constant error and play of the feed, in mm.")]
FeedScale = Annotated[float | None, _size("0.2", "Error in what a node feeds per turn, in percent.")]
AngleError = Annotated[float | None, _size("1.0", "Constant error and play of the angle, in deg.")]
HeightError = Annotated[float | None, _size("0.3", "Constant error and play of the height, in mm.")]
Bow = Annotated[float | None, _size("5.0", "Bow of the straight rod, in mm.")]
Unevenness = Annotated[float | None, _size("0.5", "How late or early an axis is, as a part of a step's time.")]
LeastShare = Annotated[
    float,
    typer.Option(
        min=0.0,
        max=1.0,
        metavar="SHARE",
        rich_help_panel=MONTE_CARLO,
        help="Share of good runs below which the exit code is 1.",
    ),
]
Ranks = Annotated[
    bool,
    typer.Option(
        "--rank",
        rich_help_panel=MONTE_CARLO,
        help="Tell what each error does to the share and to the curve: plays each run anew for every error.",
    ),
]
StiffnessPercent = Annotated[str | None, _range("--stiffness-percent", "How much stiffer the rod is, in percent.")]
MassPercent = Annotated[str | None, _range("--mass-percent", "How much heavier the rod is, in percent.")]
ClampStiffness = Annotated[
    str | None,
    _range("--clamp-stiffness-Nmm-per-deg", "Stiffness of the bearings, in N mm per degree; inf for rigid ones."),
]
ClampPlay = Annotated[str | None, _range("--clamp-play-deg", "Play of the bearings, either way, in deg.")]
Clamp = Annotated[str | None, _range("--clamp-mm", "Rod that a bearing holds straight, in mm.")]
SpanError = Annotated[str | None, _range("--span-error-mm", "How much wider each gap between nodes is, in mm.")]
Friction = Annotated[
    str | None, _range("--friction-mm", "Rod that a bearing holds back, either way, before it slides, in mm.")
]
SetPercent = Annotated[
    str | None, _range("--set-percent", "Part of the other state's curvature that the rod keeps, in percent.")
]
Jobs = Annotated[
    int | None,
    typer.Option(
        "-j",
        "--jobs",
        min=0,
        max=MOST_JOBS,
        metavar="N",
        rich_help_panel=MONTE_CARLO,
        help="Processes to compute with; 0 is one per core.",
    ),
]


def requested(
    runs: int | None,
    settings: tuple[int, float, int | None],
    sizes: tuple[float | None, ...],
    ranges: Mapping[str, str | None],
    *,
    rank: bool,
) -> TrialsRequest | None:
    """What the options ask for, None without `runs`; `settings` are the first seed, least share and processes.

    `sizes` are those of `Errors`, in the units of the options, and `ranges` the text given for each key of `[errors]`.
    Raises InvalidInput for errors without runs, and for what is no range.
    """
    seed, least_share, jobs = settings
    if runs is not None:
        from curveline.replay.trials import TrialsRequest

        return TrialsRequest(runs, seed, _errors(sizes), jobs, _display_errors(ranges), rank)
    if any(given is not None for given in (*sizes, *ranges.values())) or least_share > 0.0 or rank:
        raise InvalidInput("errors, a least share, or --rank, but no runs", "add --monte-carlo 1000")
    return None


def _display_errors(ranges: Mapping[str, str | None]) -> DisplayErrors:
    """Ranges in SI from `FROM:TO`, or one number that is both."""
    from curveline.shapes.error_keys import display_errors

    written = {key: None if text is None else _ends(key, text) for key, text in ranges.items()}
    return display_errors(written, _option)


def _option(key: str) -> str:
    """The option of a key of the display's errors."""
    return f"--{key.replace('_', '-')}"


def _ends(key: str, text: str) -> tuple[float, float]:
    first, colon, last = text.partition(":")
    try:
        return float(first), float(last if colon else first)
    except ValueError:
        from curveline.shapes.toml_document import shown

        hint = f"write FROM:TO, such as {_option(key)} 1:2.5, or one number for both"
        raise InvalidInput(f"{_option(key)} {shown(text)} is no range", hint) from None


def _errors(sizes: tuple[float | None, ...]) -> Errors:
    """Errors in SI, the usual ones where none was asked for."""
    from curveline.replay.monte_carlo import Errors
    from curveline.units import deg, mm

    units: tuple[Callable[[float], float], ...] = (mm, lambda percent: percent / 100.0, deg, mm, mm, float)
    named = zip(fields(Errors), sizes, units, strict=True)
    return Errors(**{field.name: unit(size) for field, size, unit in named if size is not None})


def perturb(plan: Plan, request: TrialsRequest, display: Display | None, *, as_json: bool, aside: bool) -> float:
    """Play `plan` as often as requested and print what came of it; the share of runs that ended as wanted.

    It is played on a `display` whose rod has a history, on that of its file for None. It goes to stdout, or with
    `aside` to stderr, where the plan itself is on stdout.
    """
    from curveline.cli.printing.reports.trials_text import describe
    from curveline.displays.of_plan import display_of
    from curveline.plan_file import to_json
    from curveline.replay.monte_carlo import Setup
    from curveline.replay.trials import play_trials

    setup = Setup(display or display_of(plan, TERMINAL), plan, request.errors, request.display_errors)
    trials = play_trials(setup, request, TERMINAL)
    if as_json:
        screen.emit({"plan": json.loads(to_json(plan)), "monte_carlo": trials.document()})
    else:
        for line in describe(trials):
            (screen.note if aside else screen.result)(line)
    return trials.share.value


def exit_code_of(share: float, least: float) -> int:
    """The answer is no only to a question: if fewer runs ended as wanted than were asked for."""
    return EXIT_NO if share < least else EXIT_DONE

"""`curveline plan --monte-carlo`: the options, and what is done with them."""

from __future__ import annotations

import json
from collections.abc import Callable
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

MOST_RUNS = 1_000_000
MOST_JOBS = 256
LARGEST_SEED = 2**53
MONTE_CARLO = "Many runs with errors (--monte-carlo)"


def _size(default: str, text: str) -> Any:
    return typer.Option(min=0.0, metavar="SIZE", show_default=default, rich_help_panel=MONTE_CARLO, help=text)


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
    runs: int | None, settings: tuple[int, float, int | None], sizes: tuple[float | None, ...]
) -> TrialsRequest | None:
    """What the options ask for, None without `runs`; `settings` are the first seed, least share and processes.

    `sizes` are those of `Errors`, in the units of the options. Raises InvalidInput for errors without runs.
    """
    seed, least_share, jobs = settings
    if runs is not None:
        from curveline.replay.trials import TrialsRequest

        return TrialsRequest(runs, seed, _errors(sizes), jobs)
    if any(size is not None for size in sizes) or least_share > 0.0:
        raise InvalidInput("sizes of errors, or a least share, but no runs", "add --monte-carlo 1000")
    return None


def _errors(sizes: tuple[float | None, ...]) -> Errors:
    """Errors in SI, the usual ones where none was asked for."""
    from curveline.replay.monte_carlo import Errors
    from curveline.units import deg, mm

    units: tuple[Callable[[float], float], ...] = (mm, lambda percent: percent / 100.0, deg, mm, mm, float)
    named = zip(fields(Errors), sizes, units, strict=True)
    return Errors(**{field.name: unit(size) for field, size, unit in named if size is not None})


def perturb(plan: Plan, request: TrialsRequest, *, as_json: bool, aside: bool) -> float:
    """Play `plan` as often as requested and print what came of it; the share of runs that ended as wanted.

    It goes to stdout, or with `aside` to stderr, where the plan itself is on stdout.
    """
    from curveline.cli.printing.reports.trials_text import describe
    from curveline.displays.of_plan import display_of
    from curveline.plan_file import to_json
    from curveline.replay.monte_carlo import Setup
    from curveline.replay.trials import play_trials

    trials = play_trials(Setup(display_of(plan, TERMINAL), plan, request.errors), request, TERMINAL)
    if as_json:
        screen.emit({"plan": json.loads(to_json(plan)), "monte_carlo": trials.document()})
    else:
        for line in describe(trials):
            (screen.note if aside else screen.result)(line)
    return trials.share.value


def exit_code_of(share: float, least: float) -> int:
    """The answer is no only to a question: if fewer runs ended as wanted than were asked for."""
    return EXIT_NO if share < least else EXIT_DONE

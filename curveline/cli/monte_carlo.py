"""`curveline plan --monte-carlo`: how often a plan ends in the wanted states when the nodes err."""

from __future__ import annotations

import json
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import closing
from dataclasses import asdict, dataclass, fields
from textwrap import wrap
from typing import TYPE_CHECKING, Annotated, Any

import typer

from curveline.cli.printing import screen
from curveline.cli.printing.progress_bar import Bar
from curveline.errors import EXIT_DONE, EXIT_NO, InvalidInput

if TYPE_CHECKING:
    from curveline.plan_file import Plan
    from curveline.replay.monte_carlo import Errors, MonteCarloOutcome, Setup, Share
    from curveline.scene import Display

MOST_RUNS = 1_000_000
MOST_JOBS = 256
LARGEST_SEED = 2**53
COLUMNS = 80
HEAD = ("segment", "wanted", "ended so", "share %", "95 % confidence")


def _size(default: str, text: str) -> Any:
    return typer.Option(min=0.0, metavar="SIZE", show_default=default, help=f"With --monte-carlo: {text}")


Runs = Annotated[
    int | None,
    typer.Option(
        min=1, max=MOST_RUNS, metavar="RUNS", help="Play the plan so often with errors of the nodes drawn at random."
    ),
]
Seed = Annotated[
    int, typer.Option(min=0, max=LARGEST_SEED, metavar="N", help="With --monte-carlo: the first run's; then N+1, ...")
]
FeedError = Annotated[float | None, _size("0.3", "constant error and play of the feed.")]
FeedScale = Annotated[float | None, _size("0.2", "error in what a node feeds per turn, in percent.")]
AngleError = Annotated[float | None, _size("1.0", "constant error and play of the angle.")]
HeightError = Annotated[float | None, _size("0.3", "constant error and play of the height.")]
Bow = Annotated[float | None, _size("5.0", "bow of the straight rod.")]
Unevenness = Annotated[float | None, _size("0.5", "how late or early an axis is, as a part of a step's time.")]
LeastShare = Annotated[
    float, typer.Option(min=0.0, max=1.0, metavar="SHARE", help="With --monte-carlo: below it the exit code is 1.")
]
Jobs = Annotated[
    int | None,
    typer.Option(
        "-j", "--jobs", min=0, max=MOST_JOBS, metavar="N", help="With --monte-carlo: processes; 0 is one per core."
    ),
]


@dataclass(frozen=True)
class MonteCarloRequest:
    """What the options ask for: how many runs from which seed on, errors of which sizes, on how many processes."""

    runs: int
    seed: int
    least_share: float
    jobs: int | None
    errors: Errors


def requested(
    runs: int | None, settings: tuple[int, float, int | None], sizes: tuple[float | None, ...]
) -> MonteCarloRequest | None:
    """What the options ask for, None without `runs`; `settings` are the first seed, least share and processes.

    `sizes` are those of `Errors`, in the units of the options. Raises InvalidInput for errors without runs.
    """
    if runs is not None:
        return MonteCarloRequest(runs, *settings, _errors(sizes))
    if any(size is not None for size in sizes) or settings[1] > 0.0:
        raise InvalidInput("sizes of errors, or a least share, but no runs", "add --monte-carlo 1000")
    return None


def _errors(sizes: tuple[float | None, ...]) -> Errors:
    """Errors in SI, the usual ones where none was asked for."""
    from curveline.replay.monte_carlo import Errors
    from curveline.units import deg, mm

    units: tuple[Callable[[float], float], ...] = (mm, lambda percent: percent / 100.0, deg, mm, mm, float)
    named = zip(fields(Errors), sizes, units, strict=True)
    return Errors(**{field.name: unit(size) for field, size, unit in named if size is not None})


@dataclass(frozen=True)
class Trials:
    """Runs that were played, in what setup, from which seed on, and how long it took on how many processes."""

    setup: Setup
    request: MonteCarloRequest
    outcome: MonteCarloOutcome
    seconds: float
    jobs: int

    @property
    def exit_code(self) -> int:
        """The answer is no only to a question: if fewer runs ended as wanted than were asked for."""
        return EXIT_NO if self.outcome.total.value < self.request.least_share else EXIT_DONE


def play(display: Display, plan: Plan, request: MonteCarloRequest) -> Trials:
    """Play `plan` as often as requested, under a progress bar."""
    from curveline.replay.monte_carlo import Setup, run_trials, summarise
    from curveline.simulation.batch import jobs_for

    setup = Setup(display, plan, request.errors)
    jobs = jobs_for(request.jobs, request.runs)
    begin = time.perf_counter()
    runs = []
    played = run_trials(setup, range(request.seed, request.seed + request.runs), jobs)
    with closing(played), Bar("playing", request.runs) as bar:
        for run in played:
            runs.append(run)
            bar.reach(len(runs))
    return Trials(setup, request, summarise(setup, runs), time.perf_counter() - begin, jobs)


def perturb(plan: Plan, request: MonteCarloRequest, *, as_json: bool, aside: bool) -> int:
    """Play `plan` as often as requested and print what came of it; the exit code.

    It goes to stdout, or with `aside` to stderr, where the plan itself is on stdout.
    """
    from curveline.cli.run import display_of
    from curveline.plan_file import to_json

    trials = play(display_of(plan), plan, request)
    if as_json:
        screen.emit({"plan": json.loads(to_json(plan)), "monte_carlo": document(trials)})
    else:
        for line in describe(trials):
            (screen.note if aside else screen.result)(line)
    return trials.exit_code


def describe(trials: Trials) -> Iterator[str]:
    """Lines of text: shares with their intervals, why runs failed, and the errors that were drawn."""
    request, outcome = trials.request, trials.outcome
    seeds = f"seed {request.seed}" + (f" to {request.seed + request.runs - 1}" if request.runs > 1 else "")
    yield screen.paint(f"{_counted(request.runs)} with errors, {seeds}", screen.BOLD, sys.stdout)
    rows = [HEAD]
    for number, (name, share) in enumerate(zip(trials.setup.plan.wanted, outcome.segments, strict=True), start=1):
        rows.append((str(number), name, *_share_cells(share)))
    if len(outcome.segments) > 1:
        rows.append(("all", "", *_share_cells(outcome.total)))
    yield from screen.table(rows, frozenset({0, 1}))
    yield from (f"{_counted(reason.runs)}: {reason}" for reason in outcome.reasons)
    if outcome.worst is not None:
        seed = outcome.worst.seed
        yield f"seed {seed} fails with the smallest errors; again: --monte-carlo 1 --seed {seed}"
    yield from wrap(", ".join(f"{name} {size:g}{unit}" for name, _, size, unit in _sizes(trials.setup.errors)), COLUMNS)
    processes = f"{trials.jobs} process{'' if trials.jobs == 1 else 'es'}"
    yield f"{trials.seconds:.1f} s on {processes}, {request.runs / trials.seconds:.0f} runs per second"


def document(trials: Trials) -> dict[str, Any]:
    """What goes under `monte_carlo`: the same for the same seed, however many processes there were."""
    from curveline.replay.monte_carlo import CONFIDENCE

    request, outcome = trials.request, trials.outcome
    return {
        "runs": request.runs,
        "seed": request.seed,
        "confidence": CONFIDENCE,
        "errors": {key: size for _, key, size, _ in _sizes(trials.setup.errors)},
        "wanted": _share_record(outcome.total),
        "segments": [
            {"wanted": name, **_share_record(share)}
            for name, share in zip(trials.setup.plan.wanted, outcome.segments, strict=True)
        ],
        "failures": [{**asdict(reason), "reason": str(reason)} for reason in outcome.reasons],
        "worst": asdict(outcome.worst) if outcome.worst else None,
    }


def _sizes(errors: Errors) -> Iterator[tuple[str, str, float, str]]:
    """Every error in words, its key in a document, its size and what follows that in words."""
    from curveline.units import to_deg, to_mm

    yield "errors: feed", "feed_mm", round(to_mm(errors.feed), 9), " mm"
    yield "scale", "feed_scale_percent", round(100.0 * errors.feed_scale, 9), " %"
    yield "angle", "angle_deg", round(to_deg(errors.angle), 9), " deg"
    yield "height", "height_mm", round(to_mm(errors.height), 9), " mm"
    yield "bow", "bow_mm", round(to_mm(errors.bow), 9), " mm"
    yield "unevenness", "unevenness", errors.unevenness, ""


def _counted(runs: int) -> str:
    return f"{runs} run{'' if runs == 1 else 's'}"


def _share_cells(share: Share) -> tuple[str, str, str]:
    low, high = share.interval
    return f"{share.count} of {share.runs}", f"{100.0 * share.value:.1f}", f"{100.0 * low:.1f} to {100.0 * high:.1f} %"


def _share_record(share: Share) -> dict[str, float]:
    low, high = share.interval
    return {"count": share.count, "share": share.value, "low": low, "high": high}

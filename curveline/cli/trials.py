"""`curveline plan --monte-carlo`: how often a plan ends in the wanted states when the nodes err."""

from __future__ import annotations

import sys
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import closing
from dataclasses import asdict, dataclass
from typing import TYPE_CHECKING, Annotated, Any

import typer

from curveline.cli import show
from curveline.cli.bar import Bar
from curveline.errors import EXIT_DONE, EXIT_NO, InvalidInput

if TYPE_CHECKING:
    from curveline.plan import Plan
    from curveline.scene import Display
    from curveline.trials import Errors, Outcome, Setup, Share

MOST_RUNS = 1_000_000
MOST_JOBS = 256
LARGEST_SEED = 2**53
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
class Request:
    """What the options ask for: how many runs from which seed on, errors of which sizes, on how many processes."""

    runs: int
    seed: int
    sizes: Mapping[str, float | None]
    least_share: float
    jobs: int | None

    def errors(self) -> Errors:
        """The sizes of errors in SI, the usual ones where none was asked for."""
        from curveline.trials import Errors
        from curveline.units import deg, mm

        units: dict[str, Callable[[float], float]]
        units = {"feed_scale": lambda percent: percent / 100.0, "angle": deg, "unevenness": float}
        given = {name: size for name, size in self.sizes.items() if size is not None}
        return Errors(**{name: units.get(name, mm)(size) for name, size in given.items()})


def requested(runs: int | None, request: tuple[int, float, int | None], **sizes: float | None) -> Request | None:
    """What the options ask for; `request` is the first seed, the least share and the processes.

    None without `runs`; raises InvalidInput if errors were asked for nevertheless.
    """
    seed, least_share, jobs = request
    if runs is not None:
        return Request(runs, seed, sizes, least_share, jobs)
    if any(size is not None for size in sizes.values()) or least_share > 0.0:
        raise InvalidInput("sizes of errors, or a least share, but no runs", "add --monte-carlo 1000")
    return None


@dataclass(frozen=True)
class Trials:
    """Runs that were played, in what setup, from which seed on, and how long it took on how many processes."""

    setup: Setup
    request: Request
    outcome: Outcome
    seconds: float
    jobs: int

    @property
    def exit_code(self) -> int:
        """The answer is no only to a question: if fewer runs ended as wanted than were asked for."""
        return EXIT_NO if self.outcome.total.value < self.request.least_share else EXIT_DONE


def play(display: Display, plan: Plan, request: Request, shows: Sequence[str] = ()) -> Trials:
    """Play `plan` as often as requested, under a progress bar; `shows` names the states at the start, if known."""
    from curveline.batch import jobs_for
    from curveline.trials import Setup, run_trials, summarise

    setup = Setup(display, plan, request.errors(), tuple(shows))
    jobs = jobs_for(request.jobs, request.runs)
    begin = time.perf_counter()
    runs = []
    played = run_trials(setup, range(request.seed, request.seed + request.runs), jobs)
    with closing(played), Bar("playing", request.runs) as bar:
        for run in played:
            runs.append(run)
            bar.reach(len(runs))
    return Trials(setup, request, summarise(setup, runs), time.perf_counter() - begin, jobs)


def describe(trials: Trials) -> Iterator[str]:
    """Lines of text: shares with their intervals, why runs failed, and the errors that were drawn."""
    request, outcome = trials.request, trials.outcome
    seeds = f"seed {request.seed}" + (f" to {request.seed + request.runs - 1}" if request.runs > 1 else "")
    yield show.paint(f"{_counted(request.runs)} with errors, {seeds}", show.BOLD, sys.stdout)
    rows = [HEAD]
    for number, (name, share) in enumerate(zip(trials.setup.plan.wanted, outcome.segments, strict=True), start=1):
        rows.append((str(number), name, *_share_cells(share)))
    if len(outcome.segments) > 1:
        rows.append(("all", "", *_share_cells(outcome.total)))
    yield from show.table(rows, frozenset({0, 1}))
    yield from (f"{_counted(reason.runs)}: {reason}" for reason in outcome.reasons)
    if outcome.worst is not None:
        again = f"--monte-carlo 1 --seed {outcome.worst.seed} plays it again"
        yield f"seed {outcome.worst.seed} fails with the smallest errors; {again}"
    yield "errors: " + ", ".join(f"{name} {size:g}{unit}" for name, _, size, unit in _sizes(trials.setup.errors))
    processes = f"{trials.jobs} process{'' if trials.jobs == 1 else 'es'}"
    yield f"{trials.seconds:.1f} s on {processes}, {request.runs / trials.seconds:.0f} runs per second"


def document(trials: Trials) -> dict[str, Any]:
    """What goes under `monte_carlo`: the same for the same seed, however many processes there were."""
    from curveline.trials import CONFIDENCE

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

    yield "feed", "feed_mm", round(to_mm(errors.feed), 9), " mm"
    yield "and of it", "feed_scale_percent", round(100.0 * errors.feed_scale, 9), " %"
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

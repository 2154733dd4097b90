"""A plan carried out many times with errors of nodes and display, and what came of it as plain data."""

from __future__ import annotations

import time
from collections.abc import Callable, Generator
from contextlib import closing
from dataclasses import asdict, dataclass, field
from functools import partial
from typing import Any, TypeVar

from curveline.errors import InvalidInput
from curveline.listening import SILENT, Listener
from curveline.notebook import html_of
from curveline.phrases import counted
from curveline.replay.error_sizes import sizes_of
from curveline.replay.monte_carlo import Errors, Setup, play_run, played, summarise
from curveline.replay.outcome import CONFIDENCE, MonteCarloOutcome, Share
from curveline.replay.ranking import Design, Ranking, play_row, rank
from curveline.replay.ranking_report import ranking_document, ranking_tables
from curveline.scene import DisplayErrors
from curveline.shapes.error_keys import as_plain
from curveline.simulation.batch import jobs_for

T = TypeVar("T")

MOST_RANKED = 100_000
"""Runs, each of which is played once more for each error."""


@dataclass(frozen=True)
class TrialsRequest:
    """How many runs from which seed on, errors of which sizes, on how many processes; None is what is fastest.

    To `rank` the errors each run is played anew with one of them after the other drawn again, and once with all.
    """

    runs: int = 1000  # how many
    seed: int = 1  # of the first run; then one more each
    errors: Errors = field(default_factory=Errors)  # their sizes
    jobs: int | None = None  # processes; None is what is fastest
    display_errors: DisplayErrors = field(default_factory=DisplayErrors)  # ranges that win over those of its file
    rank: bool = False  # whether to tell what each error does


@dataclass(frozen=True)
class Trials:
    """Runs that were played, in what setup, what they came to, and how long it took [s] on how many processes."""

    setup: Setup  # the plan, its display, the errors
    request: TrialsRequest  # as asked for
    outcome: MonteCarloOutcome  # what the runs came to
    seconds: float  # [s]
    jobs: int  # processes
    ranking: Ranking | None = None  # what each error does, if that was asked for

    @property
    def plays(self) -> int:
        """Runs in all, those that rank the errors included."""
        return self.request.runs if self.ranking is None else self.ranking.plays

    @property
    def share(self) -> Share:
        """How many runs ended as wanted in all segments, and its interval."""
        return self.outcome.total

    @property
    def reasons(self) -> tuple[str, ...]:
        """Sentences: why runs failed, and how many did so."""
        return tuple(f"{counted(reason.runs, 'run')}: {reason}" for reason in self.outcome.reasons)

    def summary(self) -> str:
        """The answer as one sentence."""
        low, high = self.share.interval
        played = f"{self.share.count} of {counted(self.share.runs, 'run')} as wanted"
        return f"{self.setup.plan.name}: {played}, {100.0 * low:.1f} to {100.0 * high:.1f} % (95 % confidence)"

    def _repr_html_(self) -> str:
        rows = [
            (number, name, share.count, share.runs, share.value, *share.interval)
            for number, (name, share) in enumerate(
                zip(self.setup.plan.wanted, self.outcome.segments, strict=True), start=1
            )
        ]
        head = ("segment", "wanted", "ended so", "runs", "share", "95 % from", "to")
        worst = self.outcome.worst
        again = [] if worst is None else [f"seed {worst.seed} fails with the smallest errors"]
        tables = [] if self.ranking is None else list(ranking_tables(self.ranking))
        nothing = [title for title, ranked in tables if not ranked]
        ranks = "".join(html_of(title, ranked) for title, ranked in tables if ranked)
        return html_of(self.summary(), [head, *rows], remarks=[*self.reasons, *again, *nothing]) + ranks

    def document(self) -> dict[str, Any]:
        """The same as plain data: equal for equal seeds, however many processes there were."""
        request, outcome = self.request, self.outcome
        return {
            "runs": request.runs,
            "seed": request.seed,
            "confidence": CONFIDENCE,
            "errors": {size.key: size.value for size in sizes_of(self.setup.errors)},
            "display_errors": as_plain(self.setup.display_errors),
            "wanted": _share_record(outcome.total),
            "segments": [
                {"wanted": name, **_share_record(share)}
                for name, share in zip(self.setup.plan.wanted, outcome.segments, strict=True)
            ],
            "failures": [{**asdict(reason), "reason": str(reason)} for reason in outcome.reasons],
            "worst": asdict(outcome.worst) if outcome.worst else None,
            "ranking": None if self.ranking is None else ranking_document(self.ranking),
        }


def play_trials(setup: Setup, request: TrialsRequest, listener: Listener = SILENT) -> Trials:
    """Play the plan of `setup` as often as requested. InvalidInput where there is nothing to rank, or too much."""
    design = Design(setup) if request.rank else None
    if design is not None and request.runs > MOST_RANKED:
        message = f"{request.runs} runs are more than it takes to rank errors"
        raise InvalidInput(message, f"take {MOST_RANKED} or fewer: a thousand tell shares of a few percent")
    each = 1 if design is None else len(design.inputs) + 2
    jobs = min(request.runs, jobs_for(request.jobs, request.runs * each))
    begin = time.perf_counter()
    listener.computing()
    seeds = range(request.seed, request.seed + request.runs)
    with listener.progress("playing", request.runs) as heard:
        if design is None:
            runs, ranking = _heard(played(partial(play_run, setup), seeds, jobs), heard), None
        else:
            rows = _heard(played(partial(play_row, design), seeds, jobs), heard)
            runs, ranking = [row.run for row in rows], rank(design, rows)
    return Trials(setup, request, summarise(setup, runs), time.perf_counter() - begin, jobs, ranking)


def _heard(coming: Generator[T, None, None], heard: Callable[[int], object]) -> list[T]:
    """All that is coming, somebody hearing how many have come."""
    found = []
    with closing(coming):
        for each in coming:
            found.append(each)
            heard(len(found))
    return found


def _share_record(share: Share) -> dict[str, float]:
    low, high = share.interval
    return {"count": share.count, "share": share.value, "low": low, "high": high}

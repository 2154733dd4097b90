"""A plan carried out many times with errors of its nodes, and what came of it as plain data."""

from __future__ import annotations

import time
from collections.abc import Iterator
from contextlib import closing
from dataclasses import asdict, dataclass, field
from typing import Any

from curveline.listening import SILENT, Listener
from curveline.notebook import html_of
from curveline.phrases import counted
from curveline.replay.monte_carlo import CONFIDENCE, Errors, MonteCarloOutcome, Setup, Share, run_trials, summarise
from curveline.simulation.batch import jobs_for
from curveline.units import to_deg, to_mm


@dataclass(frozen=True)
class TrialsRequest:
    """How many runs from which seed on, errors of which sizes, on how many processes; None is what is fastest."""

    runs: int = 1000  # how many
    seed: int = 1  # of the first run; then one more each
    errors: Errors = field(default_factory=Errors)  # their sizes
    jobs: int | None = None  # processes; None is what is fastest


@dataclass(frozen=True)
class Trials:
    """Runs that were played, in what setup, what they came to, and how long it took [s] on how many processes."""

    setup: Setup  # the plan, its display, the errors
    request: TrialsRequest  # as asked for
    outcome: MonteCarloOutcome  # what the runs came to
    seconds: float  # [s]
    jobs: int  # processes

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
        return html_of(self.summary(), [head, *rows], remarks=[*self.reasons, *again])

    def document(self) -> dict[str, Any]:
        """The same as plain data: equal for equal seeds, however many processes there were."""
        request, outcome = self.request, self.outcome
        return {
            "runs": request.runs,
            "seed": request.seed,
            "confidence": CONFIDENCE,
            "errors": {size.key: size.value for size in sizes_of(self.setup.errors)},
            "wanted": _share_record(outcome.total),
            "segments": [
                {"wanted": name, **_share_record(share)}
                for name, share in zip(self.setup.plan.wanted, outcome.segments, strict=True)
            ],
            "failures": [{**asdict(reason), "reason": str(reason)} for reason in outcome.reasons],
            "worst": asdict(outcome.worst) if outcome.worst else None,
        }


def play_trials(setup: Setup, request: TrialsRequest, listener: Listener = SILENT) -> Trials:
    """Play the plan of `setup` as often as requested."""
    jobs = jobs_for(request.jobs, request.runs)
    begin = time.perf_counter()
    listener.computing()
    runs = []
    played = run_trials(setup, range(request.seed, request.seed + request.runs), jobs)
    with closing(played), listener.progress("playing", request.runs) as heard:
        for run in played:
            runs.append(run)
            heard(len(runs))
    return Trials(setup, request, summarise(setup, runs), time.perf_counter() - begin, jobs)


@dataclass(frozen=True)
class ErrorSize:
    """The size of one kind of error: in words, its key in a document, its value, and the unit as it is read."""

    name: str
    key: str
    value: float
    unit: str


def sizes_of(errors: Errors) -> Iterator[ErrorSize]:
    """Every kind of error, in the units that people write."""
    yield ErrorSize("feed", "feed_mm", round(to_mm(errors.feed), 9), " mm")
    yield ErrorSize("scale", "feed_scale_percent", round(100.0 * errors.feed_scale, 9), " %")
    yield ErrorSize("angle", "angle_deg", round(to_deg(errors.angle), 9), " deg")
    yield ErrorSize("height", "height_mm", round(to_mm(errors.height), 9), " mm")
    yield ErrorSize("bow", "bow_mm", round(to_mm(errors.bow), 9), " mm")
    yield ErrorSize("unevenness", "unevenness", errors.unevenness, "")


def _share_record(share: Share) -> dict[str, float]:
    low, high = share.interval
    return {"count": share.count, "share": share.value, "low": low, "high": high}

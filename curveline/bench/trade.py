"""The speed/accuracy trade: for each set of cases, model and method the vertices, the true error and the time.

Over the cases of a set the error and the vertices are the largest, the time is the median. A setting is on the Pareto
front if no other of the same set and model is both faster and more accurate.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from importlib.util import find_spec
from typing import NamedTuple

import numpy as np

from curveline.bench.methods.cases import Case, CaseSet, truth
from curveline.bench.methods.own import Method, Solved
from curveline.rod.states.equilibrium import EXTENSIBLE, PLANAR, SPATIAL
from curveline.units import mm, to_mm

MODELS = (PLANAR, EXTENSIBLE, SPATIAL)
FEW = "clamps"
"""The set that methods for few scenes are measured on."""
OTHER_STATE = mm(10)
"""An answer farther than this from the exact curve is another state."""
ROUNDING = mm(1e-7)
"""Errors below this say nothing about an order of convergence."""
NOT_INSTALLED = "not installed"


@dataclass(frozen=True)
class TradePoint:
    """A method with one setting on a set of cases; what could not be measured is None and `note` says why.

    `right` of `cases` led to the wanted state; the figures are theirs. `order` is fitted over the method's settings.
    """

    scenes: str  # the set of cases, by name
    model: str  # by name
    method: str  # by name
    setting: float | None  # of the method
    unit: str  # of the setting
    vertices: int | None = None  # the most over the cases
    error_mm: float | None = None  # [mm], the largest over the cases
    seconds: float | None = None  # [s], the median over the cases
    seconds_per_vertex: float | None = None  # [s], the median over the cases
    order: float | None = None
    pareto: bool = False  # whether nothing else beats it in both
    right: int = 0
    cases: int = 0  # how many there are
    note: str = ""


class TradeJob(NamedTuple):
    """A set of cases and the methods of one model to measure on it."""

    scenes: CaseSet
    model: str
    methods: tuple[Method, ...]

    @property
    def steps(self) -> int:
        """Number of settings to measure."""
        return sum(len(method.settings) for method in self.methods)


class _Sample(NamedTuple):
    """What one case gave."""

    vertices: int
    error: float  # [m]
    seconds: float


def is_installed(method: Method) -> bool:
    """True if the package that a method needs is there."""
    return not method.package or find_spec(method.package) is not None


def jobs(sets: Sequence[CaseSet], methods: Sequence[Method]) -> list[TradeJob]:
    """What there is to measure, in the order in which it is shown."""
    found = []
    for scenes in sets:
        for model in MODELS:
            fit = tuple(
                method for method in methods if method.model == model and (scenes.name == FEW or not method.few)
            )
            if fit:
                found.append(TradeJob(scenes, model, fit))
    return found


def measure(job: TradeJob, told: Callable[[str], None] = lambda _: None) -> list[TradePoint]:
    """The points of a job, those of each method from coarse to fine; `told` hears of every setting beforehand."""
    points: list[TradePoint] = []
    for method in job.methods:
        points += _measure_method(job, method, told)
    return with_front(points)


def _measure_method(job: TradeJob, method: Method, told: Callable[[str], None]) -> Iterator[TradePoint]:
    blank = TradePoint(job.scenes.name, job.model, method.name, None, method.unit)
    if not is_installed(method):
        for _ in method.settings:
            told(f"{method.name}: {NOT_INSTALLED}")
        yield replace(blank, note=NOT_INSTALLED)
        return
    samples = []
    for setting in method.settings:
        told(f"{job.scenes.name}, {job.model}: {method.name}, {setting:g} {method.unit}")
        samples.append([_sample(case, method, setting) for case in job.scenes.cases])
    order = fitted_order(samples)
    for setting, all_of_it in zip(method.settings, samples, strict=True):
        some = [sample for sample in all_of_it if sample is not None]
        point = replace(blank, setting=setting, order=order, right=len(some), cases=len(all_of_it))
        if some:
            point = replace(
                point,
                vertices=max(sample.vertices for sample in some),
                error_mm=to_mm(max(sample.error for sample in some)),
                seconds=float(np.median([sample.seconds for sample in some])),
                seconds_per_vertex=float(np.median([sample.seconds / sample.vertices for sample in some])),
            )
        yield point if point.right == point.cases else replace(point, note=f"{point.right} of {point.cases} right")


def _sample(case: Case, method: Method, setting: float) -> _Sample | None:
    """What a method makes of a case; None if that is no answer, or another state."""
    curve = truth(case, method.truth or method.model)
    answer = method.solve(case, setting) if curve is not None else None
    if curve is None or answer is None:
        return None
    error = distance(answer, curve.positions(answer.places))
    return _Sample(answer.vertices, error, answer.seconds) if error < OTHER_STATE else None


def distance(answer: Solved, positions: np.ndarray) -> float:
    """Largest distance [m] of an answer from planar `positions (k, 2)` [m] at its places."""
    gap = answer.positions.copy()
    gap[:, :2] -= positions
    return float(np.sqrt((gap**2).sum(axis=1)).max())


def fitted_order(samples: Sequence[Sequence[_Sample | None]]) -> float | None:
    """Order p of error ~ vertices^-p by least squares over `samples`, settings by cases.

    Each case has a factor of its own. None without a case that was solved with two different numbers of vertices.
    """
    above = below = 0.0
    for column in zip(*samples, strict=True):
        seen = {sample.vertices: sample.error for sample in column if sample is not None and sample.error > ROUNDING}
        if len(seen) > 1:
            sizes, errors = np.log(list(seen.keys())), np.log(list(seen.values()))
            above -= float((sizes - sizes.mean()) @ (errors - errors.mean()))
            below += float(((sizes - sizes.mean()) ** 2).sum())
    return above / below if below > 0.0 else None


def fitted_exponent(sizes: Sequence[int], seconds: Sequence[float]) -> float:
    """Exponent q of seconds ~ sizes^q by least squares."""
    slope: float = np.polyfit(np.log(sizes), np.log(seconds), 1)[0]
    return float(slope)


def with_front(points: Sequence[TradePoint]) -> list[TradePoint]:
    """The points, those on the Pareto front of error and time marked; ties are all on it."""
    fastest_first = sorted(
        (index for index, point in enumerate(points) if point.error_mm is not None and point.seconds is not None),
        key=lambda index: (points[index].seconds, points[index].error_mm),
    )
    on_front = set()
    least = math.inf
    for index in fastest_first:
        error = points[index].error_mm
        if error is not None and error < least:
            on_front.add(index)
            least = error
    return [replace(point, pareto=index in on_front) for index, point in enumerate(points)]

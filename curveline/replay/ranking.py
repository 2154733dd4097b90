"""Which errors matter: what each does to the share of good runs, and to the curve, alone and together with others.

    design = Design(setup)
    ranking = rank(design, [play_row(design, seed) for seed in range(1, 1001)])

Of each seed the run itself is played, one in which everything is drawn anew, and for each input one in which it alone
is: see `sensitivity`. An input is one kind of error: of the feeds of all nodes, of all spans, of the rod's stiffness.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, fields
from functools import cached_property
from typing import NamedTuple

import numpy as np

from curveline.errors import InvalidInput
from curveline.replay.monte_carlo import Draws, RealRun, Setup, course_of, draw, endings_of, size_of
from curveline.replay.outcome import TrialRun
from curveline.replay.real_display import SHARES, RealDisplay
from curveline.replay.sensitivity import Effects, Terms, effects_of, row_terms
from curveline.rod.branches.tracking import TOLERANCE, TrackedState, refined
from curveline.rod.problem import Array
from curveline.rod.states.slack import is_slack

ANEW = 1
"""Beside its own seed, what a row draws its second set of errors from."""
BOOTSTRAP = 2
POINTS = 41
"""Of each segment, equally spaced along the rod, of which is told how far they move."""
AXES = {"feed": 0, "angle": 1, "height": 2}
"""Which of a node's axes an input is the error of."""
WHOLE = {"feed_scale": "scales", "bow": "bows", "unevenness": "delays", "span": "gaps"}
"""Inputs that have one of the `Draws` to themselves."""


class Row(NamedTuple):
    """A run and those beside it: whether they end well, and what they say of the curve, if all have one.

    `good (k+2,)`: of the run, of the one in which all is drawn anew, and of those in which one input is. `terms` are as
    of `row_terms` [m^2], and `off` is the mean square of the run's distance from the curve of the plan [m^2].
    """

    run: TrialRun
    good: tuple[bool, ...]
    terms: tuple[float, Array, Array, Array] | None
    off: float


@dataclass(frozen=True)
class Ranking:
    """What each of the `inputs` does: names of the fields of `Errors` and `DisplayErrors` that are drawn.

    The curve is that of all segments in the wanted states, over all rows in which they exist throughout. `spread` is
    how far its points are from their mean places, `off` from those of the plan: root mean squares over the rod.
    """

    inputs: tuple[str, ...]
    samples: int  # seeds, and rows
    plays: int  # runs in all
    share: Effects | None  # of whether a run is good; None if all are, or none
    turned: Array  # (k,), the share of runs that end well or not only as this input was drawn
    curve: Effects | None  # of where the points of the curve are; None if they are nowhere, or stay
    rows: int  # of which the curves are
    spread: float  # [m]
    off: float  # [m]


@dataclass(frozen=True)
class Design:
    """What is ranked: the kinds of error that a setup draws. Raises InvalidInput where it draws none."""

    setup: Setup

    def __post_init__(self) -> None:
        if not self.inputs:
            message = "there is nothing to rank: no error of nodes or display is drawn"
            raise InvalidInput(message, "give one of them a size or a range")

    @cached_property
    def inputs(self) -> tuple[str, ...]:
        """Every kind of error that is drawn, of the nodes, then of the display."""
        errors, ranges = self.setup.errors, self.setup.display_errors.given
        nodes = [each.name for each in fields(errors) if getattr(errors, each.name) > 0.0]
        return (*nodes, *(name for name, drawn in ranges.items() if drawn.low < drawn.high))

    @cached_property
    def planned(self) -> Array | None:
        """The curve where everything is as planned: see `curve_of`."""
        setup = self.setup
        exact = RealDisplay((setup.display,) * len(setup.plan.wanted), 0.0)
        return curve_of(setup, RealRun(exact, setup.targets))

    @cached_property
    def middle(self) -> Array | None:
        """The curve in the middle of all ranges."""
        setup = self.setup
        zeros = (np.zeros_like(drawn) for drawn in draw(setup, 0))
        halves = Draws(*zeros)._replace(shares=np.full(len(SHARES), 0.5), gaps=np.full(len(setup.plan.wanted), 0.5))
        return curve_of(setup, course_of(setup, halves))


def play_row(design: Design, seed: int) -> Row:
    """Play the plan with the errors that follow from `seed`, and as often as it takes to see what each input does."""
    setup = design.setup
    base, other = draw(setup, seed), draw(setup, (seed, ANEW))
    drawn = [base, other, *(with_input(base, other, name) for name in design.inputs)]
    courses = [course_of(setup, draws) for draws in drawn]
    endings = [endings_of(setup, draws, course) for draws, course in zip(drawn, courses, strict=True)]
    run = TrialRun(seed, endings[0], size_of(setup, base))
    good = tuple(each == setup.plan.wanted for each in endings)
    terms, off = _curve_terms(design, courses)
    return Row(run, good, terms, off)


def _curve_terms(design: Design, courses: Sequence[RealRun]) -> tuple[tuple[float, Array, Array, Array] | None, float]:
    """The `terms` of a row and how far it is `off`; None and NaN where a curve does not exist."""
    planned, middle, curves = design.planned, design.middle, []
    for course in courses if planned is not None and middle is not None else ():
        if (curve := curve_of(design.setup, course)) is None:
            break
        curves.append(curve)
    if len(curves) < len(courses) or planned is None or middle is None:
        return None, math.nan
    scale = math.sqrt(0.5 * planned.size)
    base, other, *mixed = (curve / scale for curve in curves)
    off = float(np.sum((base - planned / scale) ** 2))
    return row_terms(base, other, np.array(mixed), middle / scale), off


def with_input(base: Draws, other: Draws, name: str) -> Draws:
    """The errors of `base`, those of one input as in `other`."""
    if name in WHOLE:
        return base._replace(**{WHOLE[name]: getattr(other, WHOLE[name])})
    if name in AXES:
        offsets, plays = base.offsets.copy(), base.plays.copy()
        offsets[:, AXES[name]] = other.offsets[:, AXES[name]]
        plays[:, :, AXES[name]] = other.plays[:, :, AXES[name]]
        return base._replace(offsets=offsets, plays=plays)
    shares, place = base.shares.copy(), SHARES.index(name)
    shares[place] = other.shares[place]
    return base._replace(shares=shares)


def curve_of(setup: Setup, course: RealRun) -> Array | None:
    """Where the rod is at the end of a run in the wanted states, however it ended there: (2 POINTS segments,) [m].

    In the frame of the leftmost node, x and y of points equally spaced along each segment; None if there is no such
    state, or the rod is to be straight.
    """
    pieces, x = [], 0.0
    for segment, (name, (_, at_end)) in enumerate(zip(setup.plan.wanted, setup.landmarks, strict=True)):
        rod = course.rod(segment, -1)
        held = at_end.state(rod, name) if is_slack(rod) else None
        if not isinstance(held, TrackedState):
            return None
        state = refined(rod, held, TOLERANCE * rod.length)
        if not state.stable:
            return None
        pieces.append(state.curve(POINTS) + np.array([x, course.values[-1, segment, 2]]))
        x += rod.pose.x
    return np.concatenate(pieces).ravel()


def rank(design: Design, rows: Sequence[Row]) -> Ranking:
    """What the rows of a design come to."""
    good = np.array([row.good for row in rows], dtype=np.float64)
    centre = float(np.mean(good[:, :2]))
    flags = [row_terms(each[:1], each[1:2], each[2:, None], centre) for each in good]
    seen = [(row.terms, row.off) for row in rows if row.terms is not None]
    seed = (rows[0].run.seed, BOOTSTRAP)
    curve = effects_of(_terms([terms for terms, _ in seen]), seed) if seen else None
    return Ranking(
        inputs=design.inputs,
        samples=len(rows),
        plays=good.size,
        share=effects_of(_terms(flags), seed),
        turned=np.mean(good[:, 2:] != good[:, :1], axis=0),
        curve=curve,
        rows=len(seen),
        spread=math.sqrt(curve.variance) if curve else 0.0,
        off=math.sqrt(np.mean([off for _, off in seen])) if seen else 0.0,
    )


def _terms(rows: Sequence[tuple[float, Array, Array, Array]]) -> Terms:
    return Terms(*(np.array(column) for column in zip(*rows, strict=True)))

"""From a drawn curve to a shape of a display: the row of nodes whose stable curve is nearest, simulated and planned.

found = fit_drawing(drawing, display, FitRequest())
found.scene, found.rms, found.plan
"""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from curveline.drawings.drawing import Drawing
from curveline.errors import Infeasible, InvalidInput
from curveline.fitting.bounds import Bounds, bounds_of
from curveline.fitting.cutting import cut_at_rails, resampled
from curveline.fitting.measured import MeasuredShape, in_frame, measured
from curveline.fitting.minimax import flattened
from curveline.fitting.reasons import ActiveLimit, Miss, active_limits, misses_of
from curveline.fitting.row import STABILITY, Array, FittedRow, Reserve, Wanted, parts_of, row_at
from curveline.fitting.search import SAME, FitEffort, RowSearch, search
from curveline.fitting.starts import level_rod
from curveline.listening import SILENT, Listener
from curveline.notebook import html_of
from curveline.plan_file import Plan
from curveline.planning.feasibility import check_home
from curveline.planning.tours import make_plan
from curveline.rod.clamped_rod import ClampedRod
from curveline.scene import PEAK, Display, Node, Scene, Segment
from curveline.shapes.file_keys import LONGEST_NAME
from curveline.system.files import printable
from curveline.units import to_deg, to_mm

QUICK, THOROUGH = "quick", "thorough"
EFFORTS = {QUICK: FitEffort(12, 6, 9, 5), THOROUGH: FitEffort(60, 20, 20, 60)}
RMS, MAX = "rms", "max"
MINIMISED = (RMS, MAX)
MARGIN = 0.12
"""Part of `STIFFEST` that the lowest eigenvalue of every state keeps: with less, plans fail more often."""
PART = 0.92
"""Of what rod and motors can give, that a shape asks for at most: the way there asks for more."""
LARGER = Reserve(MARGIN, PART), Reserve(margin=0.2, part=0.75), Reserve(margin=0.4, part=0.55)
"""What is left for the way where no row that leaves less has a plan."""
LEAST_MARGIN = 0.05
"""What plans keep of it anyway."""
PLANNED = 4
"""Rows that are planned, the nearest first, before none is said to have a plan."""
DENSE = 240
"""Points of a drawing per segment where its largest distance is to be small, so that corners count."""


@dataclass(frozen=True)
class FitRequest:
    """How to fit; InvalidInput for what makes no sense."""

    margin: float = MARGIN  # of stability that every state keeps, a part of a straight rod's lowest eigenvalue
    minimise: str = RMS  # the distance that is to be small, "rms" or "max"
    effort: str = QUICK  # "quick" or "thorough"
    is_planned: bool = True  # whether a plan is sought
    seed: int = 1  # of the starts
    name: str = ""  # of the shape; the drawing's if it is empty

    def __post_init__(self) -> None:
        if not LEAST_MARGIN <= self.margin <= 1.0:
            hint = f"choose {LEAST_MARGIN:g} to 1, such as {MARGIN:g}"
            raise InvalidInput(f"no plan keeps a margin of {self.margin:g}", hint)
        if self.effort not in EFFORTS:
            raise InvalidInput(f"there is no effort {self.effort!r}", f"choose {' or '.join(EFFORTS)}")
        if self.minimise not in MINIMISED:
            raise InvalidInput(f"no distance {self.minimise!r} is minimised", f"choose {' or '.join(MINIMISED)}")


@dataclass(frozen=True)
class Sensitivity:
    """By how much a point of the rod moves at most where a node errs: a number for the node that matters most."""

    feed: float  # m per m of rod
    angle: float  # m per rad
    height: float  # m per m


@dataclass(frozen=True, eq=False)
class Fit:
    """The shape whose curve is nearest to a drawing, of all that the search met."""

    scene: Scene  # the shape
    drawing: Drawing  # what was drawn
    request: FitRequest  # how it was fitted
    rms: float  # [m], root mean square of the distances from curve to drawing and back
    max: float  # [m], the largest of them
    worst: tuple[Miss, ...]  # places of the drawing, one of each segment, the farthest first
    least_possible: Bounds  # distances [m] that no shape of the display falls below, as far as is proven
    limits: tuple[ActiveLimit, ...]  # at which it stands
    sensitivity: Sensitivity  # to errors of the nodes
    margin: float  # the least of its states, a part of a straight clamped rod's lowest eigenvalue
    starts: int  # rows from which the search began
    hits: int  # of these, how many led to rows as near as this one
    second_best: float | None  # [m], distance of the next one that was met, of the kind that was to be small
    without_plan: float | None  # [m], the same of the nearest shape, where that has no plan and another one was taken
    curves: tuple[Array, ...]  # (k, 2) of the segments in the display's frame [m]
    drawn: tuple[Array, ...]  # (k, 2) of the drawing between the rails, in that frame [m]
    plan: Plan | None  # from home
    refusal: str  # why there is none; empty if there is one, or none was asked for
    seconds: float  # that it took

    @property
    def off(self) -> float:
        """The distance that was to be small [m]."""
        return self.rms if self.request.minimise == RMS else self.max

    def _repr_html_(self) -> str:
        head = ("node", "height mm", "angle deg")
        rows = [(place, to_mm(node.height), to_deg(node.angle)) for place, node in enumerate(self.scene.nodes, 1)]
        return html_of(f"{self.scene.name}: {to_mm(self.rms):.3g} mm RMS off {self.drawing.name}", [head, *rows])


def fit_drawing(
    drawing: Drawing, display: Display, request: FitRequest | None = None, listener: Listener = SILENT
) -> Fit:
    """The shape of a display whose stable curve is nearest to a drawing, of all that so many starts lead to.

    The distance is measured on the curve that `simulate` gives. InvalidInput for a drawing that no display can show, or
    a display that is not planned for; Infeasible where no stable row of nodes was met.
    """
    begin, request = time.monotonic(), request or FitRequest()
    _check_display(display)
    cut = cut_at_rails(drawing, display)
    listener.computing()
    rod = level_rod(display).extensible()
    wanted = Wanted(display, rod.bearing, cut.pieces, cut.fine, Reserve(request.margin, PART))
    found = nearest = _Fitting(wanted, rod, request, drawing).searched(listener)
    if not found.candidates:
        raise Infeasible(
            f"{drawing.name}: no stable curve of {display.name} was met near it",
            "it may bend too often, or need more or less rod than the display has: draw it simpler",
        )
    plan, refusal, best = None, "", found.candidates[0]
    if request.is_planned:
        found, (plan, refusal, best) = _planned(found, listener)
    passed = None if best is nearest.candidates[0] else nearest.candidates[0].off
    told = _told(found, best)
    return replace(told, without_plan=passed, plan=plan, refusal=refusal, seconds=time.monotonic() - begin)


def _check_display(display: Display) -> None:
    """InvalidInput for a display of which no shape has a plan, whatever it is; Infeasible where plans cannot begin."""
    nodes = (Node(0.0, 0.0),) * display.node_count
    check_home(Scene(display.name, display, nodes, (Segment(display.span, PEAK),) * (display.node_count - 1)))


@dataclass(frozen=True)
class _Fitting:
    """What a fit goes by."""

    wanted: Wanted
    rod: ClampedRod
    request: FitRequest
    drawing: Drawing

    def searched(self, listener: Listener) -> _Searched:
        """The rows that starts lead to, and candidates of them."""
        with listener.progress("fitting, starts", None) as heard:
            met = search(self.wanted, self.rod, EFFORTS[self.request.effort], self.request.seed, heard)
        return _Searched(self, met, self._candidates(met))

    def _candidates(self, met: RowSearch) -> list[_Candidate]:
        """The nearest distinct rows as shapes, measured; the nearest first.

        Where the largest distance is to be small, it is made so of each of them.
        """
        is_max, found = self.request.minimise == MAX, []
        # Files are called by names that shapes cannot have.
        name = printable(self.request.name or self.drawing.name)[:LONGEST_NAME]
        for row in met.distinct()[:PLANNED]:
            shown = measured(self.wanted, name, self._flattened(row) if is_max else row)
            if shown is not None:
                found.append(_Candidate(shown, row, shown.max if is_max else shown.rms))
        return sorted(found, key=lambda each: each.off)

    def _flattened(self, row: FittedRow) -> FittedRow:
        """The row near one whose largest distance is small; corners of the drawing count."""
        dense = self.wanted._replace(pieces=tuple(resampled(each, DENSE) for each in self.wanted.fine))
        there = row_at(dense, row.numbers, row.held)
        if there is None:
            return row
        flat = flattened(dense, there)
        return row_at(self.wanted, flat.numbers, flat.held) or row


class _Candidate(NamedTuple):
    """A shape that may be taken."""

    shown: MeasuredShape
    row: FittedRow  # of the search, of which it was made
    off: float  # [m], the distance that was to be small


class _Searched(NamedTuple):
    """What a search met, and with what it was made."""

    fitting: _Fitting
    met: RowSearch
    candidates: list[_Candidate]


_Planned = tuple[Plan | None, str, _Candidate]


def _planned(nearest: _Searched, listener: Listener) -> tuple[_Searched, _Planned]:
    """The nearest candidate of a search that has a plan from home; without, why the nearest has none.

    Where none has, rows that leave a larger reserve are sought, and the search that met the one that is taken is told.
    """
    fitting, first = nearest.fitting, _first_planned(nearest.candidates, listener)
    if first[0] is not None:
        return nearest, first
    for reserve in LARGER:
        left = reserve._replace(margin=max(reserve.margin, fitting.request.margin))
        if left == fitting.wanted.reserve:
            continue
        searched = replace(fitting, wanted=fitting.wanted._replace(reserve=left)).searched(listener)
        if searched.candidates and (found := _first_planned(searched.candidates, listener))[0] is not None:
            return searched, found
    return nearest, first


def _first_planned(candidates: Sequence[_Candidate], listener: Listener) -> _Planned:
    """The first of some candidates that has a plan from home; without, why the first has none."""
    refusal = ""
    for found in candidates:
        listener.computing()
        try:
            return make_plan(found.shown.scene), "", found
        except (Infeasible, InvalidInput) as error:
            refusal = refusal or error.message
    return None, refusal, candidates[0]


def _second_best(found: _Searched, best: _Candidate) -> float | None:
    """The distance [m] of the next one that a search met; None if all were as near, or nearer."""
    if found.fitting.request.minimise == MAX:
        return min((each.off for each in found.candidates if each.off > (1.0 + SAME) * best.off), default=None)
    others = [row.rms for row in found.met.rows if row.rms > (1.0 + SAME) * best.row.rms]
    # Measured is the one that is taken: the other is farther off by the same part as in the search.
    return min(others) / best.row.rms * best.off if others else None


def _told(found: _Searched, chosen: _Candidate) -> Fit:
    """All that is said of the candidate that is taken."""
    fitting, met, best = found.fitting, found.met, chosen.shown
    wanted = fitting.wanted
    limits = active_limits(wanted, best.row, best.rms)
    return Fit(
        scene=best.scene,
        drawing=fitting.drawing,
        request=fitting.request,
        rms=best.rms,
        max=best.max,
        worst=misses_of(wanted, limits, best),
        least_possible=bounds_of(wanted),
        limits=limits,
        sensitivity=_sensitivity(wanted, best.row),
        margin=wanted.reserve.margin - max(best.row.asks_of(wanted, STABILITY)),
        starts=met.starts,
        hits=met.hits(chosen.row),
        second_best=_second_best(found, chosen),
        without_plan=None,
        curves=best.curves,
        drawn=in_frame(wanted.fine, wanted.display.span),
        plan=None,
        refusal="",
        seconds=0.0,
    )


def _sensitivity(wanted: Wanted, row: FittedRow) -> Sensitivity:
    """Of the distances of a row."""
    count, roots = wanted.nodes, row.numbers[2 * wanted.nodes :]
    most = np.abs(row.slopes() / parts_of(wanted)[:, None]).max(axis=0)
    by_length = np.where(roots == 0.0, 1.0, 2.0 * wanted.display.span * roots)
    feed = most[2 * count :] / by_length
    return Sensitivity(float(feed.max()), float(most[count : 2 * count].max()), float(most[:count].max()))

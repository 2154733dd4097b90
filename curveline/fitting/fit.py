"""From a drawn curve to a shape of a display: the row of nodes whose stable curve is nearest, simulated and planned.

found = fit(drawing, display, FitRequest())
found.scene, found.rms, found.plan
"""

from __future__ import annotations

import math
import time
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from curveline._version import __version__
from curveline.errors import Infeasible, InvalidInput
from curveline.fitting.drawing import Drawing, cut_at_rails
from curveline.fitting.row import Array, Row, Wanted, polish
from curveline.fitting.starts import level_rod, starts
from curveline.listening import SILENT, Listener
from curveline.notebook import html_of
from curveline.plan_file import Plan
from curveline.planning.tours import make_plan
from curveline.rod.branches.drawn import misfits
from curveline.scene import PEAK, VALLEY, Display, Node, Scene, Segment
from curveline.simulation.simulate import simulate
from curveline.units import deg, mm, to_deg, to_mm

QUICK, THOROUGH = "quick", "thorough"
STARTS = {QUICK: 8, THOROUGH: 60}
"""From how many rows of nodes the search begins, by its effort."""
MARGIN = 0.12
"""Part of `STIFFEST` that the lowest eigenvalue of every state keeps: with less, plans fail more often."""
PLANNED = 4
"""Rows that are planned, the nearest first, before none is said to have a plan."""
SAME = 0.01
"""Rows whose distances differ by a smaller part found the same."""
POINTS = 401
"""Of each segment's curve, with which its distance is measured."""
WORST = 5
"""Places that are told where the rod is farthest off."""
DIGITS = 4
"""Behind the point, of numbers in mm and degrees: less than motors can tell."""
TOLERANCE = mm(0.02)
"""Of the curves that are measured."""


@dataclass(frozen=True)
class FitRequest:
    """How to fit: the `margin` of stability, the `effort`, whether to plan, the `seed` of the further starts.

    InvalidInput for what makes no sense.
    """

    margin: float = MARGIN
    effort: str = QUICK
    seed: int = 1
    is_planned: bool = True

    def __post_init__(self) -> None:
        if not 0.01 <= self.margin < 1.0:
            raise InvalidInput(f"no state keeps a margin of {self.margin:g}", "choose 0.01 to 1, such as 0.12")
        if self.effort not in STARTS:
            raise InvalidInput(f"there is no effort {self.effort!r}", f"choose {' or '.join(STARTS)}")


@dataclass(frozen=True)
class Miss:
    """A place of the drawing [m] from which the rod is far, and by how much [m]."""

    x: float
    y: float
    off: float


@dataclass(frozen=True)
class Fit:
    """The shape whose curve is nearest to a drawing, of all that the search met."""

    scene: Scene  # the shape
    drawing: Drawing  # what was drawn
    rms: float  # [m], of the distances from curve to drawing and back
    max: float  # [m], the largest of them
    worst: tuple[Miss, ...]  # the farthest first
    margin: float  # the least of its states, a part of a straight clamped rod's lowest eigenvalue
    starts: int  # rows from which the search began
    hits: int  # of these, how many led to rows as near as this one
    second_best: float | None  # [m], rms of the nearest other row that was met
    plan: Plan | None  # from home
    refusal: str  # why there is none; empty if there is one, or none was asked for
    seconds: float  # that it took

    def document(self) -> dict[str, Any]:
        """All of it as plain data, without the steps of the plan."""
        scene, plan = self.scene, self.plan
        return {
            "curveline": __version__,
            "target": {"name": self.drawing.name, "points": len(self.drawing.points)},
            "shape": scene.name,
            "display": scene.display.name,
            "nodes": [{"height_mm": to_mm(node.height), "angle_deg": to_deg(node.angle)} for node in scene.nodes],
            "segments": [{"length_mm": to_mm(each.length), "state": each.state} for each in scene.segments],
            "distance": {
                "rms_mm": to_mm(self.rms),
                "max_mm": to_mm(self.max),
                "worst": [{"x_mm": to_mm(at.x), "y_mm": to_mm(at.y), "mm": to_mm(at.off)} for at in self.worst],
            },
            "margin": self.margin,
            "global": {
                "starts": self.starts,
                "hits": self.hits,
                "second_best_mm": None if self.second_best is None else to_mm(self.second_best),
            },
            "plan": None if plan is None else {"steps": len(plan.steps), "seconds": plan.seconds},
            "refusal": self.refusal or None,
            "seconds": self.seconds,
        }

    def _repr_html_(self) -> str:
        head = ("node", "height mm", "angle deg")
        rows = [(place, to_mm(node.height), to_deg(node.angle)) for place, node in enumerate(self.scene.nodes, 1)]
        return html_of(f"{self.scene.name}: {to_mm(self.rms):.3g} mm RMS off {self.drawing.name}", [head, *rows])


def fit(drawing: Drawing, display: Display, request: FitRequest, listener: Listener = SILENT) -> Fit:
    """The shape of a display whose stable curve is nearest to a drawing, of all that so many starts lead to.

    The distance is measured on the curve that `simulate` gives. InvalidInput for a drawing that no display can show;
    Infeasible where no stable row of nodes was met.
    """
    begin = time.monotonic()
    listener.computing()
    rod = level_rod(display)
    wanted = Wanted(display, rod.bearing, cut_at_rails(drawing, display), request.margin)
    rows, count = _rows(wanted, rod, request, listener)
    candidates = [found for row in rows[:PLANNED] if (found := _measured(wanted, drawing, row)) is not None]
    if not candidates:
        raise Infeasible(
            f"{drawing.name}: no stable curve of {display.name} was met near it",
            "it may bend too often, or need more or less rod than the display has: draw it simpler",
        )
    candidates.sort(key=lambda found: found.rms)
    best = candidates[0]
    others = [row.rms for row in rows if row.rms > (1.0 + SAME) * best.rms]
    best = replace(
        best,
        starts=count,
        hits=sum(row.rms <= (1.0 + SAME) * rows[0].rms for row in rows),
        second_best=min(others, default=None),
    )
    if request.is_planned:
        best = _with_plan(best, candidates, listener)
    return replace(best, seconds=time.monotonic() - begin)


def _rows(wanted: Wanted, rod: Any, request: FitRequest, listener: Listener) -> tuple[list[Row], int]:
    """The rows that all starts lead to, the nearest first, and how many starts there were."""
    rows, count = [], 0
    with listener.progress("fitting, starts:", None) as heard:
        for numbers, held in starts(wanted, rod, STARTS[request.effort], request.seed):
            count += 1
            heard(count)
            if (row := polish(wanted, numbers, held)) is not None:
                rows.append(row)
    return sorted(rows, key=lambda row: row.rms), count


def _measured(wanted: Wanted, drawing: Drawing, row: Row) -> Fit | None:
    """A row as a shape, its distance measured on the curve that is simulated; None if its states are not found."""
    scene = _scene(wanted, drawing, row)
    named, curves = [], []
    for segment, found in enumerate(simulate(scene, TOLERANCE)):
        states = [state for state in found.states if state.stable and state.name in (PEAK, VALLEY)]
        if not states:
            return None
        places = [state.curve(POINTS) + [0.0, scene.nodes[segment].height] for state in states]
        off = [float(np.mean(_gaps(each, wanted.pieces[segment]) ** 2)) for each in places]
        nearest = int(np.argmin(off))
        named.append(replace(scene.segments[segment], state=states[nearest].name))
        curves.append(places[nearest])
    gaps = [_gaps(curve, piece) for curve, piece in zip(curves, wanted.pieces, strict=True)]
    return Fit(
        scene=replace(scene, segments=tuple(named)),
        drawing=drawing,
        rms=math.sqrt(float(np.mean([np.mean(each**2) for each in gaps]))),
        max=max(float(np.max(np.abs(each))) for each in gaps),
        worst=tuple(_worst(wanted, gaps)),
        margin=row.margin,
        starts=0,
        hits=0,
        second_best=None,
        plan=None,
        refusal="",
        seconds=0.0,
    )


def _scene(wanted: Wanted, drawing: Drawing, row: Row) -> Scene:
    """A row as a shape, its numbers as a file has them; the states have no names yet."""
    count, display = len(wanted.pieces) + 1, wanted.display
    heights, angles, roots = np.split(row.numbers, [count, 2 * count])
    lengths = np.hypot(display.span, np.diff(heights)) + display.span * roots**2
    nodes = tuple(
        Node(mm(round(to_mm(float(height)), DIGITS)), deg(round(to_deg(float(angle)), DIGITS)))
        for height, angle in zip(heights, angles, strict=True)
    )
    segments = tuple(Segment(mm(round(to_mm(float(length)), DIGITS)), PEAK) for length in lengths)
    return Scene(drawing.name, display, nodes, segments)


def _gaps(curve: Array, piece: Array) -> Array:
    """Distances of the points of a curve from a drawing, then of the drawing's from the curve [m]."""
    nothing = np.zeros((0, curve.shape[0], 2))
    out: Array = np.asarray(misfits(curve, piece, nothing, np.empty((curve.shape[0] + piece.shape[0], 0))))
    return out


def _worst(wanted: Wanted, gaps: Sequence[Array]) -> list[Miss]:
    """Where along the drawing the rod is farthest away: the largest of each segment, the farthest first."""
    found = []
    for segment, (piece, each) in enumerate(zip(wanted.pieces, gaps, strict=True)):
        back = np.abs(each[-piece.shape[0] :])
        place = int(np.argmax(back))
        x, y = piece[place]
        found.append(Miss(float(x) + segment * wanted.display.span, float(y), float(back[place])))
    return sorted(found, key=lambda miss: -miss.off)[:WORST]


def _with_plan(best: Fit, candidates: Sequence[Fit], listener: Listener) -> Fit:
    """The nearest of some fits that has a plan from home; the nearest of all, and why it has none, if none has."""
    refusal = ""
    for found in candidates:
        listener.computing()
        try:
            plan = make_plan(found.scene)
        except (Infeasible, InvalidInput) as error:
            refusal = refusal or error.message
            continue
        kept = {"starts": best.starts, "hits": best.hits, "second_best": best.second_best}
        return replace(found, plan=plan, **kept)
    return replace(best, refusal=refusal)

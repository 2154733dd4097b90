"""How near fits come to random drawings, and how soon: held against many more starts than a fit has."""

from __future__ import annotations

import time
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, replace

import numpy as np

from curveline.bench.drawn_curves import drawings
from curveline.bench.measurement import Measurement
from curveline.drawings.drawing import Drawing
from curveline.fitting.cutting import cut_at_rails
from curveline.fitting.fit import EFFORTS, MARGIN, PART, QUICK, FitRequest, fit_drawing
from curveline.fitting.row import Reserve, Wanted
from curveline.fitting.search import FitEffort, search
from curveline.fitting.starts import level_rod
from curveline.scene import Display
from curveline.shapes.files import read_display
from curveline.units import mm, to_mm

SEED = 20_000
LONE, ROW, LONG = "single", "quad", 16
"""Displays that are fitted, and how many segments a long one has."""
BRUTE_LONE = FitEffort(lone=60, alone=1, row=1, agreeing=10_000)
BRUTE_ROW = FitEffort(lone=20, alone=20, row=20, agreeing=10_000)
"""What fits are held against."""
OTHER_SEED = 2
NEAR = mm(0.05)
"""A reachable curve is found if it is no farther off than the best by this [m]."""
NEAR_PART, NEAR_REST = 0.01, mm(0.02)
"""Others, by this part, and this [m] more."""


@dataclass(frozen=True)
class HeldAgainst:
    """What came of fits to some drawings: times [s], and which were as near as the best of many starts."""

    seconds: tuple[float, ...]
    found: tuple[bool, ...]

    def time_at(self, share: float) -> float:
        """The time that a share of the fits took at most [s]."""
        return float(np.quantile(self.seconds, share))

    @property
    def share(self) -> float:
        """Of those that were found."""
        return float(np.mean(self.found))


def held(display: Display, drawn: Iterable[Drawing], brute: FitEffort, *slack: float) -> HeldAgainst:
    """Fits to some drawings, held against the best of many starts: what is off by a part and a rest more is found."""
    rod = level_rod(display).extensible()
    seconds, found = [], []
    for drawing in drawn:
        wanted = Wanted(display, rod.bearing, *cut_at_rails(drawing, display), Reserve(MARGIN, PART))
        begin = time.process_time()
        quick = search(wanted, rod, EFFORTS[QUICK], 1)
        seconds.append(time.process_time() - begin)
        rows = (*search(wanted, rod, brute, OTHER_SEED).rows, *quick.rows)
        best = min((row.rms for row in rows), default=np.inf)
        found.append(bool(quick.rows) and quick.rows[0].rms <= best * (1.0 + slack[0]) + slack[1])
    return HeldAgainst(tuple(seconds), tuple(found))


def rows(curves: int = 60, seed: int = SEED) -> Iterator[Measurement]:
    """All figures, from so many lone drawings of either kind, and a tenth as many of several segments."""
    lone, row = read_display(LONE), read_display(ROW)
    held(lone, drawings(lone, "reachable", 1, seed), BRUTE_LONE, 0.0, NEAR)
    told = held(lone, drawings(lone, "reachable", curves, seed), BRUTE_LONE, 0.0, NEAR)
    how = f"{curves} curves with noise"
    yield Measurement("fit, reachable, median", 1e3 * told.time_at(0.5), "ms", "< 10", how)
    yield Measurement("fit, reachable, p99", 1e3 * told.time_at(0.99), "ms", "< 50", how)
    yield Measurement("fit, reachable, found", 100.0 * told.share, "%", ">= 99.5", "within 0.05 mm of 60 starts")
    told = held(lone, drawings(lone, "unreachable", curves, seed), BRUTE_LONE, NEAR_PART, NEAR_REST)
    yield Measurement("fit, unreachable, median", 1e3 * told.time_at(0.5), "ms", "< 50", f"{curves} drawings")
    yield Measurement("fit, unreachable, found", 100.0 * told.share, "%", ">= 97", "within 1 % of 60 starts")
    some = max(curves // 10, 1)
    told = held(row, drawings(row, "unreachable", some, seed), BRUTE_ROW, NEAR_PART, NEAR_REST)
    yield Measurement("fit, four segments, p95", told.time_at(0.95), "s", "< 1", f"{some} drawings")
    yield Measurement("fit, four segments, found", 100.0 * told.share, "%", ">= 95", "within 1 % of 20 restarts")
    yield _long(row, seed)
    yield _planned(lone, curves, seed)


def _long(row: Display, seed: int) -> Measurement:
    """The time of a fit over many segments."""
    rod = replace(row.rod, total_length=row.rod.total_length * LONG / (row.node_count - 1))
    display = replace(row, node_count=LONG + 1, rod=rod)
    clamped = level_rod(display).extensible()
    spent = []
    for drawing in drawings(display, "unreachable", 3, seed):
        begin = time.process_time()
        wanted = Wanted(display, clamped.bearing, *cut_at_rails(drawing, display), Reserve(MARGIN, PART))
        search(wanted, clamped, EFFORTS[QUICK], 1)
        spent.append(time.process_time() - begin)
    return Measurement(f"fit, {LONG} segments", float(np.median(spent)), "s", "< 2", "median of 3 drawings")


def _planned(lone: Display, curves: int, seed: int) -> Measurement:
    """How many fits of drawings have a plan."""
    found = [fit_drawing(each, lone, FitRequest()) for each in drawings(lone, "unreachable", curves, seed)]
    share = 100.0 * float(np.mean([each.plan is not None for each in found]))
    worst = to_mm(max(each.rms for each in found))
    return Measurement("fit, with a plan", share, "%", ">= 95", f"{curves} drawings, at most {worst:.0f} mm off")

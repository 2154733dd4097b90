"""Fits of many random drawings, held against many more starts: `python -m tests.completeness.drawn --curves 1000`."""

from __future__ import annotations

import argparse
import math
import time

import numpy as np

from curveline.bench.drawn_curves import KINDS, drawings, unreachable
from curveline.bench.fits import BRUTE_LONE, BRUTE_ROW, NEAR, NEAR_PART, NEAR_REST, HeldAgainst, held
from curveline.errors import CurvelineError
from curveline.fitting.fit import FitRequest, fit_drawing
from curveline.scene import Display
from curveline.shapes.files import read_display


def told(name: str, found: HeldAgainst) -> None:
    """A line of what came of some fits."""
    times = ", ".join(f"{part} {1e3 * found.time_at(share):.1f}" for part, share in (("median", 0.5), ("p95", 0.95)))
    print(f"{name}: {sum(found.found)} of {len(found.found)}; ms: {times}, p99 {1e3 * found.time_at(0.99):.1f}")


def planned(display: Display, count: int, seed: int) -> None:
    """How many fits have a plan, and whether bounds hold."""
    plans, beyond, nothing = 0, 0, 0
    worst: dict[str, list[float]] = {kind: [] for kind in KINDS}
    begin = time.process_time()
    for number in range(seed, seed + count):
        drawing = unreachable(display.span, display.node_count - 1, number)
        try:
            found = fit_drawing(drawing, display, FitRequest())
        except CurvelineError:
            nothing += 1
            continue
        plans += found.plan is not None
        beyond += found.least_possible.rms > found.rms or found.least_possible.max > found.max
        worst[drawing.name].append(1e3 * found.rms)
    spent = (time.process_time() - begin) / count
    print(f"{display.name}: {plans} of {count} have a plan, {nothing} no curve; {spent:.2f} s each")
    print(f"  bounds that a fit fell below: {beyond}")
    for kind, off in worst.items():
        print(f"  {kind}: {np.median(off) if off else math.nan:.2f} mm RMS, the median")


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--curves", type=int, default=100, help="reachable ones, half as many others, a tenth of rows")
    parser.add_argument("--seed", type=int, default=40_000)
    asked = parser.parse_args()
    lone, row, some = read_display("single"), read_display("quad"), max(asked.curves // 10, 1)
    held(lone, drawings(lone, "reachable", 1, asked.seed), BRUTE_LONE, 0.0, NEAR)
    told("reachable", held(lone, drawings(lone, "reachable", asked.curves, asked.seed), BRUTE_LONE, 0.0, NEAR))
    others = drawings(lone, "unreachable", asked.curves // 2, asked.seed)
    told("unreachable", held(lone, others, BRUTE_LONE, NEAR_PART, NEAR_REST))
    rows = drawings(row, "unreachable", some, asked.seed)
    told("four segments", held(row, rows, BRUTE_ROW, NEAR_PART, NEAR_REST))
    planned(lone, asked.curves // 2, asked.seed)
    planned(row, some, asked.seed)


if __name__ == "__main__":
    main()

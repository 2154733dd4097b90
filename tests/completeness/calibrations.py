"""Calibrations of displays that are not as their files say: `python -m tests.completeness.calibrations --seeds 100`.

Eight shapes, three trials each, which differ by 0.75 mm (MSD): errors of the numbers, and how often their intervals
cover the truth.
"""

from __future__ import annotations

import argparse
import time
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from curveline.calibrating.calibrate import calibrate_trials
from curveline.calibrating.calibrated import RodCalibration
from curveline.calibrating.request import FITTED, NONE, CalibrationRequest
from curveline.calibrating.telling import gravity_length
from curveline.calibrating.unknowns import WEIGHT, Unknowns
from curveline.comparing.compare import compare
from curveline.units import to_mm
from tests.seen_trials import EIGHT, Reality, trials_of

Array = npt.NDArray[np.float64]


class Kept(NamedTuple):
    """Of every number, in the units of reports: errors (seeds, p), whether intervals cover (seeds, p)."""

    names: tuple[str, ...]
    errors: Array
    covered: Array

    @property
    def rms(self) -> dict[str, float]:
        """Root mean square errors."""
        return dict(zip(self.names, np.sqrt(np.mean(self.errors**2, axis=0)).tolist(), strict=True))

    @property
    def coverage(self) -> dict[str, float]:
        """Part of the intervals that cover the truth."""
        return dict(zip(self.names, np.mean(self.covered, axis=0).tolist(), strict=True))


def calibrations(seeds: range, *, leaning: bool = False, names: tuple[str, ...] = EIGHT) -> Kept:
    """What comes of calibrations of displays drawn by seeds."""
    request = CalibrationRequest(asymmetry=FITTED if leaning else NONE)
    rows = [_one(seed, names, request, leaning=leaning) for seed in seeds]
    labels, errors, covered = zip(*rows, strict=True)
    return Kept(labels[0], np.array(errors), np.array(covered))


def _one(seed: int, names: tuple[str, ...], request: CalibrationRequest, *, leaning: bool) -> tuple[
    tuple[str, ...], list[float], list[bool]
]:  # fmt: skip
    source = np.random.default_rng(seed)
    reality = Reality.drawn(source, leaning=leaning)
    found = calibrate_trials(trials_of(names, reality, source), request)
    return against(found, reality)


def against(found: RodCalibration, reality: Reality) -> tuple[tuple[str, ...], list[float], list[bool]]:
    """Names, errors in the units of reports, and whether the intervals cover."""
    unknowns = Unknowns(found.display.node_count)
    truth = {(each.kind, each.number): value for each, value in zip(unknowns.all, reality.numbers, strict=True)}
    labels, errors, covered = [], [], []
    for each in found.estimates:
        true = float(truth[each.kind, each.number])
        if each.kind == WEIGHT:
            true = gravity_length(true)
        labels.append(f"{each.name} {each.unit}")
        value = each.as_given[0]
        scale = value / each.value if each.value else 0.0
        errors.append(value - scale * true)
        covered.append(bool(each.low <= true <= each.high))
    return tuple(labels), errors, covered


def msd(seeds: range) -> float:
    """Mean standard deviation between the trials of a shape [mm]."""
    found = []
    for seed in seeds:
        source = np.random.default_rng(seed)
        found.append(compare(trials_of(EIGHT, Reality.drawn(source), source)).msd)
    return to_mm(float(np.mean([each for each in found if each is not None])))


def told(title: str, kept: Kept, seconds: float) -> None:
    """A table of errors and coverage."""
    print(f"{title}, {len(kept.errors)} displays, {seconds:.2f} s each")
    for name, rms in kept.rms.items():
        print(f"  {name:28} {rms:8.3f} RMS  {100.0 * kept.coverage[name]:5.1f} % covered")


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seeds", type=int, default=20, help="displays of each kind")
    parser.add_argument("--seed", type=int, default=1, help="the first one")
    asked = parser.parse_args()
    seeds = range(asked.seed, asked.seed + asked.seeds)
    print(f"trials of a shape differ by {msd(seeds[:10]):.3f} mm (MSD)")
    for leaning, title in ((False, "alike to both sides"), (True, "harder to one side")):
        begin = time.process_time()
        kept = calibrations(seeds, leaning=leaning)
        told(title, kept, (time.process_time() - begin) / len(seeds))


if __name__ == "__main__":
    main()

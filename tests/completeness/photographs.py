"""Photographs traced against a known truth: `python -m tests.completeness.photographs --seed 50000 --pictures 200`."""

from __future__ import annotations

import argparse
from collections import Counter
from collections.abc import Sequence

import numpy as np

from curveline.cameras.outcomes import TrialOutcome
from curveline.cameras.synthetic.faults import TIERS
from curveline.units import mm, to_mm
from tests.completeness.photographed import NONE_OF_THEM, Looked, looked_at, pictured

NEAR = mm(0.5)
"""What accepted photographs of the hard tier are to be within."""


def told(tier: str, looked: Sequence[Looked]) -> str:
    """A row of what came of photographs of a tier."""
    seen = [each for each in looked if each.outcome is TrialOutcome.SEEN]
    wrong = sum(each.state != each.wanted for each in seen)
    rms = to_mm(1.0) * np.array([each.rms for each in seen])
    part = np.array([each.rms / each.sigma for each in seen])
    inside = np.mean([each.inside for each in seen])
    within = np.mean(rms <= to_mm(NEAR))
    quantiles = " / ".join(f"{each:.3f}" for each in (np.median(rms), np.quantile(rms, 0.95), rms.max()))
    return (
        f"| {tier} | {len(looked)} | {len(looked) - len(seen)} | {wrong} | {quantiles} | {within:.1%} "
        f"| {to_mm(float(np.median([each.sigma for each in seen]))):.3f} | {np.sqrt(np.mean(part**2)):.2f} "
        f"| {inside:.1%} | {np.mean(part < 1.96):.1%} | {np.mean([each.seconds for each in looked]):.2f} |"
    )


HEAD = (
    "| tier | pictures | refused | wrong state | RMS mm, median / p95 / max | within 0.5 mm | stated sigma mm "
    "| RMS over sigma | points within 1.96 sigma | pictures within | CPU s |\n" + "|---" * 11 + "|"
)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument(
        "--pictures", type=int, default=200, help="of each tier, and of each kind that is to be refused"
    )
    parser.add_argument("--seed", type=int, default=50_000)
    parser.add_argument("--only", default="", help="a tier, or one of the kinds")
    parser.add_argument("--each", action="store_true", help="a line for every picture that is not right")
    asked = parser.parse_args()
    seeds = range(asked.seed, asked.seed + asked.pictures)
    print(HEAD)
    for tier in TIERS:
        if asked.only in ("", tier):
            looked = [looked_at(pictured(seed, tier)) for seed in seeds]
            print(told(tier, looked), flush=True)
            if asked.each:
                _list(seeds, looked)
    print("\n| shows none of the states | pictures | accepted | outcomes |\n|---|---|---|---|")
    for kind in NONE_OF_THEM:
        if asked.only in ("", kind):
            looked = [looked_at(pictured(seed, TIERS[seed % len(TIERS)], kind)) for seed in seeds]
            accepted = sum(each.outcome is TrialOutcome.SEEN for each in looked)
            outcomes = ", ".join(
                f"{name} {count}" for name, count in Counter(each.outcome.value for each in looked).items()
            )
            print(f"| {kind} | {len(looked)} | {accepted} | {outcomes} |", flush=True)
            if asked.each:
                most = sorted(zip(seeds, looked, strict=True), key=lambda pair: -pair[1].cover)[:5]
                print("\n".join(f"  {seed}: {each.outcome.value}, {each.cover:.2f} covered" for seed, each in most))


def _list(seeds: range, looked: Sequence[Looked]) -> None:
    for seed, each in zip(seeds, looked, strict=True):
        if (
            each.outcome is not TrialOutcome.SEEN
            or each.state != each.wanted
            or each.rms > 2.5 * each.sigma
            or each.rms > mm(0.35)
        ):
            print(
                f"  {seed}: {each.outcome.value} {each.state} for {each.wanted}, RMS {to_mm(each.rms):.2f} mm, "
                f"worst {to_mm(each.worst):.2f}, sigma {to_mm(each.sigma):.2f}, {each.cover:.2f} covered"
            )


if __name__ == "__main__":
    main()

"""From a display that is soft in its bearings, by its photographs, to a file that predicts it: nothing else is told."""

from __future__ import annotations

from pathlib import Path

import curveline
from curveline.calibrating.unknowns import GIVE
from curveline.units import mm, nmm, to_mm

SHAPES = ("level-neutral-peak", "level-neutral-valley", "level-up-valley", "level-down-peak", "staggered-up-peak")
STIFFNESS = 40.0  # [N mm/deg]


def test_a_soft_display_is_photographed_calibrated_and_compared_again(tmp_path: Path) -> None:
    pictures = tmp_path / "trials"
    pictures.mkdir()
    with curveline.connect(f"mock:fresh,clamp={STIFFNESS:g}", runs=tmp_path / "runs") as session:
        sent = curveline.send_verified(session, SHAPES, curveline.VerifyRequest("mock:lab,51000", pictures=pictures))
    assert sent.is_wanted
    trials = curveline.read_trials([pictures])
    before = curveline.compare(trials)
    assert before.rmse is not None
    assert before.rmse > mm(5.0)
    found = curveline.calibrate_rod(trials)
    give = found.display.rod.bending_stiffness / (nmm(STIFFNESS) * 180.0 / 3.141592653589793)
    assert abs(to_mm(found.estimate(GIVE).value - give)) < 0.5
    curveline.write(found, tmp_path / "soft.toml")
    after = curveline.compare(curveline.read_trials([pictures], display=tmp_path / "soft.toml"))
    assert after.is_good
    assert after.rmse is not None
    assert after.rmse < mm(1.0)

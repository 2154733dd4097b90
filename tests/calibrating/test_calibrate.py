"""Displays that are not as their files say, found from trials: numbers, intervals, what is not told, and the file."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import curveline
from curveline.calibrating import next_shape
from curveline.calibrating.calibrate import calibrate_trials
from curveline.calibrating.calibrated import RodCalibration
from curveline.calibrating.display_file import calibrated_text
from curveline.calibrating.droop import Droop, sag_of
from curveline.calibrating.request import FITTED, NONE, CalibrationRequest
from curveline.calibrating.unknowns import ANGLE, ASYMMETRY, GIVE, LENGTH, TURN, WEIGHT
from curveline.cameras.outcomes import TrialOutcome
from curveline.errors import Infeasible, InvalidInput
from curveline.shapes.files import builtin_text, read_display, read_shape
from curveline.trial import ShapeTrials, Trial
from curveline.units import deg, mm, to_mm
from seen_trials import EIGHT, Reality, trials_of
from tests.completeness.calibrations import against, calibrations

PLAIN = CalibrationRequest(asymmetry=NONE)
PEAKS = tuple(name for name in EIGHT if name.endswith("peak"))
AS_KNOWN = {
    "gravity length mm": 37.0,
    "bearings give mm": 0.26,
    "angle of node 1 deg": 0.18,
    "angle of node 2 deg": 0.22,
    "length of segment 1 mm": 0.26,
    "bending asymmetry %": 0.8,
}
"""Root mean square errors that are known to be possible, of these shapes and trials that differ by 0.75 mm."""


def reality(seed: int = 7, **changes: float) -> Reality:
    return replace(Reality.drawn(np.random.default_rng(seed)), **changes)


def made(names: tuple[str, ...] = EIGHT, seed: int = 7, **changes: float) -> tuple[tuple[ShapeTrials, ...], Reality]:
    real = reality(seed, **changes)
    return trials_of(names, real, np.random.default_rng(seed)), real


@pytest.fixture(scope="module")
def eight() -> tuple[RodCalibration, tuple[ShapeTrials, ...], Reality]:
    """All eight shapes, calibrated with."""
    trials, real = made()
    return calibrate_trials(trials, PLAIN), trials, real


def test_numbers_are_found_within_their_intervals(eight) -> None:
    found, _, real = eight
    names, errors, covered = against(found, real)
    assert sum(covered) >= len(covered) - 1, dict(zip(names, errors, strict=True))
    assert all(abs(error) < 3.0 * AS_KNOWN.get(name, 1.0) for name, error in zip(names, errors, strict=True))
    assert {each.kind for each in found.untold} <= {WEIGHT}
    assert found.shapes == 8
    assert found.left == ()


def test_the_shapes_are_as_simulated_with_what_was_found(eight, tmp_path: Path) -> None:
    found, trials, _ = eight
    assert found.before is not None
    assert found.before > mm(3.0)
    assert found.after < mm(1.0)
    path = tmp_path / "mine.toml"
    curveline.write(found, path)
    display = read_display(path)
    agreement = curveline.compare([ShapeTrials(replace(each.scene, display=display), each.trials) for each in trials])
    assert agreement.is_good
    assert agreement.rmse is not None
    assert agreement.msd is not None
    assert agreement.rmse < 1.6 * agreement.msd  # what is left is what trials of a shape differ by
    across = [shape.across for shape in agreement.shapes]
    assert across == pytest.approx([row.after for row in found.rows], rel=0.35)
    assert np.mean(across) < mm(1.0)


def test_a_file_keeps_its_comments(eight, tmp_path: Path) -> None:
    found, _, _ = eight
    before, after = builtin_text("single").splitlines(), calibrated_text(found).splitlines()
    gone = [line for line in before if line not in after]
    assert [line.split()[0] for line in gone] == ["youngs_modulus_GPa"]
    assert any(line.startswith("# youngs_modulus_GPa = 2.45") for line in after)
    (tmp_path / "mine.toml").write_text(calibrated_text(found))
    display = read_display(tmp_path / "mine.toml")
    assert display.rod.bending_stiffness == pytest.approx(found.calibrated.rod.bending_stiffness, rel=1e-3)
    assert display.rod.mass_per_length == found.display.rod.mass_per_length
    assert display.clamp_stiffness == pytest.approx(found.calibrated.clamp_stiffness, rel=1e-3)
    assert display.offsets.angles == pytest.approx(found.calibrated.offsets.angles, abs=1e-5)


def test_a_calibrated_file_is_calibrated_again(eight, tmp_path: Path) -> None:
    found, trials, _ = eight
    (tmp_path / "mine.toml").write_text(calibrated_text(found))
    display = read_display(tmp_path / "mine.toml")
    again = calibrate_trials([ShapeTrials(replace(each.scene, display=display), each.trials) for each in trials], PLAIN)
    for kind in (GIVE, ANGLE, LENGTH):
        one, other = found.estimate(kind), again.estimate(kind)
        assert other.value == pytest.approx(one.value, abs=0.2 * (one.high - one.low))
    text = calibrated_text(again)
    assert text.count("[offsets]") == 1
    assert text.count("angle_deg = [") == 2  # of the limits, and of the offsets
    assert text.count("\nclamp_stiffness_Nmm_per_deg = ") == 1
    assert text.count("\nbending_stiffness_Nmm2 = ") == 1


def test_peaks_alone_do_not_tell_what_bearings_give_and_what_to_measure_is_a_valley() -> None:
    trials, _ = made(PEAKS)
    found = calibrate_trials(trials, PLAIN)
    untold = {(each.kind, each.number): each.mixed_with for each in found.untold}
    assert untold[GIVE, 0].startswith("angle of node")
    assert (LENGTH, 0) not in untold
    assert found.next_shape is not None
    assert any(name.endswith("valley") for name in found.next_shape.shapes)
    assert found.next_shape.share < 0.9
    more = calibrate_trials(made((*PEAKS, *found.next_shape.shapes))[0], PLAIN)
    (one,), (other,) = (
        [each for each in those.estimates if each.name == found.next_shape.about] for those in (found, more)
    )
    assert other.high - other.low < 0.7 * (one.high - one.low)


def test_a_candidate_may_be_measured_next(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(next_shape, "_built_in", lambda: iter(()))
    trials, _ = made(PEAKS)
    valley = read_shape("level-down-valley")
    steep = replace(valley, name="mine", nodes=(replace(valley.nodes[0], angle=deg(-50.0)), valley.nodes[1]))
    found = calibrate_trials(trials, replace(PLAIN, candidates=(steep,)))
    assert found.next_shape is not None
    assert found.next_shape.shapes == ("mine",)


def test_an_asymmetry_is_found_where_there_is_one_and_only_there(eight) -> None:
    _, trials, _ = eight
    assert not calibrate_trials(trials[:4]).has_asymmetry
    real = Reality.drawn(np.random.default_rng(11), leaning=True)
    found = calibrate_trials(trials_of(EIGHT, real, np.random.default_rng(11)))
    assert found.has_asymmetry
    assert found.estimate(ASYMMETRY).value == pytest.approx(float(real.numbers[2]), abs=0.008)
    assert "# bending_asymmetry_percent = " in calibrated_text(found)
    asked = calibrate_trials(trials[:4], CalibrationRequest(asymmetry=FITTED))
    assert asked.estimate(ASYMMETRY).value == pytest.approx(0.0, abs=0.02)


def test_points_that_are_few_or_missing_in_the_middle_do_no_harm(eight) -> None:
    found, trials, _ = eight

    def fewer(curve, number: int):
        kept = np.arange(len(curve.points))
        kept = kept[::7] if number % 2 else kept[(kept < 50) | (kept > 90)]
        return replace(curve, points=curve.points[kept])

    given = [
        ShapeTrials(
            each.scene,
            tuple(replace(one, curves=(fewer(one.curves[0], place),)) for place, one in enumerate(each.trials)),
        )
        for each in trials
    ]
    less = calibrate_trials(given, PLAIN)
    assert less.left == ()
    for kind, apart in ((GIVE, mm(0.3)), (ANGLE, deg(0.2)), (LENGTH, mm(0.2))):
        assert less.estimate(kind).value == pytest.approx(found.estimate(kind).value, abs=apart)


def test_a_droop_test_tells_the_gravity_length() -> None:
    trials, real = made(EIGHT[:3])
    length = float(real.numbers[0]) ** (-1.0 / 3.0)
    droop = Droop(0.3, 0.3 * sag_of((0.3 / length) ** 3), mm(1.0))
    bare, hung = calibrate_trials(trials, PLAIN), calibrate_trials(trials, replace(PLAIN, droop=droop))
    wide, narrow = bare.estimate(WEIGHT), hung.estimate(WEIGHT)
    assert narrow.high - narrow.low < 0.5 * min(wide.high - wide.low, 1.0)
    assert narrow.low < length < narrow.high
    assert narrow.is_told


def test_a_trial_that_is_off_by_itself_counts_less(eight) -> None:
    found, trials, _ = eight
    shifted = trials[0].trials[0]
    curve = replace(shifted.curves[0], points=shifted.curves[0].points + np.array([0.0, mm(12.0)]))
    wrong = ShapeTrials(trials[0].scene, (replace(shifted, curves=(curve,)), *trials[0].trials[1:]))
    off = calibrate_trials((wrong, *trials[1:]), PLAIN)
    for kind, apart in ((GIVE, mm(0.3)), (ANGLE, deg(0.25)), (LENGTH, mm(0.3))):
        assert off.estimate(kind).value == pytest.approx(found.estimate(kind).value, abs=apart)


def test_what_was_not_seen_or_shows_no_state_is_left_out(eight) -> None:
    _, trials, _ = eight
    blurred = Trial("blurred.jpg", TrialOutcome.BLURRED, "it is blurred")
    first = trials[1].trials[0]
    line = np.column_stack([np.linspace(0.0, 0.5, 30), np.linspace(0.0, 0.2, 30)])
    strange = replace(first, source="strange.csv", curves=(replace(first.curves[0], points=line),))
    given = (
        ShapeTrials(trials[0].scene, (*trials[0].trials, blurred)),
        ShapeTrials(trials[1].scene, (strange, *trials[1].trials)),
        *trials[2:],
    )
    found = calibrate_trials(given, PLAIN)
    assert dict(found.left)["blurred.jpg"] == "it is blurred"
    assert "none of its states" in dict(found.left)["strange.csv"]
    assert [row.trials for row in found.rows] == [3] * 8


def test_trials_that_the_file_has_no_state_for_are_calibrated_with() -> None:
    """The level asymmetric peak past the limit of rigid bearings, which soft ones hold."""
    real = reality()
    numbers = real.numbers.copy()
    numbers[1] = mm(30.0)
    soft = replace(real, numbers=numbers)
    peak = read_shape("level-asymmetric-peak")
    beyond = replace(peak, nodes=(peak.nodes[0], replace(peak.nodes[1], angle=deg(52.5))))
    from seen_trials import _trials

    source = np.random.default_rng(3)
    given = (*trials_of(EIGHT[:6], soft, source), _trials(beyond, soft, source, 3))
    found = calibrate_trials(given, PLAIN)
    assert found.rows[-1].before is None
    assert found.before is None
    assert found.after < mm(1.2)
    assert found.estimate(GIVE).value == pytest.approx(mm(30.0), abs=mm(2.0))


def test_a_display_of_several_segments_has_numbers_of_each() -> None:
    roof = read_shape("roofline")
    source = np.random.default_rng(5)
    real = Reality.drawn(source, nodes=len(roof.nodes))
    numbers = real.numbers.copy()
    count = len(roof.nodes)
    numbers[3 : 3 + count] *= 0.5
    real = replace(real, numbers=numbers)
    from seen_trials import _trials

    flatter = replace(roof, nodes=tuple(replace(node, angle=0.7 * node.angle) for node in roof.nodes))
    found = calibrate_trials([_trials(each, real, source, 3) for each in (roof, flatter)], PLAIN)
    assert [each.kind for each in found.estimates].count(ANGLE) == count
    assert [each.kind for each in found.estimates].count(LENGTH) == count - 1
    assert found.rms < mm(1.5)
    assert found.before is not None
    assert found.before > 1.2 * found.after


def test_a_rod_without_weight_has_no_gravity_length(eight) -> None:
    _, trials, _ = eight
    flat = replace(trials[0].scene.display, gravity=False)
    given = [ShapeTrials(replace(each.scene, display=flat), each.trials) for each in trials[:4]]
    found = calibrate_trials(given, PLAIN)
    assert all(each.kind != WEIGHT for each in found.estimates)


def test_what_cannot_be_calibrated_with_is_refused(eight) -> None:
    _, trials, _ = eight
    with pytest.raises(InvalidInput, match="no trials"):
        calibrate_trials([])
    with pytest.raises(InvalidInput, match="1 shape with trials"):
        calibrate_trials(trials[:1])
    quad = ShapeTrials(read_shape("roofline"), trials[0].trials)
    with pytest.raises(InvalidInput, match="another one"):
        calibrate_trials([trials[0], quad])
    scene = trials[0].scene
    turned = replace(scene, nodes=(replace(scene.nodes[0], yaw=0.1), scene.nodes[1]))
    with pytest.raises(InvalidInput, match="yaw"):
        calibrate_trials([ShapeTrials(turned, trials[0].trials), trials[1]])
    with pytest.raises(InvalidInput, match="asymmetry"):
        CalibrationRequest(asymmetry="some")
    line = np.column_stack([np.linspace(0.0, 0.5, 30), np.linspace(0.0, 0.3, 30)])
    away = [
        ShapeTrials(
            each.scene,
            tuple(replace(one, curves=(replace(one.curves[0], points=line),)) for one in each.trials),
        )
        for each in trials[:2]
    ]
    with pytest.raises(Infeasible, match="none of the states"):
        calibrate_trials(away)


def test_intervals_cover_and_errors_are_as_small_as_is_known() -> None:
    kept = calibrations(range(60, 68))
    for name, most in AS_KNOWN.items():
        if name in kept.rms:
            assert kept.rms[name] < 1.1 * most, name
    assert np.mean(kept.covered) > 0.88


@pytest.mark.campaign
@pytest.mark.parametrize("leaning", [False, True])
def test_many_displays_are_found(leaning: bool) -> None:
    kept = calibrations(range(50_000, 50_100), leaning=leaning)
    for name, most in AS_KNOWN.items():
        if name in kept.rms:
            assert kept.rms[name] < 1.1 * most, name
    assert all(covered >= 0.90 for covered in kept.coverage.values()), kept.coverage
    assert 0.90 <= float(np.mean(kept.covered)) <= 0.99


def test_a_frame_is_found_beside_the_display(eight) -> None:
    found, _, real = eight
    assert found.estimate(TURN).value == pytest.approx(float(real.numbers[-2]), abs=deg(0.06))
    assert to_mm(found.rms) < to_mm(found.after)

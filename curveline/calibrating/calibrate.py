"""From trials of several shapes to the numbers of their display."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from curveline.calibrating.calibrated import RodCalibration, ShapeRow
from curveline.calibrating.descent import Fitted, SoughtNumbers, fitted
from curveline.calibrating.intervals import Uncertainty, uncertainty_of
from curveline.calibrating.misfit import likely
from curveline.calibrating.next_shape import next_of
from curveline.calibrating.request import AUTO, FITTED, NONE, CalibrationRequest
from curveline.calibrating.sorting import Sorted, sorted_by_state
from curveline.calibrating.telling import estimates_of
from curveline.calibrating.unknowns import ASYMMETRY, WEIGHT, Unknowns, weight_of
from curveline.cameras.outcomes import TrialOutcome
from curveline.errors import Infeasible, InvalidInput
from curveline.listening import SILENT, Listener
from curveline.rod.models.choice import beyond
from curveline.scene import Display
from curveline.simulation.simulate import scene_rod
from curveline.trial import Array, ShapeTrials
from curveline.units import mm

LEAST_SHAPES = 2
"""Shapes that tell by how much they disagree."""
ROUNDS = 4
"""In which curves may be found to be in other states than by the numbers before."""
GIVES = None, mm(20.0)
"""Where bearings' compliance is sought from: as the file has it, and softer where that leaves trials far off."""
FAR = mm(3.0)
"""Root mean square distance from which on another start is tried."""
CLEARLY = 1.5
"""Times its interval: an asymmetry that is larger is told by the trials."""
LITTLE = 0.005
"""An asymmetry that is of no account."""


def calibrate_trials(
    trials: Sequence[ShapeTrials], request: CalibrationRequest | None = None, listener: Listener = SILENT
) -> RodCalibration:
    """The numbers of a display that fit trials of its shapes best.

    InvalidInput for trials of several displays, of fewer than two shapes, or of shapes that a planar rod without loads
    cannot show; Infeasible if they show none of the shapes' states.
    """
    asked = request or CalibrationRequest()
    display = _display_of(trials)
    listener.computing()
    with listener.progress("calibrating", 3) as heard:
        plain, sorting = _best(trials, asked, None)
        heard(1)
        leaning = _leaning(trials, asked, plain)
        heard(2)
        best = leaning or plain
        uncertainty = uncertainty_of(best)
        found = _calibration(display, asked, (plain, best), (sorting, uncertainty))
        found = found.with_next(next_of(best, uncertainty, asked.candidates))
        heard(3)
    return found


def _display_of(trials: Sequence[ShapeTrials]) -> Display:
    """The display of all trials; InvalidInput for what cannot be calibrated with."""
    if not trials:
        raise InvalidInput("no trials to calibrate with", "name a folder of trials, or a shape and files of its trials")
    first = trials[0].scene
    for each in trials:
        scene = each.scene
        if scene.display.digest != first.display.digest or scene.display.node_count != first.display.node_count:
            hint = "calibrate each display with the trials of its own shapes"
            raise InvalidInput(f"{scene.name} is of display {scene.display.name}, {first.name} of another one", hint)
        what = [word for index in range(len(scene.segments)) for word in beyond(scene_rod(scene, index))]
        if what or scene.loads:
            lack = " and ".join(what) or "loads"
            raise InvalidInput(
                f"{scene.name} has {lack}, and a rod is calibrated in its plane by its own weight",
                "leave this shape out",
            )
    used = [each for each in trials if any(trial.outcome is TrialOutcome.SEEN for trial in each.trials)]
    if len(used) < LEAST_SHAPES:
        hint = "show peaks and valleys of the same nodes: these tell most; eight shapes tell all there is"
        raise InvalidInput(f"{len(used)} shape with trials that can be used cannot tell how good the numbers are", hint)
    return first.display


def _best(trials: Sequence[ShapeTrials], asked: CalibrationRequest, like: Fitted | None) -> tuple[Fitted, Sorted]:
    """The best fit from several starts; with asymmetry from one `like` it that has none."""
    best: tuple[Fitted, Sorted] | None = None
    for give in GIVES:
        found = _from(trials, asked, give, like)
        if found is not None and (best is None or _rank(found) < _rank(best)):
            best = found
        if best is not None and not best[1].left and best[0].misfit.rms < FAR:
            break
        if like is not None:
            break
    if best is None:
        hint = "`curveline compare` says how far each trial is from the states of its shape"
        raise Infeasible("the trials show none of the states that these shapes have", hint)
    return best


def _rank(found: tuple[Fitted, Sorted]) -> tuple[int, float]:
    return len(found[1].left), found[0].misfit.rms


def _from(
    trials: Sequence[ShapeTrials], asked: CalibrationRequest, give: float | None, like: Fitted | None
) -> tuple[Fitted, Sorted] | None:
    """The fit from one start, with what states its curves are in there; None if it leads nowhere."""
    display = trials[0].scene.display
    unknowns = Unknowns(display.node_count)
    numbers = unknowns.of_display(display) if like is None else like.numbers
    numbers = numbers.copy()
    if give is not None and like is None:
        numbers[1] = give
    sought: Fitted | None = None
    sorting: Sorted | None = None
    for _ in range(ROUNDS):
        again = sorted_by_state(trials, unknowns, numbers)
        if sorting is not None and _same(sorting, again):
            break
        sorting = again
        if len({segment.shape for segment in sorting.seen}) < LEAST_SHAPES:
            return None
        found = fitted(_sought(sorting, asked, display, is_leaning=like is not None), numbers, sorting.held)
        if found is None:
            return None
        sought, numbers = found, found.numbers
    return None if sought is None or sorting is None else (sought, sorting)


def _same(one: Sorted, other: Sorted) -> bool:
    """True if all curves are in the same states."""
    first, second = (
        [(each.shape, each.bent.index, each.state, len(each.seen)) for each in sorting.seen] for sorting in (one, other)
    )
    return first == second


def _sought(sorting: Sorted, asked: CalibrationRequest, display: Display, *, is_leaning: bool) -> SoughtNumbers:
    unknowns = sorting.seen[0].bent.unknowns
    free = np.ones(unknowns.size, dtype=np.bool_)
    told, sure = unknowns.of_display(display), likely(unknowns)
    for place, unknown in enumerate(unknowns.all):
        if unknown.kind == ASYMMETRY:
            free[place] = is_leaning
        if unknown.kind == WEIGHT:
            free[place] = weight_of(display) > 0.0
            if asked.droop is not None:
                told[place], sure[place] = asked.droop.weight, 1.0 / asked.droop.sigma**2
    return SoughtNumbers(unknowns, sorting.seen, free, told, sure)


def _leaning(trials: Sequence[ShapeTrials], asked: CalibrationRequest, plain: Fitted) -> Fitted | None:
    """The fit with a rod that bends harder to one side, if that is asked for or told by the trials."""
    if asked.asymmetry == NONE:
        return None
    leaning, _ = _best(trials, asked, plain)
    if asked.asymmetry == FITTED:
        return leaning
    assert asked.asymmetry == AUTO, "there are three"
    (place,) = (number for number, each in enumerate(leaning.sought.unknowns.all) if each.kind == ASYMMETRY)
    size = abs(float(leaning.numbers[place]))
    reach = uncertainty_of(leaning).reach[int(np.sum(leaning.sought.free[:place]))]
    return leaning if size > max(CLEARLY * float(reach), LITTLE) else None


def _calibration(
    display: Display,
    asked: CalibrationRequest,
    fits: tuple[Fitted, Fitted],
    others: tuple[Sorted, Uncertainty],
) -> RodCalibration:
    plain, best = fits
    sorting, uncertainty = others
    return RodCalibration(
        display=display,
        calibrated=calibrated_display(display, best.sought.unknowns, best.numbers),
        estimates=estimates_of(best, uncertainty),
        rows=tuple(_rows(best, display)),
        left=sorting.left,
        next_shape=None,
        request=asked,
        rms=best.misfit.rms,
        has_asymmetry=best is not plain,
        shapes=len({segment.shape for segment in sorting.seen}),
    )


def calibrated_display(display: Display, unknowns: Unknowns, numbers: Array) -> Display:
    """A display with the numbers that were found; its rod keeps its mass, and gets another stiffness."""
    rod = display.rod
    weight, give = float(numbers[0]), float(numbers[1])
    share = 1.0 if weight <= 0.0 else weight_of(display) / weight
    stiffer = replace(
        rod,
        youngs_modulus=share * rod.youngs_modulus,
        shear_modulus=share * rod.shear_modulus,
        is_stiffness_measured=True,
    )
    stiffness = math.inf if give <= 0.0 else stiffer.bending_stiffness / give
    return replace(display, rod=stiffer, clamp_stiffness=stiffness, offsets=unknowns.offsets(numbers))


def _rows(plain: Fitted, display: Display) -> list[ShapeRow]:
    """Every shape and state as simulation has it, before and after, both with the camera's frame as it is."""
    unknowns = plain.sought.unknowns
    as_is = plain.numbers.copy()
    as_is[unknowns.frame] = 0.0
    as_is[2] = 0.0
    first = unknowns.of_display(display)
    first[1] = display.rod.bending_stiffness / display.clamp_stiffness
    rows = []
    for segment, state in zip(plain.sought.seen, plain.misfit.held, strict=True):
        scene = segment.bent.scene
        before, after = segment.off_by(first), segment.off_by(as_is, state)
        name = scene.name
        rows.append(ShapeRow(name, segment.bent.index, segment.state, len(segment.seen), before, after or math.nan))
    return rows

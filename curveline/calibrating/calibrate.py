"""From trials of several shapes to the numbers of their display."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import replace

import numpy as np

from curveline.calibrating.calibrated import RodCalibration, ShapeRow
from curveline.calibrating.descent import Fitted, SoughtNumbers, fitted
from curveline.calibrating.intervals import Uncertainty, uncertainty_of
from curveline.calibrating.misfit import likely
from curveline.calibrating.next_shape import next_of
from curveline.calibrating.request import AUTO, FITTED, CalibrationRequest
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
SOFT = mm(20.0)
"""What bearings give where the search begins again that left trials far off."""
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
    with listener.progress("calibrating", 2) as heard:
        best, sorting = _best(trials, asked, None, is_leaning=asked.asymmetry == FITTED)
        heard(1)
        if asked.asymmetry == AUTO and (leaning := _leaning(trials, asked, best.numbers)) is not None:
            best, sorting = leaning
        uncertainty = uncertainty_of(best)
        found = _calibration(display, asked, best, (sorting, uncertainty))
        found = found.with_next(next_of(best, uncertainty, asked.candidates))
        heard(2)
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


def _best(
    trials: Sequence[ShapeTrials], asked: CalibrationRequest, begin: Array | None, *, is_leaning: bool
) -> tuple[Fitted, Sorted]:
    """The best fit, from some numbers or, with None, from several starts; the rod may bend harder to one side."""
    best: tuple[Fitted, Sorted] | None = None
    for start in [begin] if begin is not None else _starts(trials[0].scene.display):
        found = _from(trials, asked, start, is_leaning=is_leaning)
        if found is not None and (best is None or _rank(found) < _rank(best)):
            best = found
        if best is not None and not best[1].left and best[0].misfit.rms < FAR:
            break
    if best is None:
        hint = "`curveline compare` says how far each trial is from the states of its shape"
        raise Infeasible("the trials show none of the states that these shapes have", hint)
    return best


def _starts(display: Display) -> Iterator[Array]:
    """Numbers to begin with: as the file has them, and with softer bearings."""
    numbers = Unknowns(display.node_count).of_display(display)
    yield numbers
    softer = numbers.copy()
    softer[1] = SOFT
    yield softer


def _rank(found: tuple[Fitted, Sorted]) -> tuple[int, float]:
    return len(found[1].left), found[0].misfit.rms


def _from(
    trials: Sequence[ShapeTrials], asked: CalibrationRequest, numbers: Array, *, is_leaning: bool
) -> tuple[Fitted, Sorted] | None:
    """The fit from one start, with what states its curves are in there; None if it leads nowhere."""
    display = trials[0].scene.display
    best: tuple[Fitted, Sorted] | None = None
    for _ in range(ROUNDS):
        sorting = sorted_by_state(trials, Unknowns(display.node_count), numbers)
        if best is not None and _same(best[1], sorting):
            break
        if len({segment.shape for segment in sorting.seen}) < LEAST_SHAPES:
            return None
        found = fitted(_sought(sorting, asked, display, is_leaning=is_leaning), numbers, sorting.held)
        if found is None:
            return None
        best, numbers = (found, sorting), found.numbers
    return best


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


def _leaning(trials: Sequence[ShapeTrials], asked: CalibrationRequest, numbers: Array) -> tuple[Fitted, Sorted] | None:
    """The fit with a rod that bends harder to one side, from numbers without that, if the trials tell it."""
    leaning, sorting = _best(trials, asked, numbers, is_leaning=True)
    (place,) = (number for number, each in enumerate(leaning.sought.unknowns.all) if each.kind == ASYMMETRY)
    size = abs(float(leaning.numbers[place]))
    reach = uncertainty_of(leaning).reach[int(np.sum(leaning.sought.free[:place]))]
    return (leaning, sorting) if size > max(CLEARLY * float(reach), LITTLE) else None


def _calibration(
    display: Display, asked: CalibrationRequest, best: Fitted, others: tuple[Sorted, Uncertainty]
) -> RodCalibration:
    sorting, uncertainty = others
    estimates = estimates_of(best, uncertainty)
    return RodCalibration(
        display=display,
        calibrated=calibrated_display(display, best.sought.unknowns, best.numbers),
        estimates=estimates,
        rows=tuple(_rows(best, display)),
        left=sorting.left,
        next_shape=None,
        request=asked,
        rms=best.misfit.rms,
        has_asymmetry=any(each.kind == ASYMMETRY for each in estimates),
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

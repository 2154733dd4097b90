"""Which shape to measure next: the one that would tell most of the number that is known least."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from curveline.calibrating.bent_rod import BentSegment, states_of
from curveline.calibrating.calibrated import NAMES, NextShape
from curveline.calibrating.descent import Fitted, SoughtNumbers, information
from curveline.calibrating.intervals import Uncertainty, expected_reach
from curveline.calibrating.misfit import SeenSegment, as_seen, misfit_at, resampled
from curveline.calibrating.telling import good_of
from curveline.errors import CurvelineError
from curveline.scene import Scene
from curveline.shapes.files import read_shape
from curveline.shapes.library import builtin_shapes
from curveline.trial import Array

MOST = 3
"""Shapes that are named together."""
ENOUGH = 0.9
"""Part of an interval: a shape by which it shrinks to that is enough."""
TRIALS = 3
"""Of a shape, if the others have no more."""
OF_CAMERA = 4
"""Numbers at the end that are no display's."""


def next_of(fit: Fitted, uncertainty: Uncertainty, candidates: Sequence[Scene]) -> NextShape | None:
    """The shape that would tell most, or several; None if there is none that has not been measured.

    One that alone tells of a number is not borne out by any other, so that an interval grouped by shape may even grow:
    then more of them are named.
    """
    place = _least_known(fit, uncertainty)
    others = {scene.name: _told_by(fit, scene) for scene in _others(fit.sought, candidates)}
    told = {name: found for name, found in others.items() if found is not None}
    unknown = fit.sought.unknowns.all[int(np.flatnonzero(fit.sought.free)[place])]
    by_shape = uncertainty.by_shape
    names: tuple[str, ...] = ()
    now = expected_reach(by_shape, uncertainty.sure)[place]
    best: NextShape | None = None
    while told and len(names) < MOST and (best is None or best.share > ENOUGH):
        whole = by_shape.sum(axis=0) + uncertainty.sure
        name = min(told, key=lambda name: np.linalg.inv(whole + TRIALS * told[name])[place, place])
        names, by_shape = (*names, name), np.concatenate([by_shape, TRIALS * told.pop(name)[None]])
        share = float(expected_reach(by_shape, uncertainty.sure)[place] / now)
        if best is None or share < best.share:
            best = NextShape(tuple(sorted(names)), NAMES[unknown.kind].format(unknown.number + 1), share)
    return best


def _least_known(fit: Fitted, uncertainty: Uncertainty) -> int:
    """Which of the free numbers of the display is known least for what it is used for."""
    free = np.flatnonzero(fit.sought.free)
    need = [
        reach / max(good_of(fit.sought.unknowns.all[number].kind, float(fit.numbers[number])), 1e-9)
        for number, reach in zip(free.tolist(), uncertainty.reach.tolist(), strict=True)
    ]
    return int(np.argmax(need[:-OF_CAMERA]))


def _others(sought: SoughtNumbers, candidates: Sequence[Scene]) -> Iterator[Scene]:
    """The candidates, and the built-in shapes of the same nodes, that have not been measured."""
    like = sought.seen[0].bent.scene.display
    measured = {(segment.bent.scene.nodes, segment.bent.scene.segments) for segment in sought.seen}
    for scene in (*candidates, *_built_in()):
        display = scene.display
        fits = display.node_count == like.node_count and display.span == like.span
        if fits and not scene.beyond_the_plane and not scene.loads and (scene.nodes, scene.segments) not in measured:
            yield scene


def _built_in() -> Iterator[Scene]:
    for name in builtin_shapes():
        try:
            yield read_shape(name)
        except CurvelineError:
            continue


def _told_by(fit: Fitted, scene: Scene) -> Array | None:
    """What one trial of a shape would tell of the free numbers (p, p); None if it has not the states it asks for."""
    unknowns, display = fit.sought.unknowns, fit.sought.seen[0].bent.scene.display
    seen, held = [], []
    for index, segment in enumerate(scene.segments):
        bent = BentSegment(Scene(scene.name, display, scene.nodes, scene.segments), index, unknowns)
        state = states_of(bent, fit.numbers).get(segment.state)
        if state is None:
            return None
        points = resampled(as_seen(unknowns, fit.numbers, state.points[1:-1])[0])
        seen.append(SeenSegment(bent, 0, segment.state, (points,)))
        held.append(state)
    found = misfit_at(seen, fit.numbers, held, sloped=True)
    if found is None:
        return None
    told, _ = information(fit.sought, found)
    return np.asarray(told.sum(axis=0))

"""The curvature of which a plastic rod keeps a part: that of the states in which it was, laid along its material."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from curveline.rod.clamped_rod import ClampedRod
from curveline.rod.geometry.vertex_table import CURVATURE
from curveline.rod.models.showable import showable_states
from curveline.rod.natural_curvature import NaturalCurvature, curvatures_at
from curveline.rod.problem import Array
from curveline.rod.states.slack import is_slack
from curveline.scene import Profile, Rod
from curveline.simulation.simulate import DEFAULT_TOLERANCE
from curveline.units import mm

POINTS = 49
"""Of each segment, equally spaced along the free rod, at which the curvature is taken."""
BESIDE = mm(1.0)
"""From the free rod to where a bearing has kept it straight."""


def kept_curvature(held: Sequence[tuple[ClampedRod, str]]) -> Profile | None:
    """The curvature away from the natural one that a rod has in states of its segments, left to right.

    Each is named with the rod of its segment, whose pose says which material it holds. None if there are no such
    states: the rod was straight.
    """
    places, values = [np.array([-np.inf])], [np.zeros(1)]
    for rod, name in held:
        state = showable_states(rod, DEFAULT_TOLERANCE).called(name) if is_slack(rod) else None
        if state is None:
            continue
        begin = rod.pose.begin + 0.5 * rod.clamp
        along = np.linspace(0.0, rod.free_length, POINTS)
        at_vertices = np.concatenate([[0.0], np.cumsum(state.edges)]) * rod.free_length / np.sum(state.edges)
        curved = np.interp(along, at_vertices, state.vertices_table[:, CURVATURE]) - rod.natural_curvature
        if rod.is_unevenly_curved:
            curved -= curvatures_at(rod.bearing.profile, begin + along)
        if begin - places[-1][-1] > 2.0 * BESIDE:
            places.append(np.array([begin - BESIDE]))
            values.append(np.zeros(1))
        # Short bearings leave no room for what is straight between two segments.
        fresh = begin + along > places[-1][-1]
        places += [(begin + along)[fresh], np.array([begin + along[-1] + BESIDE])]
        values += [curved[fresh], np.zeros(1)]
    if len(places) == 1:
        return None
    return Profile(tuple(np.concatenate(places[1:]).tolist()), tuple(np.concatenate(values[1:]).tolist()))


def with_kept(rod: Rod, kept: Profile, share: float) -> Rod:
    """The rod when it has kept a `share` of a curvature, beside what its natural curvature is."""
    more = NaturalCurvature(np.array(kept.places), share * np.array(kept.values))
    if rod.profile is None:
        return replace(rod, profile=Profile(kept.places, tuple(more.values.tolist())))
    own = NaturalCurvature(np.array(rod.profile.places), np.array(rod.profile.values))
    places: Array = np.union1d(own.places, more.places)
    return replace(rod, profile=Profile(tuple(places.tolist()), tuple((own(places) + more(places)).tolist())))

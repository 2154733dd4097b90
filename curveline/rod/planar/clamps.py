"""Kernels of clamps that give: a bearing tilts about its pivot under a moment, against a spring, after some play.

The bearing is a straight link of the length `reach` from the pivot to its mouth, where the rod is clamped to it. Its
angle alpha is no unknown, as the axial strains are none: it is what makes the Lagrangian stationary for given angles of
the edges and multipliers,

    (alpha - phi +- rest) stiffness + U'(alpha - theta) +- natural + across cos alpha - along sin alpha = 0

with theta the angle that the motor holds, U the spring's energy, phi, `stiffness` and rest those of the edge and half
cell at the mouth, and along, across what loads and multipliers do to the link. Put in, it leaves a softer end, one
whose constraints yield.
"""

from __future__ import annotations

import numpy as np

from curveline.kernels.kernel import leaf
from curveline.rod.problem import GIVE, LIFT, NATURAL, PLAY, PUSH, REACH, gives
from curveline.rod.profile import TURN

LOOSE = 1e-6
"""Stiffness [EI/L] against a tilt within the play: of none at both ends, edges without forces would turn at no cost."""
TURNS = 30
"""Most steps of Newton's for the angle of a link."""
CLOSE = 1e-15
"""The last step's size [rad]."""


@leaf
def spring(clamps, tilt):
    """Moment of a bearing that is tilted by `tilt` [rad], and its slope; next to none within its play."""
    beyond = abs(tilt) - clamps[PLAY]
    if beyond <= 0.0 or clamps[GIVE] == 0.0:
        return LOOSE * tilt, LOOSE
    return LOOSE * tilt + np.copysign(beyond, tilt) / clamps[GIVE], LOOSE + 1.0 / clamps[GIVE]


@leaf
def spring_energy(clamps, tilt):
    """Energy of the spring of a bearing that is tilted by `tilt` [rad]."""
    beyond = max(abs(tilt) - clamps[PLAY], 0.0)
    strained = 0.5 * LOOSE * tilt * tilt
    if clamps[GIVE] > 0.0:
        strained += 0.5 * beyond * beyond / clamps[GIVE]
    return strained


@leaf
def pulls(problem, multipliers, side):
    """What loads and multipliers do to the link of a `side`: coefficients of its cosine and of its sine."""
    clamps = problem.clamps
    reach = clamps[REACH]
    # The loads hang on the first link alone: what turns the last one moves no rod.
    share = 1.0 - side
    return share * clamps[PUSH] + reach * multipliers[0], share * clamps[LIFT] + reach * multipliers[1]


@leaf
def link(problem, phi, multipliers, side):
    """Angle [rad] of the link of a `side`, 0 the first and 1 the last, and how far it yields to a moment.

    That is one over the second derivative of the Lagrangian by it, 0 for a clamp that does not give.
    """
    rest = problem.ends[side]
    if not gives(problem):
        return rest, 0.0
    n = phi.size
    clamps, stiffness = problem.clamps, problem.stiffness[side * n]
    edge = phi[side * (n - 1)] - (1.0 - 2.0 * side) * problem.rest[TURN, side * n]
    along, across = pulls(problem, multipliers, side)
    natural = (1.0 - 2.0 * side) * clamps[NATURAL]
    angle = rest
    yields = 0.0
    for _ in range(TURNS):
        cosine, sine = np.cos(angle), np.sin(angle)
        moment, slope = spring(clamps, angle - rest)
        yields = 1.0 / (stiffness + slope - along * cosine - across * sine)
        step = -((angle - edge) * stiffness + moment + natural + across * cosine - along * sine) * yields
        angle += step
        if abs(step) < CLOSE:
            break
    tilt = angle - rest
    if clamps[GIVE] == 0.0 and abs(tilt) > clamps[PLAY]:
        return rest + np.copysign(clamps[PLAY], tilt), 0.0
    return angle, yields


@leaf
def mouth_shift(problem, angle, side):
    """By what the mouth of a `side` moves as its link goes to an `angle` from where the motor holds it: x, y."""
    rest, reach = problem.ends[side], problem.clamps[REACH]
    return reach * (np.cos(angle) - np.cos(rest)), reach * (np.sin(angle) - np.sin(rest))


@leaf
def link_energies(problem, angle, side):
    """Energy of the spring of a `side` whose link has an `angle`, with the natural curvature's; that of the loads."""
    clamps = problem.clamps
    tilt = angle - problem.ends[side]
    x, y = mouth_shift(problem, angle, side)
    share = 1.0 - side
    # The loads' coefficients hold the link's length already, as the shift does.
    inverse = share / clamps[REACH] if clamps[REACH] > 0.0 else 0.0
    potential = (clamps[PUSH] * x + clamps[LIFT] * y) * inverse
    return spring_energy(clamps, tilt) + (1.0 - 2.0 * side) * clamps[NATURAL] * tilt, potential

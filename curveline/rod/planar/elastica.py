"""Closed forms of Euler's elastica, the exact answers that tests and `curveline bench` hold the rod against.

An inextensible rod without weight whose bending moment is linear in its position. Under a thrust P the angle psi
between the rod and the line of thrust obeys EI psi'' = -P sin psi, whose solutions with inflection points are

    sin(psi / 2) = k sn(u, k),    u = begin + s sqrt(P / EI)

(Love 1927, A Treatise on the Mathematical Theory of Elasticity, sections 262 and 263). Everything is in SI, the rod
begins at the origin, and forces and moments are those of the clamps on the rod, as in `equilibrium.Equilibrium`.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from scipy.optimize import brentq
from scipy.special import ellipe, ellipj, ellipk, elliprd, elliprf

from curveline.rod.problem import Array


@dataclass(frozen=True)
class Inflectional:
    """A piece of an elastica with inflection points under a thrust along -x, from u = `begin` to u = `end`.

    The `modulus` k is the sine of half the largest angle; a quarter period K(k) of u leads from a point where the rod
    is parallel to the thrust to an inflection point.
    """

    modulus: float
    begin: float
    end: float
    length: float  # [m]
    stiffness: float  # EI [N m^2]

    @property
    def rate(self) -> float:
        """Growth of u along the rod, sqrt(P / EI) [1/m]."""
        return (self.end - self.begin) / self.length

    @property
    def thrust(self) -> float:
        """P [N], with which the clamps press the rod together."""
        return self.stiffness * self.rate**2

    @property
    def clamp_force(self) -> Array:
        """Forces (2, 2) [N]."""
        return np.array([[self.thrust, 0.0], [-self.thrust, 0.0]])

    @property
    def clamp_moment(self) -> Array:
        """Moments (2,) [N m]."""
        return self.stiffness * self.curvature(np.array([0.0, self.length])) * np.array([-1.0, 1.0])

    @property
    def energy(self) -> float:
        """Bending energy [J]: EI / 2 times the integral of the squared curvature."""
        m = self.modulus**2
        edge = _second_kind(np.array([self.begin, self.end]), m)
        return float(2.0 * self.stiffness * self.rate * (edge[1] - edge[0] - (1.0 - m) * (self.end - self.begin)))

    def angles(self, places: Array) -> Array:
        """Tangent angles [rad] at the arc lengths `places (n,)`."""
        return 2.0 * np.arcsin(self.modulus * ellipj(self._u(places), self.modulus**2)[0])

    def curvature(self, places: Array) -> Array:
        """Curvature [1/m] at the arc lengths `places (n,)`."""
        return 2.0 * self.modulus * self.rate * ellipj(self._u(places), self.modulus**2)[1]

    def positions(self, places: Array) -> Array:
        """Positions (n, 2) [m] at the arc lengths `places (n,)`."""
        m = self.modulus**2
        u = np.concatenate([[self.begin], self._u(places)])
        along = 2.0 * _second_kind(u, m) - u
        across = -2.0 * self.modulus * ellipj(u, m)[1]
        return np.column_stack([along[1:] - along[0], across[1:] - across[0]]) / self.rate

    def _u(self, places: Array) -> Array:
        return self.begin + self.rate * np.asarray(places, dtype=float)


@dataclass(frozen=True)
class Arc:
    """A circular arc between clamps at the angles `angle` and -`angle`: an equilibrium under end moments alone."""

    angle: float  # [rad], less than pi
    length: float  # [m]
    stiffness: float  # EI [N m^2]

    @property
    def bend(self) -> float:
        """The constant curvature [1/m]."""
        return -2.0 * self.angle / self.length

    @property
    def clamp_force(self) -> Array:
        """Forces (2, 2) [N]: none."""
        return np.zeros((2, 2))

    @property
    def clamp_moment(self) -> Array:
        """Moments (2,) [N m]."""
        return self.stiffness * self.bend * np.array([-1.0, 1.0])

    @property
    def energy(self) -> float:
        """Bending energy [J]."""
        return 0.5 * self.stiffness * self.bend**2 * self.length

    def angles(self, places: Array) -> Array:
        """Tangent angles [rad] at the arc lengths `places (n,)`."""
        return self.angle + self.bend * np.asarray(places, dtype=float)

    def curvature(self, places: Array) -> Array:
        """Curvature [1/m] at the arc lengths `places (n,)`."""
        return np.full(np.shape(places), self.bend)

    def positions(self, places: Array) -> Array:
        """Positions (n, 2) [m] at the arc lengths `places (n,)`; the chord lies along +x."""
        half = 0.5 * self.bend * np.asarray(places, dtype=float)
        reach = np.asarray(places, dtype=float) * np.sinc(half / math.pi)
        return np.column_stack([reach * np.cos(self.angle + half), reach * np.sin(self.angle + half)])


def clamped_arch(chord: float, length: float, stiffness: float) -> Inflectional:
    """First buckled mode between clamps at 0 deg, `chord` apart: the peak, whose mirror image is the valley.

    chord / length = 2 E / K - 1 fixes the modulus (Love 1927, section 263). Raises ValueError unless the rod is longer
    than the chord.
    """
    if not 0.0 <= chord < length:
        raise ValueError(f"a rod of {length:g} m does not arch over a chord of {chord:g} m")

    def excess(m: float) -> float:
        return float(2.0 * ellipe(m) / ellipk(m) - 1.0 - chord / length)

    m = float(brentq(excess, 0.0, 1.0 - 1e-12, xtol=1e-16, rtol=1e-15))
    return Inflectional(math.sqrt(m), 0.0, 4.0 * float(ellipk(m)), length, stiffness)


def rectangular(length: float, stiffness: float) -> Inflectional:
    """Euler's rectangular elastica (Bernoulli's): clamps at 90 and -90 deg that carry no moment."""
    quarter = float(ellipk(0.5))
    return Inflectional(math.sqrt(0.5), quarter, 3.0 * quarter, length, stiffness)


def _second_kind(u: Array, m: float) -> Array:
    """Jacobi's epsilon function at `u (n,)`: the integral of dn^2 from 0 to u.

    Carlson's symmetric integrals (DLMF 22.16.32 and 19.25.9), because `scipy.special.ellipeinc` is wrong by several
    percent at isolated points (scipy 1.17).
    """
    half_periods = np.round(u / (2.0 * ellipk(m)))
    sn, cn, dn, _ = ellipj(u - 2.0 * half_periods * ellipk(m), m)
    within = sn * elliprf(cn**2, dn**2, 1.0) - m / 3.0 * sn**3 * elliprd(cn**2, dn**2, 1.0)
    integral: Array = 2.0 * half_periods * ellipe(m) + within
    return integral

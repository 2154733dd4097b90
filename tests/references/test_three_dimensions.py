"""Section D of the reference values: rods in space. Also what of sections A and B the spatial rod must reproduce."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np
import pytest
from scipy.interpolate import CubicSpline
from scipy.optimize import brentq

from curveline.rod.geometry.rotations import multiply
from curveline.rod.problem import Array
from curveline.rod.spatial.energy import Shape, SpatialRod, moments, positions, relative
from curveline.rod.spatial.lifting import frame
from curveline.rod.spatial.relax import Relaxed, RelaxEnding, descend, is_stable, lowest_mode, lowest_modes, newton
from curveline.rod.spatial.terms import twist
from curveline.rod.spatial.twisting import spun, total_twist, twisted

from .report import Report

STIFF = 1e8
"""EA L^2 / EI of a rod that hardly stretches."""


def rod_of(
    n: int, stiffness: tuple[float, float, float], held: tuple[float, float, float] = (1.0, 1.0, 1.0)
) -> SpatialRod:
    """A straight rod along x on n edges with bending stiffness about m1 (in z) and m2 (in y), and in twist."""
    return SpatialRod(
        np.full(n, 1.0 / n),
        np.array([*stiffness, STIFF * max(stiffness)]),
        np.zeros((n + 1, 3)),
        np.zeros((n + 1, 3)),
        np.array([1.0, 0.0, 0.0]),
        np.array([frame(0.0), frame(0.0)]),
        np.array(held),
    )


def bent(n: int, angle: Callable[[Array], Array]) -> Shape:
    """The planar shape on n edges whose tangent has the `angle` of the arc length in the middle of an edge."""
    return Shape(np.zeros(n), np.array([frame(each) for each in angle((np.arange(n) + 0.5) / n)]))


def settled(relaxed: Relaxed) -> Shape:
    assert relaxed.ending is RelaxEnding.SETTLED
    return relaxed.shape


def limit(level: Callable[[int], Array | float], n: int) -> Array:
    """What `level` of n, 2 n and 4 n edges tends to, for errors of orders 2 and 4."""
    coarse, middle, fine = (np.asarray(level(n << k), dtype=float) for k in range(3))
    first, second = middle + (middle - coarse) / 3.0, fine + (fine - middle) / 3.0
    return np.asarray(second + (second - first) / 15.0)


def lowest_that_costs(rod: SpatialRod, shape: Shape) -> float:
    """The smallest eigenvalue of the second variation but for that of the motion that costs nothing.

    A round rod's ring or arch turns freely about the line through its clamps.
    """
    values, _ = lowest_modes(rod, shape, 3)
    return float(np.delete(values, np.argmin(np.abs(values)))[0])


def vertex_twists(rod: SpatialRod, shape: Shape) -> Array:
    """Twist (n+1,) [rad] of the vertices."""
    out, single, q = np.empty(rod.edges.size + 1), np.empty(4), np.empty(4)
    for i in range(out.size):
        relative(rod, shape, i, single, q)
        out[i] = twist.angle(q)
    return out


def root(function: Callable[[float], float], low: float, high: float) -> float:
    return float(brentq(function, low, high, xtol=1e-10 * high, rtol=1e-12))


@pytest.mark.parametrize("twisting", [0.7, 1.0, 1.4])
def test_a_twisted_ring_buckles(against: Report, twisting: float) -> None:
    parameters = np.linspace(1.3, 1.7, 6)

    def lowest(n: int) -> Array:
        rod = rod_of(n, (1.0, 1.0, twisting))._replace(chord=np.zeros(3))
        ring, values = bent(n, lambda s: 2.0 * math.pi * s), []
        for angle in 2.0 * math.pi * parameters / twisting:
            turned, start = twisted(rod, ring, angle)
            state = settled(newton(turned, start))
            assert total_twist(turned, state) == pytest.approx(angle, abs=0.3)
            values.append(lowest_that_costs(turned, state))
        return np.array(values)

    # Seen from below: the clamp is a small imperfection, so that no ring of straight edges is there at the bifurcation.
    eigenvalues = limit(lowest, 48)
    roots = np.polynomial.Polynomial.fit(parameters, eigenvalues, 5).roots()
    critical = float(min(roots[np.abs(roots.imag) < 1e-9].real, key=lambda each: abs(each - parameters[-1])))
    against("D twisted ring", critical, math.sqrt(3.0), within=1e-5)


@pytest.mark.parametrize(
    ("tension", "moment"), [(0.0, 8.986818916), (10.0, 10.42885648), (50.0, 15.58932390), (-20.0, 5.771135634)]
)
def test_a_twisted_clamped_rod_buckles(against: Report, tension: float, moment: float) -> None:
    def critical(n: int) -> float:
        straight = rod_of(n, (1.0, 1.0, 0.8))
        strain = tension / straight.stiffness[3]
        straight = straight._replace(chord=np.array([1.0 + strain, 0.0, 0.0]))
        shape = bent(n, lambda s: 0.0 * s)._replace(strain=np.full(n, strain))

        def lowest(torque: float) -> float:
            return lowest_mode(*twisted(straight, shape, torque / 0.8))[0]

        return root(lowest, 0.5 * moment, 1.2 * moment)

    against("D clamped rod with torque and tension", limit(critical, 60), moment, within=1e-6)


LOADS_45 = {
    300.0: (58.7797, 22.2450, 40.1883),
    450.0: (52.2393, 18.5085, 48.4980),
    600.0: (47.1513, 15.6851, 53.4686),
}


@pytest.mark.parametrize("load", LOADS_45)
def test_the_bend_of_45_degrees(against: Report, load: float) -> None:
    radius, bending = 100.0, 1e7 / 12.0
    length = radius * math.pi / 4.0

    def tip(n: int) -> Array:
        rod = rod_of(n, (1.0, 1.0, 1.0), (1.0, 0.0, 0.0))
        rod.forces[n, 2] = load * length**2 / bending
        rod = rod._replace(natural=np.tile([0.0, length / radius, 0.0], (n + 1, 1)))
        state = settled(descend(rod, bent(n, lambda s: s * length / radius)))
        return np.asarray(positions(rod, state)[n] * length)

    ours = limit(tip, 16)
    against("D bend of 45 degrees, tip", ours, LOADS_45[load], within=1e-4, scale=length)
    if load == 600.0:
        moved = ours - [radius * math.sin(math.pi / 4), radius * (1.0 - math.cos(math.pi / 4)), 0.0]
        against("D bend of 45 degrees, ours", moved, (-23.5594, -13.6042, 53.4686), within=1e-6, scale=length)
        size = float(np.linalg.norm(moved))
        against("D bend of 45 degrees, Bathe and Bolourchi 1979", moved, (-23.5, -13.4, 53.4), 0.005, size)
        against("D bend of 45 degrees, Simo and Vu-Quoc 1986", moved, (-23.48, -13.50, 53.37), 0.005, size)


@pytest.mark.parametrize(("load", "value"), [("tip", 4.012599344), ("weight", 12.85376332)])
def test_a_strip_buckles_sideways(against: Report, load: str, value: float) -> None:
    twisting = 0.4

    def critical(n: int) -> float:
        rod = rod_of(n, (1.0, 1e7, twisting), (1.0, 0.0, 0.0))
        share = np.zeros(n + 1)
        if load == "tip":
            share[n] = 1.0
        else:
            share[:-1] += 0.5 / n
            share[1:] += 0.5 / n

        def lowest(parameter: float) -> float:
            forces = np.zeros((n + 1, 3))
            forces[:, 1] = -share * parameter * math.sqrt(twisting)
            loaded = rod._replace(forces=forces)
            return lowest_mode(loaded, settled(newton(loaded, bent(n, lambda s: 0.0 * s))))[0]

        return root(lowest, 0.8 * value, 1.2 * value)

    against(f"D strip under its {load}", limit(critical, 40), value, within=1e-6)


@pytest.mark.parametrize(("twisting", "reach"), [(2 / 3, 0.4573269026), (0.75, 0.4284774434), (1.0, 1 / 3)])
def test_an_arch_leaves_its_plane(against: Report, twisting: float, reach: float) -> None:
    def critical(n: int) -> float:
        def lowest(chord: float) -> float:
            rod = rod_of(n, (1.0, 1.0, twisting))._replace(chord=np.array([chord, 0.0, 0.0]))
            start = bent(n, lambda s: 1.9 * np.sin(2.0 * math.pi * s))
            return lowest_that_costs(rod, settled(newton(rod, start)))

        return root(lowest, reach - 0.05, reach + 0.1)

    against("D arch leaves its plane", limit(critical, 32), reach, within=1e-5)


class Buckle:
    """Coyne's localised helix of amplitude `peak` [rad] in the middle of a long rod with EI = 1 under a torque."""

    def __init__(self, peak: float, torque: float, twisting: float) -> None:
        self.peak, self.torque, self.twisting = peak, torque, twisting
        self.tension = torque**2 / (2.0 * (1.0 + math.cos(peak)))
        self.width = 2.0 / torque * math.sqrt((1.0 + math.cos(peak)) / (1.0 - math.cos(peak)))

    def cosine(self, s: Array) -> Array:
        """Cosine (..) of the angle to the axis at `s` from the middle."""
        cosine = math.cos(self.peak)
        return np.asarray(cosine + (1.0 - cosine) * np.tanh(s / self.width) ** 2)

    @property
    def shortening(self) -> float:
        return 2.0 * self.width * (1.0 - math.cos(self.peak))

    @property
    def rotation(self) -> float:
        """Of one end against the other, the twist and what the helix winds."""
        return self.torque / self.twisting + 2.0 * self.peak

    def start(self, n: int) -> tuple[SpatialRod, Shape]:
        """The rod on n edges between its ends, and a shape of the right winding, but too wide."""
        s = (np.arange(n) + 0.5) / n - 0.5
        cosine = self.cosine(s / 1.1)
        azimuth = np.cumsum(self.torque / (1.0 + cosine)) / n
        azimuth -= 0.5 * (azimuth[n // 2 - 1] + azimuth[n // 2])
        sine = np.sqrt(1.0 - cosine**2)
        tangents = np.column_stack([cosine, sine * np.cos(azimuth), sine * np.sin(azimuth)])
        frames = np.empty((n, 4))
        before, here = frame(0.0), np.array([1.0, 0.0, 0.0])
        for j in range(n):
            # Carried from edge to edge in parallel, then spun by the twist.
            carried = np.array([1.0 + here @ tangents[j], *np.cross(here, tangents[j])])
            multiply(carried / np.linalg.norm(carried), before, frames[j])
            frames[j] = spun(frames[j], self.torque / self.twisting / n * (1.0 if j else 0.5))
            before, here = frames[j], tangents[j]
        rod = rod_of(n, (1.0, 1.0, self.twisting))
        strain = self.tension * cosine / rod.stiffness[3]
        ends = np.array([frame(0.0), frame(0.0, 0.0, self.rotation)])
        chord = np.array([1.0 - self.shortening + self.tension / rod.stiffness[3], 0.0, 0.0])
        return rod._replace(chord=chord, frames=ends), Shape(strain, frames)


def test_a_long_rod_buckles_into_a_local_helix(against: Report) -> None:
    buckle = Buckle(peak=math.pi / 3.0, torque=80.0, twisting=0.8)
    places = np.linspace(-0.3, 0.3, 61)

    def envelope(n: int) -> Array:
        rod, start = buckle.start(n)
        relaxed = descend(rod, start)
        shape = settled(relaxed)
        edges = np.diff(positions(rod, shape), axis=0)
        cosine = CubicSpline((np.arange(n) + 0.5) / n, edges[:, 0] / np.linalg.norm(edges, axis=1))
        # The helix may sit anywhere: its energy does not change until it feels an end.
        middle = min(cosine.derivative().roots(extrapolate=False), key=cosine)
        twists = CubicSpline(np.arange(n + 1) / n, vertex_twists(rod, shape) * n)(middle + places)
        cosine = cosine(middle + places)
        return np.array([cosine, twists, np.full(places.size, rod.stiffness[3] * shape.strain[0])])

    cosine, twists, tension = limit(envelope, 200)
    low = math.cos(buckle.peak)
    against("D local helix, envelope", (cosine - low) / (1.0 - low), np.tanh(places / buckle.width) ** 2, 1e-4, 1.0)
    against("D local helix, twist is uniform", twists * buckle.twisting, buckle.torque, within=1e-4)
    against("D local helix, tension", tension, buckle.tension, within=1e-4)


def test_a_cantilever_rolls_up(against: Report) -> None:
    def moment(n: int) -> Array:
        # Softer in twist or sideways, it would rather twist once than bend through a full turn.
        rod = rod_of(n, (3.0, 1.0, 2.0), (1.0, 0.0, 1.0))
        rod = rod._replace(frames=np.array([frame(0.0), frame(2.0 * math.pi)]))
        state = settled(descend(rod, bent(n, lambda s: 2.0 * math.pi * s + 0.3 * np.sin(2.0 * math.pi * s))))
        assert np.max(np.abs(positions(rod, state)[n])) < 1e-9
        return np.asarray(moments(rod, state)[1])

    against("A pure moment roll-up, in space", limit(moment, 40), [0.0, 0.0, 2.0 * math.pi], 1e-6, scale=2.0 * math.pi)


TIP_LOADS = {
    1.0: (0.4613519497, 0.3017207738, 0.0564332363),
    2.0: (0.7817498316, 0.4934574804, 0.1606417208),
    5.0: (1.215368118, 0.7137915236, 0.3876283607),
    10.0: (1.430285539, 0.8106090249, 0.5549955978),
}


@pytest.mark.parametrize("load", TIP_LOADS)
def test_a_cantilever_bends_under_its_tip_load_in_any_plane(against: Report, load: float) -> None:
    _, drop, shortening = TIP_LOADS[load]
    way = np.array([0.0, 0.6, -0.8])

    def tip(n: int) -> Array:
        rod = rod_of(n, (1.0, 1.0, 0.5), (1.0, 0.0, 0.0))
        rod.forces[n] = load * way
        x, *aside = positions(rod, settled(descend(rod, bent(n, lambda s: 0.0 * s))))[n]
        return np.array([np.dot(way[1:], aside), 1.0 - x])

    against("B cantilever under a tip load, in space", limit(tip, 24), (drop, shortening), within=1e-6)


@pytest.mark.parametrize(
    ("ends", "load"),
    [
        ((1.0, 0.0, 0.0), math.pi**2 / 4.0),
        ((0.0, 1.0, 0.0), math.pi**2),
        ((1.0, 1.0, 0.0), 20.19072856),
        ((1.0, 1.0, 1.0), 4.0 * math.pi**2),
    ],
)
def test_columns_buckle_under_eulers_loads(against: Report, ends: tuple[float, float, float], load: float) -> None:
    def critical(n: int) -> float:
        def lowest(thrust: float) -> float:
            # The softer way is out of the plane.
            rod = rod_of(n, (1.0, 3.0, 0.5), ends)
            strain = -thrust / rod.stiffness[3]
            rod.forces[n, 0] = 0.0 if ends[1] else -thrust
            rod = rod._replace(chord=np.array([1.0 + strain, 0.0, 0.0]))
            shape = bent(n, lambda s: 0.0 * s)._replace(strain=np.full(n, strain))
            # A rod that is pinned at both ends spins freely about itself.
            return lowest_that_costs(rod, shape) if ends[0] == 0.0 else lowest_mode(rod, shape)[0]

        return root(lowest, 0.7 * load, 1.3 * load)

    against("A Euler loads, in space", limit(critical, 32), load, within=1e-6)


def test_a_heavy_column_buckles_under_greenhills_weight(against: Report) -> None:
    def critical(n: int) -> float:
        def lowest(weight: float) -> float:
            rod = rod_of(n, (1.0, 1.0, 0.5), (1.0, 0.0, 0.0))
            rod.forces[:-1, 0] -= 0.5 * weight / n
            rod.forces[1:, 0] -= 0.5 * weight / n
            shape = settled(newton(rod, bent(n, lambda s: 0.0 * s)))
            value = lowest_mode(rod, shape)[0]
            assert abs(value) < 1e-5 or is_stable(rod, shape) == (value > 0.0)
            return value

        return root(lowest, 6.0, 10.0)

    against("B heavy column, in space", limit(critical, 32), 7.837347439, within=1e-6)

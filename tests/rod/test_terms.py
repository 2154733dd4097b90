"""Every energy term of the spatial rod by itself: slope and Hessian against differences, energy against the books."""

from __future__ import annotations

import numpy as np
import pytest

from curveline.rod.problem import Array
from curveline.rod.spatial.blocks import along_rotations
from curveline.rod.spatial.energy import Shape, SpatialRod, assemble, energy, inner_slopes
from curveline.rod.spatial.terms import bend, twist

from .spatial_rods import (
    between_vectors,
    dense,
    matrix,
    quaternion,
    random_rod,
    straight_move,
    turned,
    vertex_positions,
)

TERMS = {"bend m1": 0, "bend m2": 1, "twist": 2, "stretch": 3, "loads": 4}
SEEDS = (1, 2, 3)


def single_term(term: str, seed: int) -> tuple[SpatialRod, Shape]:
    """A random rod with nothing but one term."""
    stiffness = np.zeros(4)
    if TERMS[term] < 4:
        stiffness[TERMS[term]] = 1.7
    rod, shape = random_rod(seed, stiffness=stiffness)
    return rod if term == "loads" else rod._replace(forces=np.zeros_like(rod.forces)), shape


def energy_after(rod: SpatialRod, shape: Shape, step: Array) -> float:
    """Energy after a straight move; a shape starts at the origin, so the first vertex's own move shifts the loads."""
    return float(energy(rod, straight_move(rod, shape, step)) - rod.forces.sum(axis=0) @ step[:3])


def derivatives(rod: SpatialRod, shape: Shape) -> tuple[Array, Array]:
    gradient, band = assemble(rod, shape)
    return gradient, dense(band)


def second_difference(rod: SpatialRod, shape: Shape, a: Array, b: Array) -> float:
    """Second derivative of the energy along two straight moves, of fourth order in the move's size."""

    def mixed(size: float) -> float:
        corners = [p * q * energy_after(rod, shape, size * (p * a + q * b)) for p in (-1, 1) for q in (-1, 1)]
        return float(sum(corners) / (4.0 * size**2))

    return (4.0 * mixed(1e-3) - mixed(2e-3)) / 3.0


@pytest.mark.parametrize("seed", SEEDS)
@pytest.mark.parametrize("term", TERMS)
def test_slopes_are_those_of_the_energy(term: str, seed: int) -> None:
    rod, shape = single_term(term, seed)
    gradient, _ = derivatives(rod, shape)
    size = np.max(np.abs(gradient))
    assert size > 1e-2
    if term not in ("stretch", "loads"):
        assert np.all(np.abs(gradient[3::4]) > 1e-8), "spins"
    for k in range(gradient.size):
        step = np.zeros(gradient.size)
        step[k] = 1e-5
        ahead, behind = (energy_after(rod, shape, way * step) for way in (1.0, -1.0))
        assert (ahead - behind) / 2e-5 == pytest.approx(gradient[k], rel=1e-6, abs=1e-7 * size)


@pytest.mark.parametrize("seed", SEEDS)
@pytest.mark.parametrize("term", TERMS)
def test_hessians_are_those_of_the_energy(term: str, seed: int) -> None:
    rod, shape = single_term(term, seed)
    gradient, hessian = derivatives(rod, shape)
    scale = np.max(np.abs(hessian))
    if term == "loads":
        assert scale == 0.0
        return
    assert scale > 1.0
    rng = np.random.default_rng(seed)
    steps = rng.normal(0.0, 0.1, (2, 30, gradient.size))
    for k in range(30):
        # Sparse moves find single entries, full ones all of them at once.
        a, b = steps[:, k] * (rng.random((2, gradient.size)) < (0.15 if k % 2 else 1.0))
        largest = scale * np.abs(a).sum() * np.abs(b).sum()
        assert second_difference(rod, shape, a, b) == pytest.approx(a @ hessian @ b, abs=1e-7 * largest)


@pytest.mark.parametrize("seed", SEEDS)
def test_rigid_motions_change_nothing(seed: int) -> None:
    rod, shape = random_rod(seed, 7)
    turn = matrix(turned(np.array([1.0, 0.0, 0.0, 0.0]), np.random.default_rng(seed).normal(0.0, 2.0, 3)))

    def rotate(frames: Array) -> Array:
        return np.array([quaternion(turn @ matrix(q)) for q in frames])

    other = rod._replace(forces=rod.forces @ turn.T, frames=rotate(rod.frames), chord=turn @ rod.chord)
    rotated = Shape(shape.strain, rotate(shape.frames))
    assert energy(other, rotated) == pytest.approx(energy(rod, shape), rel=1e-13)
    gradient, hessian = derivatives(rod, shape)
    expected, other_hessian = derivatives(other, rotated)
    blocks = [turn if k % 2 == 0 else np.eye(1) for k in range(2 * rod.edges.size + 1)]
    whole = np.zeros(hessian.shape)
    at = 0
    for block in blocks:
        whole[at : at + len(block), at : at + len(block)] = block
        at += len(block)
    assert expected == pytest.approx(whole @ gradient, abs=1e-12 * np.max(np.abs(gradient)))
    assert other_hessian == pytest.approx(whole @ hessian @ whole.T, abs=1e-12 * np.max(np.abs(hessian)))
    for axis in range(3):
        # Nor do translations, but for the loads.
        assert np.sum(gradient[axis::4]) == pytest.approx(-np.sum(rod.forces[:, axis]), abs=1e-9)


@pytest.mark.parametrize("seed", SEEDS)
def test_the_rod_is_the_same_from_its_other_end(seed: int) -> None:
    rod, shape = random_rod(seed, 6)
    over = np.array([np.pi, 0.0, 0.0])  # about m1: t and m2 change sign
    back = rod._replace(
        edges=rod.edges[::-1].copy(),
        natural=rod.natural[::-1] * [-1.0, 1.0, 1.0],
        forces=rod.forces[::-1].copy(),
        frames=np.array([turned(q, over) for q in rod.frames[::-1]]),
    )
    reverse = Shape(shape.strain[::-1].copy(), np.array([turned(q, over) for q in shape.frames[::-1]]))
    moved_by = rod.forces.sum(axis=0) @ vertex_positions(rod, shape)[-1]
    assert energy(back, reverse) == pytest.approx(energy(rod, shape) + moved_by, rel=1e-12)
    gradient, hessian = derivatives(rod, shape)
    other, other_hessian = derivatives(back, reverse)
    n = rod.edges.size
    order = np.concatenate(
        [[*range(4 * i, 4 * i + 3), *([4 * i - 1] if i > 0 else [])] for i in range(n, -1, -1)]
    ).astype(int)
    # A spin about a tangent is the opposite one about its reverse.
    ways = np.where(order % 4 == 3, -1.0, 1.0)
    assert other == pytest.approx(ways * gradient[order], abs=1e-11 * np.max(np.abs(gradient)))
    flipped = ways[:, None] * ways * hessian[np.ix_(order, order)]
    assert other_hessian == pytest.approx(flipped, abs=1e-11 * np.max(np.abs(hessian)))


def books_energy(rod: SpatialRod, shape: Shape) -> float:
    """Bergou et al. 2008, eq. 1 and 2, and 2010, section 3: curvature binormals, reference frames and their twist."""
    n = rod.edges.size
    frames = [matrix(q) for q in (rod.frames[0], *shape.frames, rod.frames[1])]
    cells = np.concatenate([rod.edges[:1], 0.5 * (rod.edges[1:] + rod.edges[:-1]), rod.edges[-1:]])
    # Beyond a clamp the rod is mirrored: the edge there differs from the clamp as the clamp from the first edge.
    pairs = [(frames[0] @ frames[1].T @ frames[0], frames[1])]
    pairs += [(frames[j], frames[j + 1]) for j in range(1, n)]
    pairs += [(frames[n], frames[n + 1] @ frames[n].T @ frames[n + 1])]
    total = 0.0
    for i, (before, after) in enumerate(pairs):
        first, second = before[:, 2], after[:, 2]
        binormal = 2.0 * np.cross(first, second) / (1.0 + first @ second)
        bends = 0.5 * (before[:, :2] + after[:, :2]).T @ binormal - cells[i] * rod.natural[i, :2]
        references = [np.cross(t, [0.3, -0.5, 0.8]) for t in (first, second)]
        references = [d / np.linalg.norm(d) for d in references]
        angles = [
            np.arctan2(f[:, 0] @ np.cross(f[:, 2], d), f[:, 0] @ d)
            for f, d in zip((before, after), references, strict=True)
        ]
        carried = between_vectors(first, second) @ references[0]
        reference_twist = np.arctan2(np.cross(carried, references[1]) @ second, carried @ references[1])
        twist = np.remainder(angles[1] - angles[0] + reference_twist + np.pi, 2.0 * np.pi) - np.pi
        twist -= cells[i] * rod.natural[i, 2]
        share = 0.5 if i in (0, n) else 1.0
        total += 0.5 * share * (rod.stiffness[:2] @ bends**2 + rod.stiffness[2] * twist**2) / cells[i]
    places = vertex_positions(rod, shape)
    lengths = np.linalg.norm(np.diff(places, axis=0), axis=1)
    total += 0.5 * rod.stiffness[3] * np.sum((lengths / rod.edges - 1.0) ** 2 * rod.edges)
    return float(total - np.sum(rod.forces * places))


@pytest.mark.parametrize("seed", range(6))
def test_the_energy_is_the_one_in_the_books(seed: int) -> None:
    rod, shape = random_rod(seed, 6)
    assert energy(rod, shape) == pytest.approx(books_energy(rod, shape), rel=1e-11)


@pytest.mark.parametrize("free", [0, 2])
def test_a_free_end_has_no_moment(free: int) -> None:
    rod, shape = random_rod(4)
    held = np.ones(3)
    held[free] = 0.0
    loose = rod._replace(held=held)
    gone = energy(rod, shape) - energy(loose, shape)
    assert gone > 0.0
    frames = rod.frames.copy()
    frames[free // 2] = 0.5
    elsewhere = loose._replace(frames=frames)
    assert energy(elsewhere, shape) == pytest.approx(energy(loose, shape), rel=1e-14)
    step = np.zeros(4 * rod.edges.size + 3)
    for k in range(step.size):
        step[:] = 0.0
        step[k] = 1e-5
        ahead, behind = (energy_after(loose, shape, way * step) for way in (1.0, -1.0))
        assert (ahead - behind) / 2e-5 == pytest.approx(assemble(loose, shape)[0][k], rel=1e-5, abs=1e-4)


@pytest.mark.parametrize("seed", range(6))
def test_a_vertex_between_edges_has_the_derivatives_of_its_terms(seed: int) -> None:
    rng = np.random.default_rng(seed)
    rod = random_rod(seed)[0]
    q, cell = rng.normal(size=4), 0.3
    q *= np.sign(q[0]) / np.linalg.norm(q)
    bent = bend.derivatives(q, cell, rod.stiffness, rod.natural[2])
    twisted = twist.derivatives(q, cell, rod.stiffness[2], rod.natural[2, 2])
    slope, bending = (tuple(np.add(one, other).tolist()) for one, other in zip(bent, twisted, strict=True))
    expected = along_rotations(q, slope, bending)
    for found, wanted in zip(inner_slopes(rod.stiffness[:3], rod.natural[2], cell, q), expected, strict=True):
        assert found == pytest.approx(wanted, rel=1e-11, abs=1e-11 * max(map(abs, wanted)))

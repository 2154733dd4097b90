"""Sections of meshes, pictures and formulas that are known, to a fiftieth of a millimetre and better."""

from __future__ import annotations

import io
from pathlib import Path

import numpy as np
import numpy.typing as npt
import pytest
import trimesh
from PIL import Image

from curveline.surfaces.envelope import upper_envelope
from curveline.surfaces.how_to_read import HowToReadSurface
from curveline.surfaces.reading import read_surface, surface_of_formula

from .meshes_known import IN_MM, box, field_of, heights, sheet, stl

Array = npt.NDArray[np.float64]
EXACT_MM = 1e-3
"""Single numbers of STL, of which 500 has seven digits."""


def hill(x: Array, y: Array) -> Array:
    return 80.0 * np.sin(np.pi * x / 500.0) * np.cos(np.pi * (y - 150.0) / 600.0)


def test_a_fine_mesh_of_a_hill_is_the_hill() -> None:
    field = field_of(sheet(hill, np.linspace(0.0, 500.0, 501), np.linspace(0.0, 300.0, 301)))
    x = np.linspace(0.0, 500.0, 1999)
    for y in (0.0, 37.31, 150.0, 250.5, 300.0):
        assert np.abs(heights(field, y, x) - hill(x, np.full_like(x, y))).max() < 0.02


def test_a_coarse_mesh_is_straight_within_its_faces() -> None:
    field = field_of(sheet(lambda x, y: 2.0 * x - y, np.array([0.0, 100.0]), np.array([0.0, 50.0])))
    x = np.linspace(0.0, 100.0, 57)
    assert np.abs(heights(field, 20.0, x) - (2.0 * x - 20.0)).max() < EXACT_MM


def test_a_ball_is_seen_from_above(tmp_path: Path) -> None:
    ball = trimesh.creation.icosphere(subdivisions=5, radius=300.0)
    ball.export(tmp_path / "ball.ply")
    field = read_surface(tmp_path / "ball.ply", IN_MM)
    x = np.linspace(-290.0, 290.0, 401)
    # The mesh's own faces, met by rays from above, one by one.
    wanted = rays(np.asarray(ball.triangles), x, 47.0)
    assert np.abs(heights(field, 47.0, x) - wanted).max() < 0.02
    assert np.abs(wanted - np.sqrt(300.0**2 - x**2 - 47.0**2)).max() < 1.0
    # Nowhere between two faces the lower half is seen through.
    for y in np.linspace(-0.29, 0.29, 59):
        (part,) = field.section(float(y), -0.29, 0.29)
        radius = np.hypot(np.hypot(part[:, 0], part[:, 1]), y)
        assert np.all(part[:, 1] > -1e-9)
        assert np.abs(radius - 0.3).max() < 1e-3


def rays(triangles: Array, x: Array, y: float) -> Array:
    """The highest place of triangles above each x, by barycentric coordinates."""
    a, b, c = (triangles[:, corner] for corner in range(3))
    size = (b[:, 0] - a[:, 0]) * (c[:, 1] - a[:, 1]) - (c[:, 0] - a[:, 0]) * (b[:, 1] - a[:, 1])
    # Upright faces are seen by no ray.
    a, b, c, size = (each[np.abs(size) > 1e-9] for each in (a, b, c, size))
    found = np.full(len(x), -np.inf)
    for place, across in enumerate(x):
        u = ((across - a[:, 0]) * (c[:, 1] - a[:, 1]) - (c[:, 0] - a[:, 0]) * (y - a[:, 1])) / size
        v = ((b[:, 0] - a[:, 0]) * (y - a[:, 1]) - (across - a[:, 0]) * (b[:, 1] - a[:, 1])) / size
        inside = (u >= -1e-9) & (v >= -1e-9) & (u + v <= 1.0 + 1e-9)
        height = a[:, 2] + u * (b[:, 2] - a[:, 2]) + v * (c[:, 2] - a[:, 2])
        found[place] = height[inside].max()
    return found


def test_random_faces_are_seen_as_rays_see_them() -> None:
    source = np.random.default_rng(3)
    ground = box((0.0, 0.0, -60.0), (500.0, 300.0, -50.0))
    triangles = np.concatenate([ground, source.uniform((0.0, 0.0, -40.0), (500.0, 300.0, 40.0), (200, 3, 3))])
    field = field_of(triangles)
    x = source.uniform(1.0, 499.0, 500)
    for y in (3.0, 100.0, 222.2):
        wanted = rays(triangles, x, y)
        off = np.abs(heights(field, y, np.sort(x)) - wanted[np.argsort(x)])
        # A ray beside a wall may hit its other side by a rounding of STL's numbers.
        assert np.mean(off < 0.02) > 0.99


def test_a_box_on_a_plate_has_walls() -> None:
    field = field_of(
        np.concatenate([box((0.0, 0.0, 0.0), (500.0, 200.0, 5.0)), box((100.0, 50.0, 0.0), (200.0, 150.0, 45.0))])
    )
    x = np.array([50.0, 99.9, 100.1, 150.0, 199.9, 200.1, 400.0])
    assert heights(field, 100.0, x) == pytest.approx([5.0, 5.0, 45.0, 45.0, 45.0, 5.0, 5.0], abs=EXACT_MM)
    (part,) = field.section(0.1, 0.0, 0.5)
    assert np.all(np.diff(part[:, 0]) > 0.0)
    # Faces that lie in the very plane of a section, at its outer edge, and touched from one side.
    for y in (0.0, 50.0, 150.0, 200.0):
        assert heights(field, y, np.array([150.0]))[0] == pytest.approx(
            45.0 if 50.0 <= y <= 150.0 else 5.0, abs=EXACT_MM
        )


def test_what_is_below_does_not_count() -> None:
    roof = sheet(lambda x, y: 100.0 + 0.1 * x, np.linspace(0.0, 500.0, 6), np.linspace(0.0, 100.0, 3))
    tilted = sheet(lambda x, y: 90.0 + 0.15 * x, np.linspace(0.0, 500.0, 4), np.linspace(0.0, 100.0, 2))
    field = field_of(np.concatenate([roof, tilted, box((0.0, 0.0, 0.0), (500.0, 100.0, 20.0))]))
    x = np.linspace(0.0, 500.0, 333)
    assert np.abs(heights(field, 33.0, x) - np.maximum(100.0 + 0.1 * x, 90.0 + 0.15 * x)).max() < EXACT_MM


def test_an_envelope_of_many_lines_is_their_largest_height() -> None:
    source = np.random.default_rng(5)
    ends = source.uniform(-1.0, 1.0, (60, 4))
    ends[0] = (-1.0, -2.0, 1.0, -2.0)
    (part,) = upper_envelope(ends)
    turned = np.where((ends[:, 0] > ends[:, 2])[:, None], ends[:, [2, 3, 0, 1]], ends)
    for x in source.uniform(-1.0, 1.0, 500):
        over = turned[(turned[:, 0] <= x) & (turned[:, 2] >= x)]
        share = (x - over[:, 0]) / (over[:, 2] - over[:, 0])
        wanted = float(np.max((1.0 - share) * over[:, 1] + share * over[:, 3]))
        assert np.interp(x, part[:, 0], part[:, 1]) == pytest.approx(wanted, abs=1e-4)
    assert upper_envelope(np.zeros((0, 4))) == []


@pytest.mark.parametrize("kind", ["stl", "obj", "ply"])
def test_all_kinds_of_meshes_are_the_same(kind: str, tmp_path: Path) -> None:
    triangles = sheet(hill, np.linspace(0.0, 500.0, 26), np.linspace(0.0, 300.0, 16))
    path = tmp_path / f"hill.{kind}"
    trimesh.Trimesh(triangles.reshape(-1, 3), np.arange(triangles.shape[0] * 3).reshape(-1, 3), process=False).export(
        path
    )
    x = np.linspace(0.0, 500.0, 99)
    field = read_surface(path, IN_MM)
    assert field.understood.startswith(f"{kind.upper()} of 750 faces, 1 unit = 1 mm, 500 x 300 x ")
    assert np.abs(heights(field, 120.0, x) - heights(field_of(triangles), 120.0, x)).max() < EXACT_MM


def test_units_and_what_is_up(tmp_path: Path) -> None:
    triangles = sheet(hill, np.linspace(0.0, 500.0, 26), np.linspace(0.0, 300.0, 16))
    path, turned = tmp_path / "hill.stl", tmp_path / "turned.stl"
    path.write_bytes(stl(triangles / 25.4))
    x = np.linspace(0.0, 500.0, 99)
    wanted = heights(field_of(triangles), 120.0, x)
    assert np.abs(heights(read_surface(path, HowToReadSurface(unit="in")), 120.0, x) - wanted).max() < 0.002
    assert np.abs(heights(read_surface(path, HowToReadSurface(width_mm=500.0)), 120.0, x) - wanted).max() < 0.002
    # As programs have it in which y is up and z comes towards who looks.
    turned.write_bytes(stl(np.stack([triangles[..., 0], triangles[..., 2], -triangles[..., 1]], axis=2)))
    field = read_surface(turned, HowToReadSurface(unit="mm", up="y"))
    assert np.abs(heights(field, 120.0, x) - wanted).max() < 0.002
    turned.write_bytes(stl(np.stack([triangles[..., 2], triangles[..., 1], -triangles[..., 0]], axis=2)))
    field = read_surface(turned, HowToReadSurface(unit="mm", up="x"))
    assert np.abs(heights(field, 120.0, x) - wanted).max() < 0.002


def test_a_grey_picture_has_heights_at_its_pixels(tmp_path: Path) -> None:
    rows, columns = 60, 100
    greys = np.add.outer(np.arange(rows)[::-1] * 600, np.arange(columns) * 200).astype(np.uint16)
    Image.fromarray(greys).save(tmp_path / "ramp.png")
    field = read_surface(tmp_path / "ramp.png", HowToReadSurface(width_mm=1000.0, height_mm=(-20.0, 200.0)))
    assert field.extent is not None
    assert (field.extent.width, field.extent.depth) == pytest.approx((1.0, 0.6))
    assert "PNG of 100 x 60 pixels, 1 pixel = 10 mm, 1000 x 600 mm, 16 bits, black at -20" in field.understood
    x = np.linspace(5.0, 995.0, 77)
    # Its lower edge is the front.
    for y in (5.0, 123.0, 595.0):
        grey = (y / 10.0 - 0.5) * 600 + (x / 10.0 - 0.5) * 200
        assert np.abs(heights(field, y, x) - (-20.0 + 220.0 * grey / 65535.0)).max() < 1e-6


@pytest.mark.parametrize("mode", ["L", "RGB", "1", "P"])
def test_greys_of_other_pictures(mode: str) -> None:
    stream = io.BytesIO()
    Image.new("L", (20, 10), 255).convert(mode).save(stream, "PNG", dpi=(25.4, 25.4))
    from curveline.surfaces.grey_pictures import read

    field = read(stream.getvalue(), HowToReadSurface(height_mm=(0.0, 30.0)), "white.png")
    assert field.heights == pytest.approx(0.03)
    assert field.cell == pytest.approx(1e-3)


def test_a_formula_of_x_and_y() -> None:
    field = surface_of_formula("60*sin(pi*x/500)*cos(pi*y/900) + where(y > 100, 5, 0)")
    x = np.linspace(0.0, 500.0, 201)
    for y in (0.0, 99.0, 250.0):
        wanted = 60.0 * np.sin(np.pi * x / 500.0) * np.cos(np.pi * y / 900.0) + (5.0 if y > 100.0 else 0.0)
        assert np.abs(heights(field, y, x) - wanted).max() < 1e-3
    assert np.all(heights(surface_of_formula("7"), 3.0, x) == pytest.approx(7.0))

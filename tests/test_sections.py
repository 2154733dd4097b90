"""Strips, round rods and tubes: stiffnesses and strain by other means, from a display file to states and plans."""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import curveline
from campaign import only
from curveline.displays.capability import Ability, Held
from curveline.displays.lint import suspicions
from curveline.errors import InvalidInput
from curveline.planning.tours import make_plan
from curveline.scene import Display, Node, Rod, Scene
from curveline.sections import CrossSection, Rectangle, Round
from curveline.shapes.files import builtin_text, read_display
from curveline.simulation import results
from curveline.simulation.results import Settings, ShapeReport
from curveline.simulation.simulate import clamped_rod, simulate
from curveline.units import mm

SHAPES = Path(__file__).parent.parent / "shapes"
STRIP, ROUND, TUBE = Rectangle(mm(10.0), mm(2.4)), Round(mm(3.0)), Round(mm(6.0), mm(4.5))
SINGLE = builtin_text("single")
FLAT = "width_mm = 10.0 ", "thickness_mm = 2.4 "
MODULUS = "youngs_modulus_GPa = 2.45 "


def rod_with(section: CrossSection) -> Rod:
    return replace(read_display("single").rod, section=section)


def display_with(folder: Path, **rod: float) -> Display:
    """The display `single` with other keys for its rod's section and, if one is among them, its stiffness."""
    text = SINGLE
    for key in (*FLAT, *((MODULUS,) if {"youngs_modulus_GPa", "bending_stiffness_Nmm2"} & set(rod) else ())):
        assert text.count(key) == 1
        text = text.replace(key, "# ")
    lines = "".join(f"{key} = {value!r}\n" for key, value in rod.items())
    path = folder / "mine.toml"
    path.write_text(text.replace("mass_g_per_m", f"{lines}mass_g_per_m", 1), encoding="utf-8")
    return read_display(path)


def on_display(name: str, display: Display) -> Scene:
    return replace(curveline.read_shape(SHAPES / f"{name}.toml"), display=display)


def moments(section: CrossSection) -> tuple[float, float, float]:
    """Area and second moments by adding up what lies inside, in strips along the axis and across it."""

    def chord(y: Any, size: float, other: float, *, is_round: bool) -> Any:
        inside = np.abs(y) < 0.5 * size
        return np.where(inside, np.sqrt(np.maximum(size**2 - 4.0 * y**2, 0.0)) if is_round else other, 0.0)

    out = []
    for size, other in ((section.thickness, section.width), (section.width, section.thickness)):
        y = (np.arange(400_000) + 0.5) / 400_000 * size - 0.5 * size
        width = chord(y, size, other, is_round=isinstance(section, Round))
        if isinstance(section, Round):
            width = width - chord(y, section.inner_diameter, 0.0, is_round=True)
        out.append((float(np.mean(width) * size), float(np.mean(width * y**2) * size)))
    return out[0][0], out[0][1], out[1][1]


@pytest.mark.parametrize("section", [STRIP, ROUND, TUBE, Round(mm(6.0), mm(5.9))])
def test_areas_and_moments_are_those_of_what_lies_inside(section: CrossSection) -> None:
    area, flat, lateral = moments(section)
    assert section.area == pytest.approx(area, rel=1e-6)
    assert section.second_moment == pytest.approx(flat, rel=1e-6)
    assert section.lateral_second_moment == pytest.approx(lateral, rel=1e-6)
    rod = rod_with(section)
    assert rod.bending_stiffness == pytest.approx(2.45e9 * flat, rel=1e-6)
    assert rod.lateral_bending_stiffness == pytest.approx(2.45e9 * lateral, rel=1e-6)
    assert rod.stretching_stiffness == pytest.approx(2.45e9 * area, rel=1e-6)
    assert rod.polar_gyration == pytest.approx(math.sqrt((flat + lateral) / area), rel=1e-6)


def test_a_round_section_twists_by_its_polar_moment_and_a_thin_tube_as_breit_and_bredt_say() -> None:
    shear = 2.45e9 / 2.7
    assert rod_with(ROUND).twisting_stiffness == pytest.approx(shear * math.pi / 32.0 * 0.003**4, rel=1e-12)
    assert rod_with(TUBE).twisting_stiffness == pytest.approx(
        shear * math.pi / 32.0 * (0.006**4 - 0.0045**4), rel=1e-12
    )
    # Bredt's formula for thin walls, 4 A^2 t / circumference; the error is the square of wall over diameter.
    wall, middle = 1e-5, 0.006 - 1e-5
    thin = 4.0 * (math.pi * middle**2 / 4.0) ** 2 * wall / (math.pi * middle)
    assert Round(0.006, 0.006 - 2.0 * wall).torsion_constant == pytest.approx(thin, rel=2.0 * (wall / middle) ** 2)


def test_a_square_of_equal_stiffness_misses_twist_and_strain_as_reported() -> None:
    side = 0.003 * (3.0 * math.pi / 16.0) ** 0.25
    square, circle = rod_with(Rectangle(side, side)), rod_with(ROUND)
    assert square.bending_stiffness == pytest.approx(circle.bending_stiffness)
    assert square.twisting_stiffness / circle.twisting_stiffness == pytest.approx(0.84, abs=0.005)
    assert square.surface_strain(1.0) / circle.surface_strain(1.0) == pytest.approx(0.88, abs=0.005)
    around = rod_with(Rectangle(mm(3.0), mm(3.0)))
    assert around.bending_stiffness / circle.bending_stiffness == pytest.approx(1.70, abs=0.005)
    assert around.twisting_stiffness / circle.twisting_stiffness == pytest.approx(1.43, abs=0.005)


@pytest.mark.parametrize("section", [STRIP, ROUND, TUBE])
def test_the_surface_is_strained_by_half_the_size_in_the_plane(section: CrossSection) -> None:
    rod = rod_with(section)
    assert rod.surface_strain(5.0) == pytest.approx(2.5 * section.thickness)
    assert rod.surface_strain(rod.max_curvature) == pytest.approx(rod.max_strain)


def test_a_hole_of_no_size_is_a_solid_rod(tmp_path: Path) -> None:
    assert display_with(tmp_path, diameter_mm=3, inner_diameter_mm=0).rod == rod_with(Round(0.003))
    assert display_with(tmp_path, diameter_mm=6.0, inner_diameter_mm=4.5).rod.section == TUBE


def test_a_measured_stiffness_scales_all_others_and_is_one_way_to_say_the_modulus(tmp_path: Path) -> None:
    measured = display_with(tmp_path, bending_stiffness_Nmm2=26000.0, width_mm=10.0, thickness_mm=2.4).rod
    assert measured.bending_stiffness == pytest.approx(0.026, rel=1e-12)
    table = rod_with(STRIP)
    share = 0.026 / table.bending_stiffness
    for name in ("lateral_bending_stiffness", "stretching_stiffness", "twisting_stiffness", "youngs_modulus"):
        assert getattr(measured, name) / getattr(table, name) == pytest.approx(share), name
    assert measured.max_curvature == table.max_curvature
    tube = display_with(tmp_path, bending_stiffness_Nmm2=26000.0, diameter_mm=6.0, inner_diameter_mm=4.5).rod
    assert tube.bending_stiffness == pytest.approx(0.026, rel=1e-12)
    assert tube.twisting_stiffness == pytest.approx(2.0 * 0.026 / 2.7)
    stiff = {"shear_modulus_GPa": 0.5, "bending_stiffness_Nmm2": 26000.0, "diameter_mm": 3.0}
    assert display_with(tmp_path, **stiff).rod.twisting_stiffness == pytest.approx(5e8 * math.pi / 32.0 * 0.003**4)


def test_hints_say_which_keys_to_keep(tmp_path: Path) -> None:
    hints: list[tuple[dict[str, float], str, str]] = [
        (
            {"diameter_mm": 3.0, "width_mm": 4.0},
            "diameter_mm makes the rod round, but width_mm makes it a strip",
            "keep",
        ),
        ({"thickness_mm": 4.0}, "rod.width_mm is missing", "or give diameter_mm instead"),
        (
            {"diameter_mm": 3.0, "inner_diameter_mm": 3.5},
            "3.5 mm, which is not below the diameter of 3 mm",
            "of the hole",
        ),
        (
            {"diameter_mm": 3.0, "bending_stiffness_Nmm2": 1e-5},
            "a modulus of 2.52e-09 GPa of a round rod of 3 mm",
            "N mm",
        ),
    ]
    for rod, message, hint in hints:
        with pytest.raises(InvalidInput) as caught:
            display_with(tmp_path, **rod)
        (found,) = caught.value.diagnostics
        assert message in found.message
        assert hint in found.hint


SHAPE = "level-down-valley"


@pytest.mark.parametrize("section", [TUBE, *only([ROUND])])
def test_curves_depend_on_the_section_by_its_stiffness_alone_and_plans_know_its_strain(section: CrossSection) -> None:
    """A square of equal stiffness bends the same; its surface is strained less, in proportion to its size."""
    display = read_display("single")
    thickness = (12.0 * section.second_moment) ** 0.25
    # As stiff as the strip; a strain that is no reason for other steps. Nodes that are tilted keep a round rod in its
    # plane, and only until then, in which it may be anywhere, does it matter how stiff it is against twist.
    modulus = display.rod.bending_stiffness / section.second_moment
    as_stiff = replace(display.rod, youngs_modulus=modulus, shear_modulus=modulus, max_strain=0.3)
    made, states = {}, {}
    for each in (section, Rectangle(thickness, thickness)):
        scene = on_display(SHAPE, replace(display, rod=replace(as_stiff, section=each)))
        made[each] = make_plan(scene)
        (found,) = simulate(scene, model="planar")
        states[each] = found.wanted
    round_, square = made.values()
    ratio = section.thickness / thickness
    assert [step.targets for step in round_.steps] == [step.targets for step in square.steps]
    for one, other in zip(round_.steps[2:], square.steps[2:], strict=True):
        assert one.max_strain == pytest.approx(ratio * other.max_strain, rel=1e-6)
        assert one.max_moment_Nmm == pytest.approx(other.max_moment_Nmm, rel=1e-6)
    wanted, same = states.values()
    assert wanted is not None
    assert same is not None
    assert wanted.curve(51) == pytest.approx(same.curve(51), abs=1e-9)
    limit = 0.99 * 0.5 * section.thickness * wanted.max_curvature
    brittle = replace(display, rod=replace(as_stiff, section=section, max_strain=limit))
    with pytest.raises(curveline.errors.CurvelineError, match="bend to a radius"):
        make_plan(on_display(SHAPE, brittle))


def test_out_of_the_plane_a_round_rod_is_as_stiff_as_in_it_and_turns_with_its_own_inertia() -> None:
    display = read_display("single")
    level = (Node(0.0, 0.0), Node(0.0, 0.0))
    tube = clamped_rod(replace(display, rod=rod_with(TUBE)), level, 0.6)
    assert tube.bearing.lateral == pytest.approx(rod_with(TUBE).bending_stiffness)
    seen = tube.section
    assert seen.thickness == pytest.approx(0.006)
    assert seen.gyration == pytest.approx(math.sqrt((0.006**2 + 0.0045**2) / 8.0))
    assert clamped_rod(display, level, 0.6).section.gyration == pytest.approx(
        math.hypot(0.01, 0.0024) / math.sqrt(12.0)
    )


def test_results_say_what_rod_it_was(tmp_path: Path) -> None:
    display = display_with(tmp_path, bending_stiffness_Nmm2=26000.0, diameter_mm=6.0, inner_diameter_mm=4.5)
    scene = on_display("level-neutral-peak", display)
    report = ShapeReport(scene, tuple(simulate(scene)), Settings(), 0.0)
    modulus = 0.026 / (math.pi / 64.0 * (0.006**4 - 0.0045**4)) / 1e9
    assert results.document(report)["provenance"]["rod"] == {
        "stiffness_from": "bending_stiffness_Nmm2",
        "diameter_mm": pytest.approx(6.0),
        "inner_diameter_mm": pytest.approx(4.5),
        "youngs_modulus_GPa": pytest.approx(modulus),
        "bending_stiffness_Nmm2": pytest.approx(26000.0),
        "shear_modulus_GPa": pytest.approx(modulus / 2.7),
    }


def test_what_looks_odd_of_a_round_rod_is_said_by_its_own_keys(tmp_path: Path) -> None:
    def odd(**rod: float) -> dict[str, str]:
        display = display_with(tmp_path, **rod)
        return {each.code: each.key for each in suspicions(display, Ability(Held(None, None)))}

    # As thick as the built-in strip, but that is no estimate of another rod's diameter.
    assert "rod.diameter_mm" not in odd(diameter_mm=2.4)["not-measured"]
    assert "rod.youngs_modulus_GPa" in odd(diameter_mm=2.4)["not-measured"]
    measured = odd(bending_stiffness_Nmm2=28224.0, width_mm=10.0, thickness_mm=2.4)["not-measured"]
    assert measured.split(", ")[:2] == ["rod.thickness_mm", "rod.mass_g_per_m"]
    assert odd(bending_stiffness_Nmm2=28.0, width_mm=1.0, thickness_mm=20.0)["odd-stiffness"].endswith("Nmm2")
    assert "thin-tube" not in odd(diameter_mm=6.0, inner_diameter_mm=4.5)
    assert odd(diameter_mm=6.0, inner_diameter_mm=5.8)["thin-tube"] == "rod.inner_diameter_mm"


def test_a_tube_softens_towards_the_moment_that_brazier_gives() -> None:
    """Of the moment EI c (1 - softening) the largest is 2 sqrt(2) / 9 E pi r t^2 / sqrt(1 - nu^2)."""
    wall, radius, nu = 1e-5, 0.003, 0.35
    thin = Round(2.0 * radius + wall, 2.0 * radius - wall)
    curvatures = np.linspace(0.0, 2.0, 200_001) * wall / radius**2
    softer = thin.softening(1.0) * curvatures**2
    largest = float(np.max(thin.second_moment * curvatures * (1.0 - softer)))
    exact = 2.0 * math.sqrt(2.0) / 9.0 * math.pi * radius * wall**2 / math.sqrt(1.0 - nu**2)
    assert largest == pytest.approx(exact, rel=1e-4)
    assert ROUND.softening(100.0) == STRIP.softening(100.0) == 0.0

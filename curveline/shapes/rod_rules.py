"""How a display file says what rod it has: one cross-section and one stiffness, each in one of two ways."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

from curveline.scene import Profile, Rod
from curveline.sections import POISSON, CrossSection, Rectangle, Round
from curveline.shapes.file_keys import LEAST_GPA, MOST_GPA, RodTable
from curveline.shapes.set_rules import check_set, relaxation_of
from curveline.shapes.toml_document import Document
from curveline.units import g_per_m, gpa, mm, nmm2, to_gpa, told_apart

FLAT = ("width_mm", "thickness_mm")
ROUND = ("diameter_mm", "inner_diameter_mm")
STIFFNESS = ("youngs_modulus_GPa", "bending_stiffness_Nmm2")
WAYS = "width_mm and thickness_mm for a strip, or diameter_mm for a round rod, and inner_diameter_mm if it is a tube"


def check_rod(document: Document) -> None:
    """Record what is missing, said twice or impossible in the table of the rod; a table must be there."""
    if not document.has("rod") or not isinstance(document.data["rod"], dict):
        return
    _check_section(document)
    _check_tube(document)
    _check_stiffness(document)
    check_set(document)


def rod_of(table: RodTable, profile: Profile | None) -> Rod:
    """The rod of a table that the rules found sound, with a natural curvature that varies along it.

    A bending stiffness that was measured sets the modulus, whatever the material's is called: what makes a strip of
    plastic softer or stiffer than its data sheet, its temper, its moisture, how long it stays bent, makes it so against
    stretch, twist and bending across as well. So all stiffnesses keep the ratios of the section, and G its ratio to E.
    """
    section = _section((table.width_mm, table.thickness_mm, table.diameter_mm, table.inner_diameter_mm))
    if table.bending_stiffness_Nmm2 is None:
        modulus = gpa(table.youngs_modulus_GPa or 0.0)
    else:
        modulus = nmm2(table.bending_stiffness_Nmm2) / section.second_moment
    shear = modulus / (2.0 * (1.0 + POISSON)) if table.shear_modulus_GPa is None else gpa(table.shear_modulus_GPa)
    return Rod(
        youngs_modulus=modulus,
        section=section,
        mass_per_length=g_per_m(table.mass_g_per_m),
        max_strain=table.max_strain,
        natural_curvature=table.natural_curvature_per_m,
        total_length=mm(table.total_length_mm),
        shear_modulus=shear,
        lateral_curvature=table.lateral_curvature_per_m,
        is_stiffness_measured=table.bending_stiffness_Nmm2 is not None,
        profile=profile,
        relaxation=relaxation_of(table),
    )


def _section(sizes: Sequence[float | None]) -> CrossSection:
    """From width, thickness, outer and inner diameter [mm]; what a rule misses of them is 0."""
    width, thickness, outer, inner = (mm(size or 0.0) for size in sizes)
    return Round(outer, inner) if outer > 0.0 else Rectangle(width, thickness)


def _check_section(document: Document) -> None:
    flat, round_ = _given(document, FLAT), _given(document, ROUND)
    if flat and round_:
        message = f"{_makes(round_)} the rod round, but {_makes(flat)} it a strip"
        document.problem_at_key(("rod", round_[0]), "two-ways", message, f"keep one: {WAYS}")
    elif round_ and "diameter_mm" not in round_:
        _miss(document, "diameter_mm", "add it: the diameter of the tube outside")
    elif not round_ and not flat:
        document.problem(("rod",), "missing-key", "the rod has no cross-section", f"give {WAYS}")
    elif not round_:
        for key in FLAT:
            if key not in flat:
                what = RodTable.model_fields[key].description
                _miss(document, key, f"add it: {what}; or give diameter_mm instead for a round rod")


def _check_tube(document: Document) -> None:
    outer, inner = (document.number("rod", key) for key in ROUND)
    if outer is not None and inner is not None and inner >= outer:
        hole, outside = told_apart(inner, outer, 6)
        message = f"inner_diameter_mm is {hole} mm, which is not below the diameter of {outside} mm"
        hint = "diameter_mm is that outside, inner_diameter_mm that of the hole; leave it out for a solid rod"
        document.problem(("rod", "inner_diameter_mm"), "out-of-range", message, hint)


def _check_stiffness(document: Document) -> None:
    given = _given(document, STIFFNESS)
    if len(given) == 2:
        message = "youngs_modulus_GPa and bending_stiffness_Nmm2 both say how stiff the rod is"
        hint = "keep the stiffness if it was measured by bending the rod: the modulus follows from it and the section"
        document.problem_at_key(("rod", "bending_stiffness_Nmm2"), "two-ways", message, hint)
    elif not given:
        hint = "add it: stiffness of the rod's material; or give bending_stiffness_Nmm2, as measured by bending the rod"
        _miss(document, "youngs_modulus_GPa", hint)
    elif given == ["bending_stiffness_Nmm2"]:
        _check_measured(document)


def _check_measured(document: Document) -> None:
    """The modulus that follows from a measured stiffness must be one that a file may give."""
    stiffness = document.number("rod", "bending_stiffness_Nmm2")
    section = _section([document.number("rod", key) for key in (*FLAT, *ROUND)])
    if stiffness is None or section.area <= 0.0:
        return
    modulus = to_gpa(nmm2(stiffness) / section.second_moment)
    if not LEAST_GPA <= modulus <= MOST_GPA:
        message = f"{stiffness:g} N mm^2 would take a modulus of {modulus:.3g} GPa of a {section}"
        hint = "is it in N mm^2, and the section in mm? 1 N m^2 is 1e6 N mm^2"
        document.problem(("rod", "bending_stiffness_Nmm2"), "out-of-range", message, hint)


def _given(document: Document, keys: Iterable[str]) -> list[str]:
    """Those of `keys` that the rod's table has, faulty or not."""
    return [key for key in keys if document.has("rod", key)]


def _miss(document: Document, key: str, hint: str) -> None:
    document.problem(("rod", key), "missing-key", f"rod.{key} is missing", hint)


def _makes(keys: Sequence[str]) -> str:
    return f"{' and '.join(keys)} make{'s' if len(keys) == 1 else ''}"

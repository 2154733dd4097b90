"""How a display file says what set its rod takes: as so much of acetal's, or time by time; or none."""

from __future__ import annotations

from curveline.material.relaxation import ACETAL_EXPONENT, Relaxation, fault_of, power_law
from curveline.shapes.file_keys import RodTable
from curveline.shapes.toml_document import Document

STRENGTH, EXPONENT = "set_strength", "set_exponent"
TIMES, FRACTIONS = "relaxation_times_s", "relaxation_fractions"


def check_set(document: Document) -> None:
    """Record what is said twice or by half of the set; the table of the rod must be there."""
    has = {key: document.has("rod", key) for key in (STRENGTH, EXPONENT, TIMES, FRACTIONS)}
    if has[STRENGTH] and (has[TIMES] or has[FRACTIONS]):
        message = f"{STRENGTH} and {TIMES if has[TIMES] else FRACTIONS} both say what set the rod takes"
        document.problem_at_key(("rod", STRENGTH), "two-ways", message, "keep the one that was measured")
        return
    for key, other in ((TIMES, FRACTIONS), (FRACTIONS, TIMES)):
        if has[key] and not has[other]:
            message = f"rod.{other} is missing beside {key}"
            document.problem_at_key(("rod", key), "missing-key", message, f"add it, or give {STRENGTH} instead of both")
    if has[EXPONENT] and not has[STRENGTH]:
        hint = f"add {STRENGTH}: 1 is the estimate for acetal"
        document.problem_at_key(("rod", EXPONENT), "missing-key", f"{EXPONENT} says nothing without {STRENGTH}", hint)
    _check_series(document)


def relaxation_of(table: RodTable) -> Relaxation | None:
    """The law of a table that the rules found sound; None for a rod that takes no set."""
    if table.set_strength is not None:
        exponent = ACETAL_EXPONENT if table.set_exponent is None else table.set_exponent
        return power_law(table.set_strength, exponent, table.temperature_C)
    if table.relaxation_times_s is None or table.relaxation_fractions is None:
        return None
    return Relaxation(tuple(table.relaxation_times_s), tuple(table.relaxation_fractions), table.temperature_C)


def _check_series(document: Document) -> None:
    """Record what keeps times and fractions from being a law."""
    rows = [document.get("rod", key) for key in (TIMES, FRACTIONS)]
    if not all(isinstance(row, list) for row in rows):
        return
    times, fractions = (
        tuple(document.number("rod", key, index) for index in range(len(row)))
        for key, row in zip((TIMES, FRACTIONS), rows, strict=True)
    )
    # What is no number, or out of range, was told of before.
    numbers = tuple(each for each in times if each is not None), tuple(each for each in fractions if each is not None)
    if (len(numbers[0]), len(numbers[1])) == (len(times), len(fractions)) and (fault := fault_of(*numbers)):
        document.problem(("rod", FRACTIONS), "out-of-range", f"no rod relaxes so: {fault[0]}", fault[1])

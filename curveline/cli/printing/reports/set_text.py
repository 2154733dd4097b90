"""What was found of the set of a rod, as text."""

from __future__ import annotations

from collections.abc import Iterator

from curveline.cli.printing import screen
from curveline.cli.printing.tables import fitting
from curveline.material.drum_fit import SetFit
from curveline.material.history import duration_text
from curveline.material.relaxation import LEAST_EXPONENT, LEAST_STRENGTH, MOST_EXPONENT, MOST_STRENGTH
from curveline.phrases import counted, wrapped
from curveline.shapes.rod_keys import toml_lines
from curveline.units import HOUR, WEEK, to_mm

HEAD = ("drum mm", "held", "after", "read /m", "law /m", "off /m")


def describe(fit: SetFit) -> Iterator[str]:
    """Lines of text: the lines of a display file, what they mean and may be off, and every reading beside the law."""
    yield "[rod]"
    yield from toml_lines(fit.keys)
    yield ""
    strength = _between(fit.strength_interval, (LEAST_STRENGTH, MOST_STRENGTH))
    yield from wrapped(f"set_strength, 1 being acetal's estimate: {strength} (95 %)")
    exponent = _between(fit.exponent_interval, (LEAST_EXPONENT, MOST_EXPONENT))
    told = "" if fit.is_exponent_told else f": the readings do not tell it, {fit.exponent:.3f} is taken"
    yield from wrapped(f"set_exponent: {exponent} (95 %){told}")
    parts = [f"{100.0 * fit.law.set_after(held):.0f} % after {duration_text(held)}" for held in (HOUR, 8 * HOUR, WEEK)]
    yield from wrapped(f"of a bend that is held it keeps {', '.join(parts)}, at 23 C")
    yield from wrapped(f"{counted(len(fit.readings), 'reading')}, off the law by {fit.rms:.2g} 1/m on average")
    if fit.is_poor:
        hint = "was the strip bent beyond a strain of 1 %, or moved? read it again, or trust nothing of this"
        yield from wrapped(f"warning: the readings follow another law: {hint}")
    rows = [
        (
            f"{to_mm(1.0 / each.bend):.4g}",
            duration_text(each.held),
            duration_text(each.after),
            *(f"{value:.3f}" for value in (each.curvature, fitted, each.curvature - fitted)),
        )
        for each, fitted in zip(fit.readings, fit.fitted, strict=True)
    ]
    yield from screen.headed(fitting([HEAD, *rows], frozenset()), HEAD, rows)


def _between(interval: tuple[float, float], ends: tuple[float, float]) -> str:
    """An interval, in words where an end is that of what was looked at."""
    low, high = interval
    if low <= ends[0] and high >= ends[1]:
        return "anything fits"
    if low <= ends[0]:
        return f"at most {high:.3g}"
    return f"at least {low:.3g}" if high >= ends[1] else f"{low:.3g} to {high:.3g}"

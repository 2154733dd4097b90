"""What a comparison of trials with the model found, in text for terminals of 80 columns."""

from __future__ import annotations

import sys
from collections.abc import Iterator

from curveline.cameras.outcomes import TrialOutcome
from curveline.cli.printing import screen
from curveline.cli.printing.manner import MANNER
from curveline.cli.printing.tables import fitting
from curveline.comparing.agreement import Comparison, NamedTrial, ShapeAgreement, percent
from curveline.phrases import counted, in_words, wrapped
from curveline.system.files import printable
from curveline.units import to_mm

HEAD = ("shape", "trials", "state", "MSD mm", "%", "RMSE mm", "%", "across mm")


def describe(found: Comparison) -> Iterator[str]:
    """Lines of text on what was found."""
    if MANNER.is_brief:
        yield from map(_briefly, found.shapes)
        return
    rows = [_row(each) for each in found.shapes]
    table = fitting([HEAD, *rows], frozenset({0, 2}))
    yield from screen.headed(table, HEAD, rows)
    for shape in found.shapes:
        yield from _remarks(shape)
    yield from _means(found)


def _briefly(found: ShapeAgreement) -> str:
    verdict = "as wanted" if found.is_wanted else "not as wanted"
    numbers = f"RMSE {_mm(found.rmse)} mm, MSD {_mm(found.msd)} mm"
    return f"{printable(found.scene.name)}: {_states(found)}, {verdict}, {numbers}"


def _row(found: ShapeAgreement) -> tuple[str, ...]:
    used = sum(each.counts for each in found.trials)
    whole = found.vertical_range
    return (
        printable(found.scene.name),
        f"{used} of {len(found.trials)}" if used < len(found.trials) else str(used),
        _states(found),
        _mm(found.msd),
        _percent(percent(found.msd, whole)),
        _mm(found.rmse),
        _percent(percent(found.rmse, whole)),
        _mm(found.across),
    )


def _states(found: ShapeAgreement) -> str:
    return in_words(found.states) if found.segments else "none"


def _mm(length: float | None) -> str:
    return "-" if length is None else screen.decimal(to_mm(length))


def _percent(value: float | None) -> str:
    return "-" if value is None else screen.decimal(value)


def _remarks(found: ShapeAgreement) -> Iterator[str]:
    """What was wrong with a shape and its trials."""
    name = printable(found.scene.name)
    wanted = tuple(segment.state for segment in found.scene.segments)
    for each in found.trials:
        if (told := _verdict(each, wanted)) is not None:
            yield from wrapped(f"{printable(each.trial.source)}: {told}")
    if not found.segments:
        yield from wrapped(f"{name}: no trial could be used")
    for number, part in enumerate(found.segments, start=1):
        if wanted[number - 1] not in [each.name for each in part.misfits]:
            where = f"segment {number} of it" if len(wanted) > 1 else "it"
            yield from wrapped(f"{name}: the model has no {wanted[number - 1]} where {where} is wanted")
    if found.is_wanted and not found.is_near:
        yield from wrapped(f"{name}: farther off than --max-rmse-mm allows")


def _verdict(found: NamedTrial, wanted: tuple[str, ...]) -> str | None:
    """What there is to say of a trial; None if it shows what is wanted."""
    trial = found.trial
    if trial.outcome is not TrialOutcome.SEEN:
        return f"{trial.outcome.value}: {printable(trial.reason)}"
    if found.states != wanted:
        kept = "" if found.counts else ", and is left out of the numbers"
        return f"in the wrong state: {in_words(found.states)}, not {in_words(wanted)}{kept}"
    return None


def _means(found: Comparison) -> Iterator[str]:
    """Means over the shapes as wanted, and what the numbers are."""
    agreeing = found.agreeing
    first = found.shapes[0]
    whole = first.vertical_range
    if len(found.shapes) > 1:
        yield screen.paint(
            f"{len(agreeing)} of {counted(len(found.shapes), 'shape')} in the wanted states"
            + (f": MSD {_mm(found.msd)} mm, RMSE {_mm(found.rmse)} mm on average" if agreeing else ""),
            screen.BOLD,
            sys.stdout,
        )
    asked = first.request.vertical_range is not None
    what = "the range that was given" if asked else "the way of a node up and down"
    yield from wrapped(
        f"MSD: mean standard deviation of heights between trials (ddof {first.request.ddof}); RMSE: of heights, trials "
        f"against the model; across: the same, at right angles to the curve; %: of {to_mm(whole):.4g} mm, {what}"
    )

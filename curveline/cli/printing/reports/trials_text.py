"""What many runs of a plan with errors came to, as text for terminals of 80 columns."""

from __future__ import annotations

import sys
from collections.abc import Iterator
from textwrap import wrap

from curveline.cli.printing import screen
from curveline.cli.printing.manner import MANNER
from curveline.phrases import counted
from curveline.replay.error_sizes import sizes_of
from curveline.replay.outcome import Share
from curveline.replay.ranking_report import ranking_sentences, ranking_tables
from curveline.replay.trials import Trials
from curveline.shapes.error_keys import in_words

COLUMNS = 80
HEAD = ("segment", "wanted", "ended so", "share %", "95 % confidence")


def describe(trials: Trials) -> Iterator[str]:
    """Lines of text: shares with their intervals, why runs failed, what each error does, the errors that were drawn."""
    if MANNER.is_brief:
        yield trials.summary()
        yield from () if trials.ranking is None else ranking_sentences(trials.ranking)
        return
    request, outcome = trials.request, trials.outcome
    seeds = f"seed {request.seed}" + (f" to {request.seed + request.runs - 1}" if request.runs > 1 else "")
    yield screen.paint(f"{counted(request.runs, 'run')} with errors, {seeds}", screen.BOLD, sys.stdout)
    rows = [HEAD]
    for number, (name, share) in enumerate(zip(trials.setup.plan.wanted, outcome.segments, strict=True), start=1):
        rows.append((str(number), name, *_share_cells(share)))
    if len(outcome.segments) > 1:
        rows.append(("all", "", *_share_cells(outcome.total)))
    yield from screen.table(rows, frozenset({0, 1}))
    yield from trials.reasons
    if outcome.worst is not None:
        seed = outcome.worst.seed
        yield f"seed {seed} fails with the smallest errors; again: --monte-carlo 1 --seed {seed}"
    for title, ranked in () if trials.ranking is None else ranking_tables(trials.ranking):
        yield from wrap(title, COLUMNS)
        yield from screen.table([tuple(map(str, row)) for row in ranked]) if ranked else ()
    sizes = ", ".join(f"{size.name} {size.value:g}{size.unit}" for size in sizes_of(trials.setup.errors))
    yield from wrap(f"errors: {sizes}", COLUMNS)
    if ranges := in_words(trials.setup.display_errors):
        yield from wrap(f"errors of the display: {ranges}", COLUMNS)
    processes = f"{trials.jobs} process{'' if trials.jobs == 1 else 'es'}"
    yield f"{trials.seconds:.1f} s on {processes}, {trials.plays / trials.seconds:.0f} runs per second"


def _share_cells(share: Share) -> tuple[str, str, str]:
    low, high = share.interval
    return f"{share.count} of {share.runs}", f"{100.0 * share.value:.1f}", f"{100.0 * low:.1f} to {100.0 * high:.1f} %"

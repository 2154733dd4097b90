"""An atlas, in text for terminals of 80 columns."""

from __future__ import annotations

import sys
from collections.abc import Iterator

from curveline.atlases.atlas import Atlas, NameTally
from curveline.atlases.folds import BIFURCATION, END, FOLD, TAUT
from curveline.cli.printing import screen
from curveline.cli.printing.manner import MANNER
from curveline.cli.printing.tables import fitting
from curveline.phrases import counted, wrapped
from curveline.units import to_nmm

STATES_WIDTH = 40
MOST_ROWS = 10
TALLY_HEAD = ("stable states", "points", "%")
NOUNS = {FOLD: "fold", BIFURCATION: "bifurcation", TAUT: "taut place", END: "other end"}
LEAST = 1e-6
"""An error that is not told to be smaller, in mm or degrees."""
STATE_HEAD = ("state", "points", "lowest eigenvalue", "force N", "moment N mm", "too much %")


def describe(found: Atlas) -> Iterator[str]:
    """Lines of text on which states there are, where they end and what they ask of motors."""
    points = len(found.poses)
    if MANNER.is_brief:
        first = found.tallies()[0]
        yield f"{found.display.name}: {first.kinds} at {first.points:,} of {points:,} points, {_folds(found)}"
        return
    yield screen.paint(found.display.name, screen.BOLD, sys.stdout)
    for axis in found.axes:
        yield f"  {axis}"
    yield from wrapped(", ".join(f"{key} {value:g}" for key, value in found.fixed.items()), indent=2)
    rows = [_tally(each.kinds, each.points, points) for each in found.tallies()]
    yield from screen.headed(fitting([TALLY_HEAD, *rows[:MOST_ROWS]]), TALLY_HEAD, rows[:MOST_ROWS])
    if len(rows) > MOST_ROWS:
        yield f"and {len(rows) - MOST_ROWS} rarer combinations"
    rows = [_state(each) for each in found.names()[:MOST_ROWS]]
    if rows:
        yield from screen.headed(fitting([STATE_HEAD, *rows]), STATE_HEAD, rows)
    yield from wrapped(_folds(found))
    yield f"{found.seconds:.1f} s"


def _tally(kinds: str, points: int, total: int) -> tuple[str, ...]:
    name = kinds if len(kinds) <= STATES_WIDTH else f"{kinds[: STATES_WIDTH - 3]}..."
    return name, f"{points:,}", f"{100 * points / total:.1f}"


def _state(tally: NameTally) -> tuple[str, ...]:
    """A row of what the states of a name come to."""
    ranges = tally.eigenvalue, tally.force, (to_nmm(tally.moment[0]), to_nmm(tally.moment[1]))
    texts = (f"{low:.2g} to {high:.2g}" for low, high in ranges)
    return tally.name, f"{tally.points:,}", *texts, f"{100.0 * tally.too_much:.0f}"


def _folds(found: Atlas) -> str:
    """How many places on lines at which states end, and how exact they are."""
    what = [counted(count, noun) for kind, noun in NOUNS.items() if (count := found.folds.count(kind))]
    if not what:
        return "no folds"
    units = " or ".join(dict.fromkeys("mm" if axis.key.endswith("_mm") else "deg" for axis in found.axes))
    return f"{', '.join(what)}, each located to {max(found.folds.largest_error, LEAST):.1g} {units}"

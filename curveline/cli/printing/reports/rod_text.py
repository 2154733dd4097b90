"""The rod of a display as it is now, as text."""

from __future__ import annotations

from collections.abc import Iterator

from curveline.cli.printing import screen
from curveline.cli.printing.reports.state_table import set_words
from curveline.cli.printing.tables import fitting
from curveline.driving.rod_now import RodNow
from curveline.material.history import duration_text
from curveline.phrases import local_time, wrapped

HEAD = ("from", "held", "shape", "run")
SHOWN = 20
"""Stays that are listed, the newest of them."""


def describe(rod: RodNow) -> Iterator[str]:
    """Lines of text: where it was held, the newest last, and what is left of that."""
    rows = [
        (
            local_time(stay.begin),
            duration_text(stay.seconds, rounded=True),
            "straight" if stay.is_known and stay.scene is None else stay.shape,
            stay.run,
        )
        for stay in rod.stays
    ]
    if len(rows) > SHOWN:
        yield f"{len(rows) - SHOWN} older ones are not shown"
    if rows:
        yield from screen.headed(fitting([HEAD, *rows[-SHOWN:]], frozenset({0, 2, 3})), HEAD, rows[-SHOWN:])
    else:
        yield f"no run of display {rod.display.name} over this radio is on record: its rod remembers nothing"
        return
    law = " (acetal's estimate: the display file says nothing)" if rod.past.is_estimate else ""
    yield from wrapped(f"the rod has a set of up to {rod.past.largest_set:.2g} 1/m{law}; {set_words(rod.past)}")
    for remark in rod.remarks:
        yield from wrapped(remark)

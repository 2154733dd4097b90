"""Figures of how well a node is heard: the polls that were lost over time, a line for each power of the radio."""

from __future__ import annotations

from curveline.figures.common import COLOURS, DARK, FORCE, GREY, bytes_of, draw_legend, new_figure
from curveline.radio.measuring.reach import MOST_LOSS, RangeTest
from curveline.scene import PEAK

WIDTH, HEIGHT = 6.4, 3.4  # [inch]
LOOKS = {"max": (DARK, "-"), "high": (COLOURS[PEAK], "--"), "low": (FORCE, "-."), "min": (GREY, ":")}
"""Colour and line of each power."""


def draw(found: RangeTest, *, kind: str) -> bytes:
    """One measurement as "svg", "png" or "pdf"; MissingExtra without matplotlib."""
    with new_figure(WIDTH, HEIGHT, kind) as figure:
        axes = figure.add_subplot()
        for level in found.levels:
            colour, line = LOOKS[level.level]
            times, shares = zip(*((each.at, 100.0 * each.lost / each.polls) for each in level.slots), strict=True)
            label = f"{level.level}, {level.dbm} dBm: {level.loss:.1%}"
            axes.plot(times, shares, linestyle=line, color=colour, marker=".", markersize=4, label=label)
        axes.axhline(100.0 * MOST_LOSS, color=GREY, linewidth=0.8)
        axes.set(ylim=(-2.0, 102.0))
        axes.set_xlabel("time [s]")
        axes.set_ylabel("polls lost [%]")
        axes.set_title(f"node {found.node}; the line at {MOST_LOSS:.0%} is what runs bear")
        axes.spines[["top", "right"]].set_visible(False)
        draw_legend(figure, axes.get_lines()[: len(found.levels)])
        return bytes_of(figure, kind)

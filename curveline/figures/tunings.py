"""Figures of a motor that was given its duty at once: its counts, and the lag that fits them, for each duty."""

from __future__ import annotations

from curveline.calibrating.step_response import SAMPLE_S, Tuning
from curveline.figures.common import DARK, MOTION, THIN, WIDTH, bytes_of, new_figure

HEIGHT = 3.6  # [inch]
STYLES = ("-", "--", "-.", ":")


def draw(found: Tuning, *, kind: str) -> bytes:
    """The turns of one motor as "svg", "png" or "pdf"; MissingExtra without matplotlib."""
    with new_figure(WIDTH, HEIGHT, kind) as figure:
        axes = figure.add_subplot()
        for style, response in zip(STYLES, found.responses, strict=False):
            times = [SAMPLE_S * index for index in range(len(response.counts))]
            moments = [1000.0 * time for time in times]
            axes.plot(moments, response.counts, ".", color=MOTION, markersize=3)
            label = f"{100 * response.duty:+.0f} % of full duty"
            fitted = [response.fitted(time) for time in times]
            axes.plot(moments, fitted, linestyle=style, color=DARK, linewidth=THIN, label=label)
        axes.set_xlabel("time [ms]")
        axes.set_ylabel("encoder counts")
        axes.set_title(
            f"node {found.node}, {found.axis}: {found.gain:.0f} counts/s, {1000 * found.time_constant:.1f} ms"
        )
        axes.legend(loc="upper left", frameon=False)
        return bytes_of(figure, kind)

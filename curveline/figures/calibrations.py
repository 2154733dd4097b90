"""Figures of a calibration: what each shape was off before and after, and the intervals of the numbers."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from curveline.calibrating.calibrated import Estimate, RodCalibration
from curveline.calibrating.unknowns import ANGLE, GIVE, LENGTH, WEIGHT
from curveline.figures.common import COLOURS, DARK, GREY, bytes_of, new_figure, within
from curveline.scene import PEAK, VALLEY
from curveline.system.files import AnyPath, printable
from curveline.units import decimals_of, to_deg, to_mm

if TYPE_CHECKING:
    from matplotlib.axes import Axes

WIDTH, ROW, AROUND = 8.4, 0.24, 1.1  # [inch] of the figure; of a shape or a number; of titles and labels
WIDTHS = 1.0, 0.9
BAR = 0.36
MOST = 12.0
"""Half intervals beyond which the file's number is not shown."""


def draw(found: RodCalibration, path: AnyPath = "", argv: tuple[str, ...] = (), *, kind: str) -> bytes:
    """Bars of what shapes were off, and each number with its interval: "svg", "png" or "pdf".

    MissingExtra without matplotlib.
    """
    rows = max(len(found.rows), len(found.estimates))
    with new_figure(WIDTH, AROUND + ROW * rows, kind) as figure:
        left, right = figure.subplots(1, 2, width_ratios=WIDTHS)
        figure.suptitle(within(f"{printable(found.display.name)}: {to_mm(found.after):.2f} mm off its trials", WIDTH))
        _draw_shapes(left, found)
        _draw_numbers(right, found)
        return bytes_of(figure, kind)


def _draw_shapes(panel: Axes, found: RodCalibration) -> None:
    places = range(len(found.rows))
    before = [0.0 if row.before is None else to_mm(row.before) for row in found.rows]
    panel.barh([place - 0.5 * BAR for place in places], before, BAR, color=GREY, label="before")
    panel.barh(
        [place + 0.5 * BAR for place in places],
        [to_mm(row.after) for row in found.rows],
        BAR,
        color=COLOURS[PEAK],
        label="after",
    )
    for place, row in enumerate(found.rows):
        if row.before is None:
            panel.annotate("no such state", (0.0, place - 0.5 * BAR), xytext=(3, -3), textcoords="offset points")
    names = [row.name if row.name.endswith(row.state) else f"{row.name}: {row.state}" for row in found.rows]
    panel.set_yticks(list(places), [within(printable(name), 0.4 * WIDTH) for name in names])
    panel.invert_yaxis()
    panel.set_xlabel("off the trials, across the curve, RMS [mm]")
    panel.legend(frameon=False, loc="lower left", bbox_to_anchor=(0.0, 1.0), borderpad=0.0, ncols=2)


def _draw_numbers(panel: Axes, found: RodCalibration) -> None:
    """Every number in units of half its interval: about what the file has it to be."""
    labels = []
    for place, each in enumerate(found.estimates):
        value, low, high = each.as_given
        size = 0.5 * (high - low) if math.isfinite(high) else value - low
        first = as_in_file(found, each)
        colour = DARK if each.is_told else COLOURS[VALLEY]
        panel.plot([(low - value) / size, (min(high, value + 2.0 * size) - value) / size], [place, place], color=colour)
        panel.plot([0.0], [place], color=colour, marker="o", markersize=4.0)
        if first is not None and abs(first - value) < MOST * size:
            panel.plot([(first - value) / size], [place], color=GREY, marker="|", markersize=9.0)
        decimals = min(decimals_of(size, 2), 3)
        labels.append(f"{each.name}: {value:.{decimals}f} +- {size:.{decimals}f} {each.unit}")
    panel.set_yticks(range(len(labels)), labels)
    panel.invert_yaxis()
    panel.set_xlabel("in half intervals, 95 %")
    panel.axvline(0.0, color=GREY, linewidth=0.6)
    panel.plot([], [], color=GREY, marker="|", markersize=9.0, linestyle="none", label="as in the file")
    panel.legend(frameon=False, loc="lower left", bbox_to_anchor=(0.0, 1.0), borderpad=0.0)


def as_in_file(found: RodCalibration, each: Estimate) -> float | None:
    """A number as the display's file has it, in the unit of reports; 0 of a camera's frame, None of no weight."""
    display, rod = found.display, found.display.rod
    heavy = rod.weight_per_length if display.gravity else 0.0
    known: dict[str, float | None] = {
        WEIGHT: to_mm((rod.bending_stiffness / heavy) ** (1.0 / 3.0)) if heavy else None,
        GIVE: to_mm(rod.bending_stiffness / display.clamp_stiffness),
        ANGLE: to_deg(display.offsets.angle(each.number)) if each.kind == ANGLE else 0.0,
        LENGTH: to_mm(display.offsets.length(each.number)) if each.kind == LENGTH else 0.0,
    }
    return known.get(each.kind, 0.0)

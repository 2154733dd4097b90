"""Figures of the radio's band: for what part of the time others send on each channel; where WLAN and a display are."""

from __future__ import annotations

from typing import TYPE_CHECKING

from curveline.figures.common import DARK, FORCE, GREY, MOTION, bytes_of, new_figure
from curveline.radio.protocol.band import ALLOWED, CHANNELS, USUAL_WLANS, wlan_middle, wlan_span

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from curveline.radio.measuring.channels import ChannelScan

WIDTH, HEIGHT = 7.2, 3.4  # [inch]
LAST_WLAN = 13
"""Drawn besides the usual ones."""
LEAST_PERCENT = 5.0
"""What the axis reaches to at least, so that a quiet band looks quiet."""


def draw(found: ChannelScan, *, kind: str) -> bytes:
    """One scan as "svg", "png" or "pdf"; MissingExtra without matplotlib."""
    with new_figure(WIDTH, HEIGHT, kind) as figure:
        axes = figure.add_subplot()
        shares = [100.0 * found.share(channel) for channel in range(CHANNELS)]
        top = 1.25 * max(LEAST_PERCENT, *shares)
        colours = [DARK if channel in ALLOWED else GREY for channel in range(CHANNELS)]
        colours[found.drive.channel] = MOTION
        axes.bar(range(CHANNELS), shares, width=0.9, color=colours)
        axes.axvline(found.drive.channel, color=MOTION, linewidth=1.2, label=f"the display: {found.drive.channel}")
        if found.advised != found.drive.channel:
            axes.axvline(
                found.advised, color=FORCE, linewidth=1.2, linestyle="--", label=f"channel to take: {found.advised}"
            )
        _show_wlans(axes, top)
        axes.set(xlim=(-1, CHANNELS), ylim=(0.0, top))
        axes.set_xlabel(f"channel (2400 MHz + channel); grey: beyond {ALLOWED[0]} to {ALLOWED[-1]}")
        axes.set_ylabel("others send [% of the time]")
        axes.spines[["top", "right"]].set_visible(False)
        axes.legend(loc="upper right", frameon=False)
        return bytes_of(figure, kind)


def _show_wlans(axes: Axes, top: float) -> None:
    """Bands that say where WLAN's channels are."""
    for number in (*USUAL_WLANS, LAST_WLAN):
        span = wlan_span(number)
        style = {"alpha": 0.12, "linewidth": 0.0} if number in USUAL_WLANS else {"alpha": 0.06, "linewidth": 0.0}
        axes.axvspan(span[0] - 0.5, span[-1] + 0.5, color=GREY, **style)
        axes.text(wlan_middle(number), 0.97 * top, f"WLAN {number}", ha="center", va="top", fontsize=7.0, color=DARK)

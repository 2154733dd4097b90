"""What has to be bought for a display: how many of each part, for the nodes, spans and ways of its file.

    python docs/tools/bill_of_materials.py quad

Prices are what such parts cost about 2025, from memory, to tell a cheap part from a dear one: check them. Where the
part, not its price, comes from stands behind it: `doc`, the paper or the page of the firmware; `calc`, computed from
the display file; `est`, an estimate.
"""

from __future__ import annotations

import argparse
import math
from collections.abc import Iterator
from dataclasses import dataclass

import curveline
from curveline.scene import Display

SPARE = 0.1
"""Share of small parts that is bought besides, at least one."""
RACK_MM = 2000
"""Length of the rack that the paper names, DR1-2000."""
STALL_A = 0.7
"""Of one motor of a node, three of which may be blocked at once."""
CARRIAGE_MM = 200
"""Of a rail, beyond the way of its node: the carriage, switch and ends."""
FRAME_MM = 300
"""Of each of the two beams, beyond the outer rails."""
WIRE_MM = 400
"""From the board to a motor."""


@dataclass(frozen=True)
class Part:
    """A row: what, how many are needed, whether spares are bought, the least and the highest price of one, whence."""

    name: str
    count: float
    prices: tuple[float, float]
    source: str
    spare: bool = True
    unit: str = ""

    @property
    def bought(self) -> int:
        """How many to buy."""
        return math.ceil(self.count + (max(1.0, SPARE * self.count) if self.spare else 0.0) - 1e-9)


def parts(display: Display) -> Iterator[tuple[str, list[Part]]]:
    """The parts by kind; of each node, and of the whole."""
    nodes, limits = display.node_count, display.limits
    span_mm, way_mm = 1e3 * display.span, 1e3 * (limits.height.high - limits.height.low)
    width_mm = (nodes - 1) * span_mm
    rail_m = nodes * (way_mm + CARRIAGE_MM) / 1e3
    yield (
        "electronics",
        [
            Part("Teensy LC, one for the dongle", nodes + 1, (12, 25), "doc"),
            Part("nRF24L01+ board, one for the dongle", nodes + 1, (3, 22), "doc"),
            Part("DRV8833 board, 2 a node", 2 * nodes, (4, 8), "doc"),
            Part("gear motor N20 298:1 with encoder", 3 * nodes, (10, 18), "doc"),
            Part("lever switch, closes; C, NO, NC", nodes, (0.5, 3), "doc"),
            Part("push button; LED; 1 k; 10 k: a set", nodes, (0.5, 2), "doc"),
            Part("100 nF, one on each motor", 3 * nodes, (0.05, 0.2), "doc"),
            Part("10 uF at each radio", nodes + 1, (0.1, 0.5), "doc"),
            Part("470 uF at each pair of drivers", nodes, (0.2, 1), "est"),
            Part("circuit board, or a breadboard", nodes, (3, 15), "est"),
        ],
    )
    amperes = math.ceil(3 * STALL_A * nodes)
    yield (
        "power",
        [
            Part(f"motor supply 6 V, {amperes} A or more", 1, (25, 60), "calc", spare=False),
            Part("logic supply 5 V, 2 A; USB leads", 1, (15, 35), "est", spare=False),
            Part(f"switch for {amperes} A DC, in reach", 1, (8, 30), "calc", spare=False),
            Part("fuse 2.5 A and its holder", nodes, (1, 3), "est"),
            Part("wire 1.5 mm2, both poles", 2 * (width_mm / 1e3 + 2), (0.5, 1.5), "calc", spare=False, unit="m"),
            Part("wire 0.14 mm2, 6 to each motor", 18 * nodes * WIRE_MM / 1e3, (0.1, 0.4), "calc", unit="m"),
        ],
    )
    yield (
        "mechanics",
        [
            Part("rod: rack DR1-2000", math.ceil(1e3 * display.rod.total_length / RACK_MM), (30, 70), "doc"),
            Part("rail: profile 20 x 20, by the metre", rail_m, (5, 12), "calc", spare=False, unit="m"),
            Part(
                "beams: the same, two of them", 2 * (width_mm + FRAME_MM) / 1e3, (5, 12), "calc", spare=False, unit="m"
            ),
            Part("rack of module 1 along the rails", nodes * way_mm / 1e3, (10, 40), "calc", spare=False, unit="m"),
            Part("pinion of module 1, 2 a node", 2 * nodes, (5, 15), "calc"),
            Part("gear pair 3:1 for bias", nodes, (5, 20), "calc"),
            Part("carriage with rollers", nodes, (8, 25), "est", spare=False),
            Part("clamp, bearing, mounts: printed", nodes, (5, 15), "est", spare=False),
        ],
    )


def report(display: Display) -> Iterator[str]:
    """The bill as text of 80 columns."""
    yield f"display {display.name}: {display.node_count} nodes, {1e3 * display.span:.0f} mm apart"
    yield f"{'':<37}{'needs':>6}{'buy':>6}{'each, EUR':>12}{'together':>10}{'from':>6}"
    least = most = 0.0
    for kind, found in parts(display):
        yield kind
        for part in found:
            low, high = (part.bought * price for price in part.prices)
            least, most = least + low, most + high
            count = f"{part.count:.1f}" if part.unit else f"{part.count:.0f}"
            each = f"{part.prices[0]:g} to {part.prices[1]:g}"
            bought = f"{part.bought} {part.unit}".strip()
            yield f"  {part.name:<35}{count:>6}{bought:>6}{each:>12}{f'{low:.0f}-{high:.0f}':>10}{part.source:>6}"
    yield f"together {least:.0f} to {most:.0f} EUR, without tax, freight and tools"


def main() -> None:
    """Print the bill of a display."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("display", nargs="?", default="quad", help="a built-in display or a display file")
    for line in report(curveline.read_display(parser.parse_args().display)):
        print(line)


if __name__ == "__main__":
    main()

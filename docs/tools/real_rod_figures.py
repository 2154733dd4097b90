"""The figures of the page *What a real rod adds*: for `docs/tools/real_rod.py`.

In the figure of limits full lines are of the level shape, dashed ones of the staggered one.
"""

from __future__ import annotations

import math
from collections.abc import Generator, Iterable, Iterator, Sequence
from dataclasses import replace
from pathlib import Path
from typing import NamedTuple

import real_rod_budget
from real_rod_limits import FARTHEST, LEVEL, STAGGERED, limit
from real_rod_rods import (
    Change,
    after,
    as_it_is,
    giving,
    gravity_length,
    keeping,
    longer,
    loose,
    read,
    state_of,
    turned,
    wider,
)

from curveline.scene import PEAK, VALLEY, Scene
from curveline.units import DAY, HOUR, MINUTE, WEEK, deg, to_deg

FOLDER = Path(__file__).parents[1] / "images"
PAPER, EDGE, GRID, INK, QUIET = "#fbfaf7", "#e4e0d6", "#e4e0d6", "#2b2f36", "#6b7280"
COLOURS = {PEAK: "#d9480f", VALLEY: "#1971c2"}
TEAL, PURPLE, SAND = "#0f7b6c", "#9c36b5", "#a8780a"
RIM = f'stroke="{PAPER}" stroke-width="4" paint-order="stroke"'
FONT = "Inter, 'Segoe UI', Roboto, 'Helvetica Neue', Arial, sans-serif"
SHAPES = {LEVEL: "", STAGGERED: 'stroke-dasharray="7 4"'}
"""How the lines of the two shapes are drawn."""
HELD = {LEVEL: 53.0, STAGGERED: 63.0}
"""Right nodes [deg] between the limit of the rod as it is and that after ten minutes in the peak."""

Point = tuple[float, float]


class Scale(NamedTuple):
    """One axis of a panel: the values at both of its ends, and its marks."""

    low: float
    high: float
    marks: dict[float, str]
    is_log: bool = False

    def part(self, value: float) -> float:
        """How far from its low end to its high one a value lies."""
        if self.is_log:
            return math.log(value / self.low) / math.log(self.high / self.low)
        return (value - self.low) / (self.high - self.low)


class Panel(NamedTuple):
    """A panel of a figure: its left upper corner and its size in the picture, its axes, what stands over it."""

    corner: Point
    size: Point
    across: Scale
    up: Scale
    title: str
    name: str

    def at(self, x: float, y: float) -> Point:
        """Where values lie in the picture."""
        return (
            self.corner[0] + self.size[0] * self.across.part(x),
            self.corner[1] + self.size[1] * (1.0 - self.up.part(y)),
        )


def line(points: Iterable[Point], style: str) -> str:
    """A line through points of the picture."""
    return f'<path d="M{" L".join(f"{x:.1f} {y:.1f}" for x, y in points)}" fill="none" {style}/>'


def text(at: Point, words: str, colour: str = INK, size: int = 13, anchor: str = "middle") -> str:
    """Words in the picture, with a rim that keeps them apart from lines."""
    style = f'fill="{colour}" font-size="{size}" text-anchor="{anchor}" {RIM}'
    return f'<text x="{at[0]:.1f}" y="{at[1]:.1f}" {style}>{words}</text>'


def stroke(colour: str, width: float = 2.0, more: str = "") -> str:
    """How a line is drawn."""
    return f'stroke="{colour}" stroke-width="{width}" stroke-linejoin="round" {more}'.rstrip()


def frame(panel: Panel) -> Iterator[str]:
    """Axes, marks and words of a panel."""
    (left, top), (width, height) = panel.corner, panel.size
    for value, word in panel.across.marks.items():
        x = left + width * panel.across.part(value)
        yield line([(x, top), (x, top + height)], stroke(GRID, 1.0))
        yield text((x, top + height + 16.0), word, QUIET, 12)
    for value, word in panel.up.marks.items():
        y = top + height * (1.0 - panel.up.part(value))
        yield line([(left, y), (left + width, y)], stroke(GRID, 1.0))
        yield text((left - 6.0, y + 4.0), word, QUIET, 12, "end")
    yield text((left, top - 10.0), panel.title, INK, 14, "start")
    yield text((left + 0.5 * width, top + height + 34.0), panel.name, QUIET, 12)


def limits_under(scene: Scene, changes: Sequence[tuple[float, Change]]) -> Iterator[Point]:
    """Values, and the limits [deg] under the changes that belong to them; those that no node can turn to are left out.

    The last that is left out is put where the line leaves the panel.
    """
    for value, change in changes:
        found = limit(change(scene))
        yield value, min(found, FARTHEST)
        if found > FARTHEST:
            return


def spaced(low: float, high: float, count: int = 13) -> list[float]:
    """Numbers from one to another, each by the same factor larger than the one before."""
    return [low * (high / low) ** (index / (count - 1)) for index in range(count)]


PEAK_OR_VALLEY = " or ".join(f'<tspan fill="{COLOURS[each]}">{each}</tspan>' for each in (PEAK, VALLEY))
DEGREES = Scale(-5.0, FARTHEST, {value: f"{value:.0f}" for value in (0.0, 15.0, 30.0, 45.0, 60.0, 75.0)})
HELD_FOR = Scale(
    10.0,
    WEEK,
    {10.0: "10 s", MINUTE: "1 min", 10 * MINUTE: "10 min", HOUR: "1 h", 8 * HOUR: "8 h", WEEK: "1 w"},
    is_log=True,
)
AT_HOME = Scale(
    MINUTE, WEEK, {MINUTE: "1 min", 10 * MINUTE: "10 min", HOUR: "1 h", 8 * HOUR: "8 h", DAY: "1 d", WEEK: "1 w"}, True
)


def lines_of(panel: Panel, changes: Sequence[tuple[float, Change]], colour: str) -> Iterator[str]:
    """The limits of both shapes in a panel."""
    for name, look in SHAPES.items():
        points = [panel.at(*point) for point in limits_under(read(name), changes)]
        yield line(points, stroke(colour, 2.4, look))


def plain_limits(panel: Panel) -> Iterator[str]:
    """Where the limits of the rod of the display file are."""
    (left, _), (width, _) = panel.corner, panel.size
    for name in SHAPES:
        y = panel.at(panel.across.low, limit(read(name)))[1]
        yield line([(left, y), (left + width, y)], stroke(QUIET, 1.0, 'stroke-dasharray="1 3"'))


def panels() -> Iterator[tuple[Panel, list[tuple[str, Sequence[tuple[float, Change]]]]]]:
    """The panels with lines: each with colours, and changes by the values that belong to them."""
    shares = [0.02 * index for index in range(11)]
    parts = Scale(0.0, 0.2, {0.0: "0", 0.05: "5 %", 0.1: "10 %", 0.15: "15 %", 0.2: "20 %"})
    corners = [(64.0 + 350.0 * column, 70.0 + 300.0 * row) for row in range(2) for column in range(3)]
    size = (270.0, 200.0)
    states = (PEAK, VALLEY)
    yield (
        Panel(corners[0], size, parts, DEGREES, "set: part kept of its own", PEAK_OR_VALLEY),
        [(COLOURS[each], [(share, keeping(share, each)) for share in shares]) for each in states],
    )
    yield (
        Panel(corners[1], size, HELD_FOR, DEGREES, "time at 23 C in its own", PEAK_OR_VALLEY),
        [(COLOURS[each], [(time, after(f"{each}@{time}s")) for time in spaced(10.0, WEEK)]) for each in states],
    )
    yield (
        Panel(corners[2], size, AT_HOME, DEGREES, "time at home, after 8 h in its own", PEAK_OR_VALLEY),
        [
            (COLOURS[each], [(time, after(f"{each}@8h,home@{time}s")) for time in spaced(MINUTE, WEEK)])
            for each in states
        ],
    )
    gives = Scale(0.0, 40.0, {value: f"{value:.0f}" for value in (0.0, 10.0, 20.0, 30.0, 40.0)})
    yield (
        Panel(corners[3], size, gives, DEGREES, "clamps that give", "as much as mm of rod"),
        [(TEAL, [(0.0, as_it_is), *((2.0 * each, giving(2.0 * each)) for each in range(1, 21))])],
    )
    lengths = Scale(200.0, 800.0, {value: f"{value:.0f}" for value in (200.0, 400.0, 600.0, 800.0)})
    yield (
        Panel(corners[4], size, lengths, DEGREES, "stiffness against weight", "(EI/w)^(1/3) in mm, 391 in the file"),
        [(SAND, [(each, gravity_length(each)) for each in spaced(200.0, 800.0, 21)])],
    )


ERRORS: tuple[tuple[str, Change, Change], ...] = (
    ("left node 1 deg", turned(-1.0, 0.0), turned(1.0, 0.0)),
    ("rod 3 mm", longer(-3.0), longer(3.0)),
    ("span 2 mm", wider(2.0), wider(-2.0)),
    ("play 1 deg", as_it_is, loose(1.0)),
)


def errors() -> Iterator[str]:
    """By how much errors of nodes and feed move the limit of the level shape, either way."""
    by = Scale(-1.5, 1.5, {value: f"{value:+.0f}" if value else "0" for value in (-1.0, 0.0, 1.0)})
    rows = Scale(0.0, float(len(ERRORS)), {})
    panel = Panel((844.0, 370.0), (190.0, 200.0), by, rows, "errors: change of the limit", "deg, of the level shape")
    yield from frame(panel)
    scene = read(LEVEL)
    fresh = limit(scene)
    for index, (words, *changes) in enumerate(ERRORS):
        ends = [limit(change(scene)) - fresh for change in changes]
        low, high = (panel.at(each, len(ERRORS) - index - 0.5) for each in ends)
        yield line([low, high], stroke(PURPLE, 12.0))
        yield text((panel.corner[0] - 6.0, low[1] + 4.0), words, QUIET, 12, "end")


def limits() -> Iterator[str]:
    """How far the right node may turn before the peak ceases to exist, against all that may move that."""
    yield text((24.0, 26.0), "right node up to which the peak exists [deg]: level 40 deg left, 700 mm (full); "
               "staggered 45 deg left, 720 mm (dashed)", INK, 14, "start")  # fmt: skip
    for panel, lines in panels():
        yield from frame(panel)
        yield from plain_limits(panel)
        for colour, changes in lines:
            yield from lines_of(panel, changes, colour)
    yield from errors()


def colour_of(cause: str) -> str:
    """Of a bar."""
    if cause.startswith(("set", "8h", "1h", "10min", "1min", "a session")):
        return COLOURS[PEAK]
    if cause.startswith(("clamp", "play")):
        return TEAL
    return PURPLE if " + " in cause and not cause.startswith("mass") else SAND


def budget() -> Iterator[str]:
    """By how much every cause moves the shapes in height, beside the paper's mean."""
    rows = [(words, does().height) for words, does in real_rod_budget.causes()]
    across = Scale(0.0, 14.0, {value: f"{value:.0f}" for value in range(0, 15, 2)})
    size = (640.0, 24.0 * len(rows))
    panel = Panel((300.0, 48.0), size, across, Scale(0.0, float(len(rows)), {}), "", "difference in height [mm]")
    yield text((24.0, 26.0), "each cause alone: difference in height, mean of the 14 shapes that the paper could hold",
               INK, 14, "start")  # fmt: skip
    yield from frame(panel)
    x, y = panel.at(real_rod_budget.PAPER_MM, 0.0)
    yield line([(x, panel.corner[1]), (x, y)], stroke(INK, 1.4, 'stroke-dasharray="5 3"'))
    yield text((x + 8.0, y - 8.0), "the paper: 6.68", INK, 12, "start")
    for index, (words, height) in enumerate(rows):
        start, end = (panel.at(each, len(rows) - index - 0.5) for each in (0.0, height))
        yield line([start, end], stroke(colour_of(words), 14.0))
        yield text((start[0] - 8.0, start[1] + 4.0), words, INK, 12, "end")
        yield text((end[0] + 26.0, end[1] + 4.0), f"{height:.1f}", QUIET, 12, "end")


def held() -> Iterator[str]:
    """What a rod shows past the limit that has been in the peak, and one that has not."""
    for index, (name, right) in enumerate(HELD.items()):
        x, y = 60.0 + 540.0 * index, 190.0
        scene = read(name)
        scene = replace(scene, nodes=(scene.nodes[0], replace(scene.nodes[1], angle=deg(right))))
        for change, state, look in (
            (as_it_is, VALLEY, 'stroke-dasharray="1 7" stroke-linecap="round"'),
            (after("peak@10min"), PEAK, ""),
        ):
            found = state_of(change(scene), state)
            assert found is not None
            curve = [(x + 900.0 * each, y - 900.0 * up) for each, up in found.curve(121).tolist()]
            yield line(curve, stroke(COLOURS[state], 5.0 if state == PEAK else 4.0, look))
        for place, node in ((0.0, scene.nodes[0]), (scene.display.span, scene.nodes[1])):
            middle = (x + 900.0 * place, y - 900.0 * node.height)
            at = f'cx="{middle[0]:.1f}" cy="{middle[1]:.1f}" r="9"'
            yield f'<circle {at} fill="{PAPER}" stroke="{INK}" stroke-width="3"/>'
        rise = name.split("-")[0]
        yield text((x + 225.0, 386.0), f"{rise}, right node at {right:.0f} deg", INK, 14)
        yield text((x + 225.0, 406.0), "peak: after ten minutes in the peak; valley: the rod as it is", QUIET, 12)


NEAR = {LEVEL: 50.4, STAGGERED: 60.1}
"""Right nodes [deg] a little before the limit of rigid clamps."""
MOUTH = 74.0
"""Of a line along a bearing in the picture."""


def clamped() -> Iterator[str]:
    """The two peaks just before rigid clamps lose them, between clamps that give more and more, and how these tilt."""
    looks = {0.0: INK, 5.0: "#0b7285", 10.0: "#2b8a3e", 20.0: "#e67700", 40.0: "#c92a2a"}
    for index, (name, right) in enumerate(NEAR.items()):
        corner = 70.0 + 560.0 * index, 280.0
        scene = read(name)
        held = replace(scene, nodes=(scene.nodes[0], replace(scene.nodes[1], angle=deg(right))))
        yield text((corner[0] + 225.0, 34.0), f"{name.split('-')[0]}, right node told {right:g} deg", INK, 14)
        for row, (give, colour) in enumerate(looks.items()):
            change, at = giving(give) if give else as_it_is, 392.0 + 20.0 * row
            tilts = yield from _tilted(change(held), corner, colour)
            words = f"{give:.0f} mm: tilt {tilts[0]:.1f} and {tilts[1]:.1f} deg" if give else "rigid clamps"
            yield text((corner[0] + 10.0, at), words, colour, 13, "start")
            yield text((corner[0] + 250.0, at), f"peak up to {limit(change(scene)):.1f} deg", QUIET, 13, "start")
        for place, node in zip((0.0, scene.display.span), held.nodes, strict=True):
            x, y = corner[0] + 900.0 * place, corner[1] - 900.0 * node.height
            yield f'<circle cx="{x:.1f}" cy="{y:.1f}" r="6" fill="{PAPER}" stroke="{INK}" stroke-width="2"/>'


def _tilted(scene: Scene, corner: Point, colour: str) -> Generator[str, None, list[float]]:
    """The peak of a shape with lines along its bearings as they tilt; by how much these do [deg]."""
    found = state_of(scene, PEAK)
    assert found is not None
    x, y = corner[0], corner[1] - 900.0 * scene.nodes[0].height
    yield line([(x + 900.0 * each, y - 900.0 * up) for each, up in found.curve(121).tolist()], stroke(colour))
    angles = [float(each) for each in found.vertices_table[[0, -1], 2]]
    for place, node, angle in zip((0.0, scene.display.span), scene.nodes, angles, strict=True):
        middle, half = (x + 900.0 * place, corner[1] - 900.0 * node.height), 0.5 * MOUTH
        ends = [
            (middle[0] + way * half * math.cos(angle), middle[1] - way * half * math.sin(angle)) for way in (-1.0, 1.0)
        ]
        yield line(ends, stroke(colour, 3.0, 'stroke-opacity="0.75"'))
    return [abs(to_deg(angle - node.angle)) for angle, node in zip(angles, scene.nodes, strict=True)]


FIGURES = {
    "real-rod-clamps.svg": ("Both peaks between clamps that give", (1150, 496), clamped),
    "real-rod-limits.svg": ("Up to which angle of the right node the peaks exist", (1080, 630), limits),
    "real-rod-budget.svg": ("By how much causes move the shapes of the paper", (1000, 708), budget),
    "real-rod-held.svg": ("Peaks that only a rod holds which has been in them", (1100, 424), held),
}


def pictures() -> dict[str, str]:
    """Every figure by the name of its file."""
    found = {}
    for name, (title, (width, height), parts) in FIGURES.items():
        head = (
            f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {width} {height}" font-family="{FONT}" role="img">'
        )
        card = f'<rect x="1" y="1" width="{width - 2}" height="{height - 2}" rx="14" fill="{PAPER}" stroke="{EDGE}"/>'
        found[name] = "\n".join([head, f"<title>{title}</title>", card, *parts(), "</svg>\n"])
    return found


def written() -> Iterator[str]:
    """Write all figures, and say which."""
    for name, drawn in pictures().items():
        (FOLDER / name).write_text(drawn, encoding="utf-8")
        yield f"docs/images/{name}"

"""Draws the pictures of README.md and of these pages: every curve in them is what curveline computes for that shape.

    python docs/images/draw.py

writes them anew, beside this file.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Sequence
from pathlib import Path
from typing import NamedTuple

import draw_board

import curveline
from curveline.scene import Node, Scene, Segment
from curveline.units import deg, mm, to_deg

FOLDER = Path(__file__).parent
SHAPES = FOLDER.parents[1] / "shapes"

PAPER, FRAME = "#fbfaf7", "#e4e0d6"
INK, QUIET = "#2b2f36", "#6b7280"
RAIL, SLOT = "#cfd3d9", "#b3b9c2"
BODY, BEARING = "#39414d", "#59636f"
PEAK, VALLEY = "#d9480f", "#1971c2"
CAR = "#f6e6dc"
FEED, ANGLE, HEIGHT = "#0f7b6c", "#9c36b5", "#a8780a"
FONT = "Inter, 'Segoe UI', Roboto, 'Helvetica Neue', Arial, sans-serif"

DOTS = 'stroke-dasharray="0.5 7.5"'
"""How the state is drawn that is not wanted."""
POINTS = 61
TAIL = 0.075
"""Length [m] of the rod that is drawn behind the outer nodes; there is more of it."""

Point = tuple[float, float]


class View(NamedTuple):
    """From metres in the display's frame to the picture: `x`, `y` is where its origin lies, `scale` is per metre."""

    x: float
    y: float
    scale: float

    def at(self, point: Sequence[float]) -> Point:
        """Where a position [m] lies in the picture."""
        return self.x + self.scale * point[0], self.y - self.scale * point[1]

    def size(self, metres: float) -> float:
        """How long a length [m] is in the picture."""
        return self.scale * metres


def line(points: Iterable[Point], style: str) -> str:
    """A line through points of the picture."""
    return f'<path d="M{" L".join(f"{x:.1f} {y:.1f}" for x, y in points)}" {style}/>'


def text(at: Point, words: str, style: str) -> str:
    """Words that begin, or lie around, a point of the picture."""
    return f'<text x="{at[0]:.1f}" y="{at[1]:.1f}" {style}>{words}</text>'


def rail(view: View, x: float, reach: float) -> Iterator[str]:
    """The upright on which a node climbs, through `reach` [m] to either side of home."""
    (left, top), width = view.at((x, reach)), view.size(0.02)
    height = view.size(2.0 * reach)
    frame = f'x="{left - width / 2:.1f}" y="{top:.1f}" width="{width:.1f}" height="{height:.1f}" rx="2"'
    yield f'<rect {frame} fill="{RAIL}"/>'
    yield line([(left, top + 3.0), (left, top + height - 3.0)], f'stroke="{SLOT}" stroke-width="{width / 5:.1f}"')


def carriage(view: View, x: float, node: Node) -> Iterator[str]:
    """The body of a node, which slides on its rail."""
    (middle_x, middle_y), width, height = view.at((x, node.height)), view.size(0.052), view.size(0.074)
    frame = f'x="{middle_x - width / 2:.1f}" y="{middle_y - height / 2:.1f}" width="{width:.1f}"'
    yield f'<rect {frame} height="{height:.1f}" rx="{width / 6:.1f}" fill="{BODY}"/>'
    yield f'<circle cx="{middle_x:.1f}" cy="{middle_y:.1f}" r="{view.size(0.021):.1f}" fill="{BEARING}"/>'


def jaws(view: View, x: float, node: Node, clamp: float) -> Iterator[str]:
    """What holds the rod straight in a node: a bar above it and one below."""
    at, degrees, thickness = view.at((x, node.height)), -to_deg(node.angle), view.size(0.005)
    half, gap = view.size(0.75 * clamp), view.size(0.0065)
    yield f'<g transform="translate({at[0]:.1f} {at[1]:.1f}) rotate({degrees:.1f})" fill="#eef0f3">'
    for top in (-gap - thickness, gap):
        size = f'width="{2.0 * half:.1f}" height="{thickness:.1f}" rx="{thickness / 3:.1f}"'
        yield f'<rect x="{-half:.1f}" y="{top:.1f}" {size}/>'
    yield "</g>"


def places(scene: Scene) -> list[Point]:
    """Where the nodes are [m]."""
    return [(index * scene.display.span, node.height) for index, node in enumerate(scene.nodes)]


def uprights(view: View, scene: Scene) -> Iterator[str]:
    """All rails of a display."""
    for x, _ in places(scene):
        yield from rail(view, x, scene.display.limits.height.high + 0.05)


def carriages(view: View, scene: Scene) -> Iterator[str]:
    """All nodes of a display, behind the rod."""
    for (x, _), node in zip(places(scene), scene.nodes, strict=True):
        yield from carriage(view, x, node)


def clamps(view: View, scene: Scene) -> Iterator[str]:
    """What of the nodes lies in front of the rod."""
    for (x, _), node in zip(places(scene), scene.nodes, strict=True):
        yield from jaws(view, x, node, scene.display.clamp)


def tails(scene: Scene) -> tuple[list[Point], list[Point]]:
    """The rod behind the outer nodes [m], from the left to the right."""
    (first, last), (left, right) = (places(scene)[0], places(scene)[-1]), (scene.nodes[0].angle, scene.nodes[-1].angle)
    start = (first[0] - TAIL * math.cos(left), first[1] - TAIL * math.sin(left))
    end = (last[0] + TAIL * math.cos(right), last[1] + TAIL * math.sin(right))
    return [start, first], [last, end]


def curve(scene: Scene, names: Sequence[str]) -> Iterator[Point]:
    """The rod from the first node to the last [m] with its segments in the states that are named."""
    for segment, name in zip(curveline.simulate(scene), names, strict=True):
        state = next(each for each in segment.states if each.name == name)
        yield from ((x + segment.origin[0], y + segment.origin[1]) for x, y in state.curve(POINTS).tolist())


def rod(view: View, scene: Scene, names: Sequence[str], style: str) -> str:
    """The whole rod."""
    before, after = tails(scene)
    return line(map(view.at, [*before, *curve(scene, names), *after]), style)


def stroke(colour: str, width: float, more: str = "") -> str:
    """How a rod is drawn."""
    return f'fill="none" stroke="{colour}" stroke-width="{width}" stroke-linejoin="round" stroke-linecap="round" {more}'


def arrow(points: Sequence[Point], colour: str) -> Iterator[str]:
    """A line with heads at both ends."""
    yield line(points, f'fill="none" stroke="{colour}" stroke-width="2"')
    for tip, back in ((points[0], points[1]), (points[-1], points[-2])):
        angle = math.atan2(tip[1] - back[1], tip[0] - back[0])
        wings = [
            (tip[0] - 8.0 * math.cos(angle + turn), tip[1] - 8.0 * math.sin(angle + turn)) for turn in (0.45, -0.45)
        ]
        yield line([wings[0], tip, wings[1]], f'fill="none" stroke="{colour}" stroke-width="2" stroke-linecap="round"')


def axes(view: View, scene: Scene) -> Iterator[str]:
    """The three axes of the left node, as arrows with their names."""
    node, clamp = scene.nodes[0], scene.display.clamp
    along, across = (math.cos(node.angle), math.sin(node.angle)), (-math.sin(node.angle), math.cos(node.angle))
    out = [(s * along[0] + 0.022 * across[0], s * along[1] + 0.022 * across[1]) for s in (-0.105, -0.04)]
    yield from arrow([view.at(point) for point in out], FEED)
    yield text(shifted(view.at(out[0]), -6.0, -8.0), "feed", label(FEED, "end"))
    arc = [(0.115 * math.cos(turn), 0.115 * math.sin(turn)) for turn in steps(0.02, node.angle - 0.03)]
    yield line([view.at((0.6 * clamp, 0.0)), view.at((0.135, 0.0))], f'stroke="{ANGLE}" stroke-dasharray="2 4"')
    yield from arrow([view.at(point) for point in arc], ANGLE)
    yield text(shifted(view.at((0.128, 0.027)), 0.0, 4.0), "angle", label(ANGLE, "start"))
    yield from arrow([view.at((-0.048, y)) for y in (-0.13, -0.062)], HEIGHT)
    yield text(shifted(view.at((-0.058, -0.1)), 0.0, 5.0), "height", label(HEIGHT, "end"))


def steps(start: float, end: float, count: int = 12) -> list[float]:
    """Numbers from one to another, both included."""
    return [start + (end - start) * index / (count - 1) for index in range(count)]


def shifted(at: Point, right: float, down: float) -> Point:
    """A point beside another one, in the picture."""
    return at[0] + right, at[1] + down


def label(colour: str, anchor: str = "middle", size: int = 15, weight: int = 600) -> str:
    """How words are written."""
    return f'fill="{colour}" text-anchor="{anchor}" font-size="{size}" font-weight="{weight}"'


def single(view: View) -> Iterator[str]:
    """Two nodes, the curve that the shape asks for, and the other one that they allow."""
    scene = curveline.read_shape(SHAPES / "level-up-peak.toml")
    yield from uprights(view, scene)
    yield from carriages(view, scene)
    yield rod(view, scene, ["valley"], stroke(VALLEY, 3.5, DOTS))
    yield rod(view, scene, ["peak"], stroke(PEAK, 6))
    yield from clamps(view, scene)
    yield from axes(view, scene)
    yield text(view.at((0.25, 0.215)), "peak", label(PEAK, size=19))
    yield text(view.at((0.25, -0.187)), "valley", label(VALLEY, size=19))


def row(view: View) -> Iterator[str]:
    """Five nodes that show the roof of a car."""
    scene = curveline.read_shape(SHAPES / "roofline.toml")
    names = [segment.state for segment in scene.segments]
    yield from car(view, list(curve(scene, names)))
    yield from uprights(view, scene)
    yield from carriages(view, scene)
    yield rod(view, scene, names, stroke(PEAK, 5))
    yield from clamps(view, scene)


def car(view: View, roof: list[Point]) -> Iterator[str]:
    """What the roof belongs to: a body with two wheels."""
    body = [*roof, (2.0, -0.27), (1.93, -0.31), (0.06, -0.31), (0.0, -0.27)]
    yield line(map(view.at, body), f'fill="{CAR}"')
    for x in (0.38, 1.6):
        (wheel_x, wheel_y), radius = view.at((x, -0.31)), view.size(0.135)
        yield f'<circle cx="{wheel_x:.1f}" cy="{wheel_y:.1f}" r="{radius + 4.0:.1f}" fill="{PAPER}"/>'
        yield f'<circle cx="{wheel_x:.1f}" cy="{wheel_y:.1f}" r="{radius:.1f}" fill="{SLOT}"/>'
        yield f'<circle cx="{wheel_x:.1f}" cy="{wheel_y:.1f}" r="{0.45 * radius:.1f}" fill="{PAPER}"/>'


def display() -> Iterator[str]:
    """The picture of README.md."""
    yield from single(View(x=130.0, y=226.0, scale=640.0))
    yield from row(View(x=588.0, y=222.0, scale=255.0))
    yield text((290.0, 424.0), "two nodes, one rod: two stable curves", label(QUIET, weight=500))
    yield text((843.0, 424.0), "five nodes: the roofline of a car", label(QUIET, weight=500))


def funnel_scenes() -> Iterator[tuple[str, Scene, tuple[str, ...]]]:
    """After each step of a plan: what the step does, the scene, and the states that the rod may be in."""
    from curveline.planning.tours import make_plan

    scene = curveline.read_shape(SHAPES / "staggered-up-peak.toml")
    said = ("feed", "turn", "feed to length", "turn to the angles", "lift")
    for words, step in zip(said, make_plan(scene).steps, strict=True):
        nodes = tuple(Node(mm(each.translate_mm), deg(each.bias_deg)) for each in step.targets)
        names = tuple(step.states[0].split("|"))
        yield words, Scene("", scene.display, nodes, (Segment(mm(step.lengths_mm[0]), names[0]),)), names


def funnel() -> Iterator[str]:
    """The steps of a plan: what the rod may look like after each."""
    for index, (words, scene, names) in enumerate(funnel_scenes()):
        view = View(x=58.0 + 214.0 * index, y=122.0, scale=250.0)
        yield from uprights(view, scene)
        yield from carriages(view, scene)
        for name in reversed(names):
            yield rod(view, scene, [name], stroke(PEAK, 4) if name == "peak" else stroke(VALLEY, 3, DOTS))
        yield from clamps(view, scene)
        yield text((view.at((0.25, 0.0))[0], 228.0), f"{index + 1}. {words}", label(INK, size=15, weight=500))


def mark() -> Iterator[str]:
    """The sign of the project: two nodes, a rod."""
    arch = [(x, 46.0 - 34.0 * math.sin(math.pi * (x - 8.0) / 48.0) ** 2) for x in steps(8.0, 56.0, 33)]
    yield line(arch, stroke(PEAK, 6))
    for x in (8.0, 56.0):
        yield f'<rect x="{x - 6.0}" y="37" width="12" height="18" rx="3" fill="{QUIET}"/>'


def picture(title: str, size: tuple[int, int], parts: Iterable[str]) -> str:
    """An SVG document."""
    width, height = size
    head = f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {width} {height}" font-family="{FONT}" role="img">'
    return "\n".join([head, f"<title>{title}</title>", *parts, "</svg>\n"])


def on_card(size: tuple[int, int], parts: Iterable[str]) -> Iterator[str]:
    """A picture on paper of its own, so that it can be read on a page of any colour."""
    width, height = size
    yield f'<rect x="1" y="1" width="{width - 2}" height="{height - 2}" rx="14" fill="{PAPER}" stroke="{FRAME}"/>'
    yield from parts


def pictures() -> dict[str, str]:
    """Every picture by the name of its file."""
    cards = {
        "display.svg": ("A display of two nodes and one of five", (1140, 450), display()),
        "board.svg": ("One board of a display, its supplies and its motors", draw_board.SIZE, draw_board.board()),
        "funnel.svg": ("What the rod may look like after each step of a plan", (1100, 254), funnel()),
    }
    drawn = {name: picture(title, size, on_card(size, parts)) for name, (title, size, parts) in cards.items()}
    return {**drawn, "mark.svg": picture("curveline", (64, 64), mark())}


if __name__ == "__main__":
    for name, content in pictures().items():
        (FOLDER / name).write_text(content, encoding="utf-8")

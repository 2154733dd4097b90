"""What all figures share: what colours and lines mean, sizes, matplotlib kept apart from the user's settings.

A line says the same in every figure:

colour          which state of the rod, or what is no state: force, motion, what was before
thick           the state that is meant: wanted, or where the rod surely is
thin            another state, or one of several that the rod may be in
solid           an equilibrium that stays
dashed          an equilibrium that does not stay
dotted          what a planar display cannot show
faint           where the rod was before
"""

from __future__ import annotations

import io
import math
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from itertools import pairwise
from typing import TYPE_CHECKING, Any

from curveline.errors import MissingExtra
from curveline.scene import BUCKLED, PEAK, STRAIGHT, VALLEY, Display
from curveline.units import to_mm

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure
    from matplotlib.lines import Line2D

GREY = "#999999"
DARK = "#333333"
FORCE = "#E69F00"
MOTION = "#8A2BE2"
# Of Okabe and Ito's palette, which people with any colour vision tell apart; the last is darker than theirs.
COLOURS = {
    PEAK: "#0072B2",
    VALLEY: "#D55E00",
    STRAIGHT: DARK,
    BUCKLED: "#CC79A7",
    "front": "#56B4E9",
    "back": "#8C6D1F",
}
"""Of the kinds of states, their names without a number."""
OTHER = "#009E73"
STAYS, DOES_NOT_STAY = "-", (0, (5, 2))
THIN, THICK = 1.2, 2.6
UNSHOWN = "not for a planar display"
UNSHOWN_LOOK: Mapping[str, Any] = {"color": GREY, "linewidth": 0.9, "linestyle": ":"}
BEFORE_LOOK: Mapping[str, Any] = {"color": GREY, "linewidth": THIN, "linestyle": STAYS, "alpha": 0.7}
HUB: Mapping[str, Any] = {
    "color": DARK, "marker": "o", "markersize": 4.5, "markerfacecolor": "white", "linestyle": "none", "zorder": 5,
}  # fmt: skip
"""A node's pivot."""
X_LABEL = "x [mm]"
Y_LABEL = "y [mm]"
WIDTH = 6.4  # [inch] of a panel that has a row for itself
PIXELS_PER_INCH = 150
FONT = "DejaVu Sans"
STAND_INS = "Verdana, Geneva, sans-serif"
"""Fonts as wide as ours, for who looks at an SVG and has not that."""
LETTERS, BOLD_LETTERS = 12.0, 10.0
"""Letters of a title to the inch."""
LETTER_WIDTH, HANDLE_WIDTH = 0.072, 0.55  # [inch] in a legend: of a letter, of all else of an entry
SETTINGS: Any = {
    "text.parse_math": False,
    "svg.hashsalt": "curveline",
    "svg.fonttype": "none",  # text stays text
    "pdf.fonttype": 42,
    "font.family": FONT,
    "font.size": 9.0,
}
METADATA: dict[str, dict[str, Any]] = {
    "svg": {"Date": None, "Creator": "curveline"},
    "png": {"Software": "curveline"},
    "pdf": {"CreationDate": None, "Creator": "curveline", "Producer": None},
}


@dataclass(frozen=True)
class PanelFrame:
    """What a panel shows, in its own units, such as mm."""

    left: float
    right: float
    low: float
    high: float

    @classmethod
    def around(cls, places: Iterable[Sequence[float]], room: float) -> PanelFrame:
        """The least one that has `room` beyond all places (x, y); of no places a square about the origin."""
        known = [(float(x), float(y)) for x, y in places] or [(0.0, 0.0)]
        across, up = zip(*known, strict=True)
        return cls(min(across) - room, max(across) + room, min(up) - room, max(up) + room)

    @classmethod
    def over(cls, frames: Sequence[PanelFrame]) -> PanelFrame:
        """The least one that has several in it."""
        return cls(
            min(each.left for each in frames),
            max(each.right for each in frames),
            min(each.low for each in frames),
            max(each.high for each in frames),
        )

    @property
    def steepness(self) -> float:
        """Height over width."""
        return (self.high - self.low) / (self.right - self.left)

    def within(self, least: float, most: float) -> PanelFrame:
        """The same in the middle of one that is at least and at most so steep."""
        wanted = min(max(self.steepness, least), most)
        taller = max(0.0, wanted * (self.right - self.left) - (self.high - self.low))
        wider = max(0.0, (self.high - self.low) / wanted - (self.right - self.left))
        return PanelFrame(
            self.left - 0.5 * wider, self.right + 0.5 * wider, self.low - 0.5 * taller, self.high + 0.5 * taller
        )

    def show_in(self, panel: Axes) -> None:
        """Have a panel show it; see `fit_height`."""
        panel.set(xlim=(self.left, self.right), ylim=(self.low, self.high))


def require_matplotlib() -> None:
    """MissingExtra unless figures can be drawn."""
    try:
        import matplotlib  # noqa: F401
    except ImportError:
        raise MissingExtra(
            "drawing figures needs matplotlib, which is not installed", hint="pip install 'curveline[plot]'"
        ) from None


@contextmanager
def new_figure(width: float, height: float, kind: str) -> Iterator[Figure]:
    """An empty figure of `width` x `height` [inch], to be filled and written as a `kind` of figure or as frames.

    Inside, matplotlib's own settings hold, not those of the user; MissingExtra without matplotlib.
    """
    require_matplotlib()
    import matplotlib
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.backends.backend_pdf import FigureCanvasPdf
    from matplotlib.backends.backend_svg import FigureCanvasSVG
    from matplotlib.figure import Figure

    with matplotlib.rc_context({**_defaults(), **SETTINGS}):
        figure = Figure(figsize=(width, height), layout="constrained")
        {"svg": FigureCanvasSVG, "pdf": FigureCanvasPdf}.get(kind, FigureCanvasAgg)(figure)
        yield figure


def _defaults() -> dict[Any, Any]:
    """matplotlib's own settings, so that those of the user or the machine do not show; the backend is never used."""
    from matplotlib import rcParamsDefault

    return {name: value for name, value in rcParamsDefault.items() if name not in ("backend", "backend_fallback")}


def fit_height(figure: Figure, rows: Sequence[Sequence[Axes]]) -> None:
    """Make panels true to aspect, and a figure just as high as that takes at its width.

    The panels of a row show frames that are as high at the panels' widths.
    """
    # While they fill their places, whatever those are like, the labels around them are where they will be.
    figure.draw_without_rendering()
    width, height = (float(size) for size in figure.get_size_inches())
    needed, there = [], 0.0
    for first, *_ in rows:
        place = first.get_position(original=True)
        (left, right), (low, high) = first.get_xlim(), first.get_ylim()
        needed.append(width * place.width * abs(high - low) / abs(right - left))
        there += height * place.height
    rows[0][0].get_gridspec().set_height_ratios(needed)  # type: ignore[union-attr]
    figure.set_size_inches(width, height + sum(needed) - there)
    # Laid out once more, and then left so: the layout takes what a panel does not fill for room that labels may have.
    figure.draw_without_rendering()
    figure.set_layout_engine("none")
    for panel in (each for row in rows for each in row):
        panel.set_aspect("equal")


def bytes_of(figure: Figure, kind: str) -> bytes:
    """A figure as "svg", "pdf" or "png", without a date."""
    stream = io.BytesIO()
    figure.savefig(stream, format=kind, dpi=PIXELS_PER_INCH, metadata=METADATA[kind])
    made = stream.getvalue()
    if kind != "svg":
        return made
    return made.replace(f"font-family: '{FONT}'".encode(), f"font-family: '{FONT}', {STAND_INS}".encode())


def kind_of(name: str) -> str:
    """The kind of a state, its name without a number: "middle" of "middle-2"."""
    return name.partition("-")[0]


def colour_of(name: str) -> str:
    """The colour of a state's curve."""
    return COLOURS.get(kind_of(name), OTHER)


def look_of(name: str, *, is_meant: bool, stays: bool = True) -> dict[str, Any]:
    """How the curve of a state is drawn."""
    width, style = THICK if is_meant else THIN, STAYS if stays else DOES_NOT_STAY
    return {"color": colour_of(name), "linewidth": width, "linestyle": style}


def by_kind(kinds: Iterable[str]) -> list[str]:
    """The kinds of states in the order in which legends have them: peak, valley, then by the alphabet."""
    return sorted(kinds, key=lambda kind: (kind not in (PEAK, VALLEY), kind))


def legend_entry(label: str, **look: Any) -> Line2D:
    """A line of a legend."""
    from matplotlib.lines import Line2D

    return Line2D([], [], label=label, **look)


def draw_legend(figure: Figure, entries: Sequence[Any]) -> None:
    """One legend for all panels, below them where no curve can be, in as many columns as there is room for."""
    if not entries:
        return
    widths = [HANDLE_WIDTH + LETTER_WIDTH * len(str(each.get_label())) for each in entries]
    room = float(figure.get_figwidth())
    columns = len(entries)
    # A legend fills its columns one after another; the widest entry of each counts.
    while columns > 1 and sum(max(column) for column in _columns(widths, columns)) > room:
        columns -= 1
    figure.legend(handles=list(entries), loc="outside lower center", ncols=columns, frameon=False)


def _columns(widths: Sequence[float], columns: int) -> list[Sequence[float]]:
    """The entries of a legend by columns, the first ones one longer if they do not come out even."""
    least, longer = divmod(len(widths), columns)
    ends = [(least + 1) * min(column, longer) + least * max(0, column - longer) for column in range(columns + 1)]
    return [widths[begin:end] for begin, end in pairwise(ends)]


def within(text: str, width: float, letters: float = LETTERS) -> str:
    """A text as a title of `width` [inch], cut if it must be: the name of a tour names all its shapes."""
    most = max(8, math.floor(letters * width))
    return text if len(text) <= most else f"{text[: most - 3].rstrip(' ,')}..."


def dress(panel: Axes, label: str) -> None:
    """Labels, a light grid, no box."""
    panel.set_xlabel(X_LABEL)
    panel.set_ylabel(label)
    panel.grid(visible=True, linewidth=0.4, color="#dddddd")
    panel.set_axisbelow(True)
    panel.spines[["top", "right"]].set_visible(False)


def clamp_shown(display: Display) -> float:
    """Length [m] of bearing to draw: display files allow point clamps, whose direction must show all the same."""
    return max(display.clamp, 0.03 * display.span)


def draw_node(panel: Axes, pivot: tuple[float, float], tangent: tuple[float, float], clamp: float) -> None:
    """A node as its `pivot` [m] and the stretch of rod, `clamp` [m] long, that its bearing holds along `tangent`."""
    x, y = (to_mm(part) for part in pivot)
    across, up = (0.5 * to_mm(clamp) * part for part in tangent)
    bearing: dict[str, Any] = {"linewidth": 6.0, "alpha": 0.35, "solid_capstyle": "butt"}
    panel.plot([x - across, x + across], [y - up, y + up], color=DARK, **bearing)
    panel.plot([x], [y], **HUB)

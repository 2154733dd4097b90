"""Lines of an SVG file, as Inkscape, Illustrator, Figma or a person write it, in the units of its page."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import NoReturn

import numpy as np

from curveline.drawings.drawing import MOST_POINTS, Array
from curveline.drawings.lengths import UNITS, in_mm, is_physical, metres_of, size_in_mm
from curveline.drawings.sketch import ERROR, HowToRead, Piece, Sketch, refuse_line
from curveline.drawings.svg_matrices import IDENTITY, after, shift, transform_of, viewport
from curveline.drawings.svg_shapes import SHAPES, length_of, lines_of, metres_of_length, numbers_of
from curveline.drawings.xml_tree import Element, parse_xml
from curveline.phrases import counted
from curveline.units import plain

LABEL = "inkscape:label"
UNSEEN = ("defs", "symbol", "clipPath", "mask", "pattern", "marker", "metadata", "style", "title", "desc", "script")
"""Elements that are not drawn where they stand."""
LEFT_OUT = ("text", "image", "foreignObject")
"""What is drawn, and is no line."""
MOST_USED = 10_000
"""Elements that are drawn because others use them, each time that they do."""
LONGEST_STYLE = 100_000
"""Letters of a style sheet that are looked at."""
_CLASS = re.compile(r"(?:^|,)\s*\.([\w-]+)\s*(?=,|$)")
_HIDDEN = re.compile(r"(?:^|;)\s*(?:display\s*:\s*none|visibility\s*:\s*(?:hidden|collapse))")


@dataclass(frozen=True)
class _Page:
    """The page: metres per unit, 0 if unknown; its matrix from the units of the root; how high, in the page's units."""

    unit: float
    matrix: Array
    height: float
    said: str


def read(data: bytes, how: HowToRead, name: str) -> Sketch:
    """The lines of an SVG file, y turned up; InvalidInput for one without a unit, damaged, or without lines."""
    root = parse_xml(data, name)
    if root.tag != "svg":
        refuse_line(name, root.line, "another-kind", f"its first element is {root.tag[:40]!r}, not svg", "name an SVG")
    page = _page(root, how, name)
    walker = _Walker(root, ERROR / page.unit if page.unit else 0.0, name)
    pieces: list[Piece] = []
    points = 0
    for element, matrix, names in walker.shapes(page.matrix):
        for line in walker.lines(element, matrix):
            points += len(line)
            if points > MOST_POINTS:
                hint = "keep only the curve, and save it again"
                refuse_line(name, element.line, "too-large", f"its lines have more than {MOST_POINTS} points", hint)
            pieces.append(Piece(np.column_stack([line[:, 0], page.height - line[:, 1]]), names, element.line))
    said = page.said
    left = ", ".join(counted(count, tag) for tag, count in sorted(walker.left_out.items()))
    if not pieces:
        message = "there is no line in this file" + (f", only {left}" if left else "")
        hint = "convert it to paths first: Object to Path, or Trace Bitmap" if left else "draw one line, and show it"
        refuse_line(name, root.line, "no-curve", message, hint)
    if left:
        said += f", {left} left out"
    return Sketch(tuple(pieces), page.unit, said)


def _page(root: Element, how: HowToRead, name: str) -> _Page:
    """Where the units of an SVG file come from: its width and height, or whoever asks."""
    box = _view_box(root, name)
    sizes = [length_of(root.get(side)) for side in ("width", "height")]
    told = [size for size in sizes if size and is_physical(size[1]) and size[0] > 0.0]
    written = " x ".join(root.get(side) for side in ("width", "height") if root.get(side))
    shown = f"viewBox {' '.join(map(plain, box))}" if box else "no viewBox"
    if how.unit or how.width_mm is not None or not told:
        if not how.unit and how.width_mm is None:
            what = f"its size is {written[:40]}" if written else "it has no size"
            _refuse_unit(root, what, name)
        height = box[1] + box[3] if box else (sizes[1][0] if sizes[1] else 0.0)
        said = f"SVG of {written[:40] or 'no size'}, {shown}"
        if how.width_mm is not None:
            return _Page(0.0, IDENTITY, height, f"{said}, y down turned up")
        unit = metres_of(how.unit)
        return _Page(unit, IDENTITY, height, f"{said}, 1 unit = {in_mm(unit)} mm as asked, y down turned up")
    wide, high = (metres_of_length(*size) / UNITS["mm"] if size else 0.0 for size in sizes)
    if box is None:
        scale = UNITS["px"] / UNITS["mm"]
        matrix = IDENTITY * scale
        high = high or 0.0
    else:
        wide, high = wide or high * box[2] / box[3], high or wide * box[3] / box[2]
        matrix = viewport((0.0, 0.0, wide, high), box, root.get("preserveAspectRatio"))
        scale = float(matrix[0, 0])
    said = f"SVG of {size_in_mm(wide * UNITS['mm'], high * UNITS['mm'])}, {shown}"
    said += f", 1 unit = {in_mm(scale * UNITS['mm'])} mm, y down turned up"
    return _Page(UNITS["mm"], matrix, high, said)


def _refuse_unit(root: Element, what: str, name: str) -> NoReturn:
    hint = (
        "say what 1 unit is: --unit px as Inkscape and Figma mean it (96 an inch), --unit pt as Illustrator does (72), "
        "--unit mm; or how wide the curve is: --width-mm 500"
    )
    refuse_line(name, root.line, "no-unit", f"{what}, which says nothing in mm or inch", hint)


def _view_box(element: Element, name: str) -> tuple[float, float, float, float] | None:
    text = element.get("viewBox").strip()
    if not text:
        return None
    try:
        x, y, wide, high = numbers_of(text)
    except ValueError:
        wide = high = 0.0
    if not (wide > 0.0 and high > 0.0 and np.isfinite([x, y, wide, high]).all()):
        hint = "it has four numbers: left, top, width and height"
        refuse_line(name, element.line, "view-box", f"its viewBox is {text[:40]!r}", hint)
    return x, y, wide, high


@dataclass(frozen=True)
class _Visit:
    """An element on the way through a file, with what holds where it stands."""

    element: Element
    matrix: Array
    groups: tuple[str, ...] = ()
    using: tuple[str, ...] = ()


def _hidden_in(sheet: str) -> Iterator[str]:
    """The classes that a style sheet hides."""
    for rule in sheet[:LONGEST_STYLE].split("}"):
        selectors, _, style = rule.partition("{")
        if _HIDDEN.search(style):
            yield from (found[1] for found in _CLASS.finditer(selectors))


class _Walker:
    """Goes through the elements that are drawn, each with its matrix and names."""

    def __init__(self, root: Element, error: float, name: str) -> None:
        self.root, self.error, self.name = root, error, name
        self.by_id = {each.get("id"): each for each in root.walk() if each.get("id")}
        self.hidden = {each for sheet in root.walk() if sheet.tag == "style" for each in _hidden_in(sheet.text)}
        self.left_out: Counter[str] = Counter()
        self._numbers: Counter[str] = Counter()

    def shapes(self, matrix: Array) -> Iterator[tuple[Element, Array, tuple[str, ...]]]:
        """Every shape that is drawn, its matrix to the page, and its names from its own to its outermost group's."""
        pending = [_Visit(each, matrix) for each in reversed(self.root.children)]
        used = 0
        while pending:
            visit = pending.pop()
            element = visit.element
            used += bool(visit.using)
            if used > MOST_USED:
                message, hint = (
                    f"more than {MOST_USED} elements are used again",
                    "keep only the curve, and save it again",
                )
                refuse_line(self.name, element.line, "too-large", message, hint)
            if element.tag in UNSEEN and not (visit.using and element.tag == "symbol"):
                continue
            if self._is_hidden(element):
                continue
            if element.get("transform"):
                visit = replace(visit, matrix=after(visit.matrix, self._transform(element)))
            if element.tag in SHAPES:
                yield element, visit.matrix, (*self._names(element), *visit.groups)
            elif element.tag in LEFT_OUT:
                self.left_out[element.tag] += 1
            else:
                pending.extend(reversed(list(self._inside(visit))))

    def lines(self, element: Element, matrix: Array) -> list[Array]:
        """The lines of a shape; InvalidInput for one that is damaged."""
        try:
            with np.errstate(all="raise", under="ignore"):
                return lines_of(element, matrix, self.error)
        except Exception as error:  # svgelements meets damaged paths with errors of many kinds
            self._refuse(element, str(error) if type(error) is ValueError and str(error) else "its shape is damaged")

    def _is_hidden(self, element: Element) -> bool:
        if element.get("display") == "none" or element.get("visibility") in ("hidden", "collapse"):
            return True
        return bool(_HIDDEN.search(element.get("style")) or self.hidden & set(element.get("class").split()))

    def _transform(self, element: Element) -> Array:
        try:
            return transform_of(element.get("transform"))
        except ValueError as error:
            self._refuse(element, str(error))

    def _refuse(self, element: Element, what: str) -> NoReturn:
        hint = "save the drawing again, or draw this line anew"
        refuse_line(self.name, element.line, "damaged", f"<{element.tag[:40]}> cannot be read: {what}", hint)

    def _names(self, element: Element) -> tuple[str, ...]:
        """Label, then id of an element; of a shape without either its kind and number."""
        names = tuple(dict.fromkeys(each for each in (element.get(LABEL), element.get("id")) if each))
        if element.tag in SHAPES:
            self._numbers[element.tag] += 1
            names = names or (f"{element.tag} {self._numbers[element.tag]}",)
        return names

    def _inside(self, visit: _Visit) -> Iterator[_Visit]:
        """What a group, a page in the page, or a use of another element shows."""
        element = visit.element
        groups = (*self._names(element), *visit.groups)
        if element.tag != "use":
            matrix = after(visit.matrix, self._viewport(element)) if element.tag in ("svg", "symbol") else visit.matrix
            yield from (_Visit(child, matrix, groups, visit.using) for child in element.children)
            return
        link = (element.get("href") or element.get("xlink:href")).strip()
        target = self.by_id.get(link.removeprefix("#"))
        if target is None:
            self._refuse(element, f"there is no element {link[:40]!r} to be used")
        if link in visit.using:
            self._refuse(element, f"{link[:40]!r} uses itself")
        moved = after(visit.matrix, shift(self._number(element, "x"), self._number(element, "y")))
        yield _Visit(target, moved, groups, (*visit.using, link))

    def _number(self, element: Element, name: str) -> float:
        found = length_of(element.get(name) or "0")
        if found is None:
            self._refuse(element, f"{name} is {element.get(name)[:40]!r}")
        return found[0] if not found[1] else metres_of_length(*found) / UNITS["px"]

    def _viewport(self, element: Element) -> Array:
        """The matrix of a page in the page."""
        x, y = (self._number(element, side) for side in ("x", "y"))
        box = _view_box(element, self.name)
        if box is None or not (element.get("width") and element.get("height")):
            return shift(x, y)
        place = (x, y, self._number(element, "width"), self._number(element, "height"))
        return viewport(place, box, element.get("preserveAspectRatio"))

"""A tree of XML elements with their lines, of files that mean no good as well: no entities in entities, no depth."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field
from xml.parsers import expat

from curveline.drawings.sketch import refuse_line

DEEPEST = 200
MOST_ELEMENTS = 300_000
LONGEST_ENTITY = 1000
"""Letters that an entity may stand for: Illustrator abbreviates the names of its namespaces by entities."""


@dataclass(eq=False)
class Element:
    """An element with its `tag` and attributes without prefixes, but for those of labels; `line` counts from 1."""

    tag: str
    attributes: dict[str, str]
    line: int
    children: list[Element] = field(default_factory=list)
    text: str = ""  # of a style sheet

    def get(self, name: str, default: str = "") -> str:
        """An attribute."""
        return self.attributes.get(name, default)

    def walk(self) -> Iterator[Element]:
        """This element and all below it, in the order of the file."""
        pending = [self]
        while pending:
            element = pending.pop()
            yield element
            pending.extend(reversed(element.children))


class _Builder:
    """Makes the tree as the file goes by, and refuses what only attacks have."""

    def __init__(self, name: str) -> None:
        self.name = name
        self.parser = expat.ParserCreate()
        self.parser.buffer_text = True
        self.parser.StartElementHandler = self.begin
        self.parser.EndElementHandler = self.end
        self.parser.CharacterDataHandler = self.text
        self.parser.EntityDeclHandler = self.entity
        self.root: Element | None = None
        self.path: list[Element] = []
        self.count = 0

    def begin(self, tag: str, attributes: dict[str, str]) -> None:
        line = self.parser.CurrentLineNumber
        self.count += 1
        if len(self.path) >= DEEPEST or self.count > MOST_ELEMENTS:
            what = f"elements nested {DEEPEST} deep" if self.count <= MOST_ELEMENTS else f"{MOST_ELEMENTS} elements"
            refuse_line(
                self.name, line, "too-large", f"no drawing has {what}", "keep only the curve, and save it again"
            )
        element = Element(tag.rpartition(":")[2], attributes, line)
        if self.path:
            self.path[-1].children.append(element)
        else:
            self.root = element
        self.path.append(element)

    def end(self, tag: str) -> None:
        self.path.pop()

    def text(self, text: str) -> None:
        if self.path[-1].tag == "style":
            self.path[-1].text += text

    def entity(self, entity: str, is_parameter: int, value: str | None, *where: str | None) -> None:
        line = self.parser.CurrentLineNumber
        if is_parameter or value is None or "&" in value or "%" in value or len(value) > LONGEST_ENTITY:
            message = f"the entity {entity[:40]!r} stands for other entities, other files, or for very much"
            hint = "save the drawing as plain SVG, without entities"
            refuse_line(self.name, line, "entity", message, hint)


def parse_xml(data: bytes, name: str) -> Element:
    """The root of an XML file; InvalidInput for one that is damaged, cut off, or made to take forever."""
    builder = _Builder(name)
    try:
        builder.parser.Parse(data, True)
    except expat.ExpatError as error:
        is_cut = error.code in _CUT and error.lineno >= data.count(b"\n")
        what = "the file ends before its drawing does" if is_cut else f"this is no XML: {expat.ErrorString(error.code)}"
        hint = "it was not copied or saved to its end: save it again" if is_cut else "save the drawing again as SVG"
        refuse_line(name, error.lineno, "cut-off" if is_cut else "damaged", what, hint)
    except (ValueError, LookupError) as error:  # an encoding that Python does not know, or a zero character
        refuse_line(name, 1, "damaged", f"this is no XML: {error}", "save the drawing again as SVG, in UTF-8")
    assert builder.root is not None, "expat refuses files without an element"
    return builder.root


_CUT = {
    expat.errors.codes[text]
    for text in (
        expat.errors.XML_ERROR_NO_ELEMENTS,
        expat.errors.XML_ERROR_UNCLOSED_TOKEN,
        expat.errors.XML_ERROR_PARTIAL_CHAR,
        expat.errors.XML_ERROR_UNCLOSED_CDATA_SECTION,
    )
}

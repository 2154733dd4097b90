"""SVG files as programs and people write them: exact, to scale, and refused where nobody can know the scale."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from curveline.drawings.reading import read_drawing
from curveline.drawings.sketch import HowToRead
from drawings.curves import arc, bezier, off, refusal

Write = Callable[[str, str | bytes], Path]

EXACT = 0.02
"""How far [mm] a drawing may be from what was drawn: the bound is 0.01."""

INKSCAPE = """<?xml version="1.0" encoding="UTF-8" standalone="no"?>
<!-- Created with Inkscape (http://www.inkscape.org/) -->
<svg width="600mm" height="297mm" viewBox="0 0 600 297" version="1.1" id="svg5"
   xmlns:inkscape="http://www.inkscape.org/namespaces/inkscape" xmlns="http://www.w3.org/2000/svg">
  <defs id="defs2"><path id="unseen" d="M 0,0 H 9" /></defs>
  <g inkscape:label="Layer 1" inkscape:groupmode="layer" id="layer1" transform="translate(20,-3)">
    <g transform="rotate(-90 100 100) scale(2,1)" id="g1">
      <path style="fill:none;stroke:#000000" d="M 10,10 C 20,200 60,250 90,430" id="path816" inkscape:label="hill" />
    </g>
  </g>
</svg>
"""

ILLUSTRATOR = """<?xml version="1.0" encoding="iso-8859-1"?>
<!-- Generator: Adobe Illustrator 27.0.0 \xe9 -->
<!DOCTYPE svg PUBLIC "-//W3C//DTD SVG 1.1//EN" "http://www.w3.org/Graphics/SVG/1.1/DTD/svg11.dtd" [
  <!ENTITY ns_svg "http://www.w3.org/2000/svg">
]>
<svg version="1.1" id="Layer_1" xmlns="&ns_svg;" x="0px" y="0px" SIZE viewBox="0 0 1500 400" xml:space="preserve">
<style type="text/css">.st0{fill:none;stroke:#000000;} .st1 {display:none}</style>
<path class="st0" d="M0,300c250-250,500-250,750,0s500,250,750,0"/>
<path class="st1" d="M0,300h1500"/>
</svg>
""".encode("latin-1")

FIGMA = """<svg width="1900" height="400" viewBox="0 0 1900 400" fill="none" xmlns="http://www.w3.org/2000/svg">
<path d="M0 300C475 0 1425 0 1900 300" stroke="black"/>
</svg>
"""


def svg(inside: str, head: str = 'width="600mm" height="200mm" viewBox="0 0 600 200"') -> str:
    return f'<svg xmlns="http://www.w3.org/2000/svg" {head}>\n{inside}\n</svg>\n'


def test_what_inkscape_writes_is_read_with_all_its_transforms(write: Write) -> None:
    drawing = read_drawing(write("hill.svg", INKSCAPE))
    local = bezier((10, 10), (20, 200), (60, 250), (90, 430)) * [2.0, 1.0]
    # A turn by -90 degrees about 100, 100: what was right of it comes above it. Then the layer, then y up.
    x, y = 100 + (local[:, 1] - 100), 100 - (local[:, 0] - 100)
    assert off(drawing, np.column_stack([x + 20, 297 - (y - 3)])) < EXACT
    assert "SVG of 600 x 297 mm, viewBox 0 0 600 297, 1 unit = 1 mm, y down turned up" in drawing.understood
    assert "curve 'hill'" in drawing.understood


@pytest.mark.parametrize(("size", "unit"), [(b'width="1500pt" height="400pt"', ""), (b'width="1500px"', "pt")])
def test_what_illustrator_writes_is_72_an_inch(size: bytes, unit: str, write: Write) -> None:
    path = write("wave.svg", ILLUSTRATOR.replace(b"SIZE", size))
    drawing = read_drawing(path, HowToRead(unit=unit))
    wave = np.vstack(
        [
            bezier((0, 300), (250, 50), (500, 50), (750, 300)),
            bezier((750, 300), (1000, 550), (1250, 550), (1500, 300)),
        ]
    )
    assert off(drawing, (wave * [1, -1] + [0, 400]) * 25.4 / 72) < EXACT


def test_pixels_are_no_unit_until_somebody_says_so(write: Write) -> None:
    path = write("figma.svg", FIGMA)
    code, message, hint, line = refusal(path)
    assert (code, line) == ("no-unit", 1)
    assert "1900 x 400" in message
    assert "--unit px" in hint
    truth = bezier((0, 100), (475, 400), (1425, 400), (1900, 100))
    assert off(read_drawing(path, HowToRead(unit="px")), truth * 25.4 / 96) < EXACT
    assert off(read_drawing(path, HowToRead(width_mm=500.0)), truth * 500 / 1900) < EXACT
    assert "1 unit = 0.264583 mm as asked" in read_drawing(path, HowToRead(unit="px")).understood
    assert "for a width of 500 mm" in read_drawing(path, HowToRead(width_mm=500.0)).understood


@pytest.mark.parametrize(
    ("head", "scale", "shift"),
    [
        ('width="500mm" height="100mm" viewBox="0 0 1000 200"', (0.5, 0.5), (0, 0)),
        ('width="50cm" height="10cm" viewBox="100 50 1000 200"', (0.5, 0.5), (-50, -25)),
        ('width="10in" viewBox="0 0 1000 200"', (0.254, 0.254), (0, 0)),
        ('width="500mm" height="300mm" viewBox="0 0 1000 200"', (0.5, 0.5), (0, 100)),
        (
            'width="700mm" height="100mm" viewBox="0 0 1000 200" preserveAspectRatio="xMaxYMin meet"',
            (0.5, 0.5),
            (200, 0),
        ),
        ('width="500mm" height="300mm" viewBox="0 0 1000 200" preserveAspectRatio="none"', (0.5, 1.5), (0, 0)),
        (
            'width="600mm" height="100mm" viewBox="0 0 1000 200" preserveAspectRatio="xMinYMid slice"',
            (0.6, 0.6),
            (0, -10),
        ),
        ('width="500mm" height="100mm"', (25.4 / 96, 25.4 / 96), (0, 0)),
    ],
)
def test_a_view_box_is_put_on_its_page_as_browsers_do(
    head: str, scale: tuple[float, float], shift: tuple[float, float], write: Write
) -> None:
    drawing = read_drawing(write("page.svg", svg('<path d="M100,150 Q500,-50 900,150"/>', head)))
    high = {'width="10in"': 0.254 * 200, 'width="50cm"': 100}.get(head.split(" ")[0])
    high = high or float(head.partition('height="')[2].partition("mm")[0])
    truth = bezier((100, 150), (500, -50), (900, 150)) * scale + shift
    assert off(drawing, truth * [1, -1] + [0, high]) < EXACT


def test_lengths_and_commands_of_all_kinds(write: Write) -> None:
    path = "m10,100h50v-20l30,20a100,100 0 0 1 200,0A50,25 90 0 0 340,100q20-40 40,0t40,0L500,100"
    drawing = read_drawing(write("all.svg", svg(f'<path d="{path}"/>')))
    # Both arcs are over chords of 200 and 50 mm: a half circle upwards, and the lower half of an ellipse lying down.
    half = arc((190, 100), 100, 180, 0)
    ellipse = arc((315, 100), 1.0, 180, 360)
    ellipse = (ellipse - [315, 100]) * [25, 50] + [315, 100]
    q1, q2 = bezier((340, 100), (360, 140), (380, 100)), bezier((380, 100), (400, 60), (420, 100))
    truth = np.vstack([[[10, 100], [60, 100], [60, 120], [90, 100]], half, ellipse, q1, q2, [[500, 100]]])
    assert off(drawing, truth) < EXACT


@pytest.mark.parametrize(
    "shape",
    [
        '<polyline points="0,150 100,50 300 120,500,150"/>',
        '<polyline points="0.0e0,15e1,100,50,300,120 500,150"/>',
        '<path d="M0 150 100 50 300 120 500 150"/>',
        '<line x1="0" y1="150" x2="100" y2="50"/><line x1="300" y1="120" x2="100" y2="50"/>'
        '<line x1="300" y1="120" x2="500mm" y2="150"/>'.replace("500mm", str(500)),
        '<path d="M0 150L100 50M300 120L500 150M100 50L300 120"/>',
        '<svg x="100" y="50" width="400" height="100" viewBox="0 0 4 1"><path d="M-1 1 0 0 2 .7 4 1"/></svg>',
        '<symbol id="s"><path d="M0 0 100-100 300-30 500 0"/></symbol><use href="#s" y="150"/>',
        '<g id="a"><path id="p" d="M0 150 100 50"/></g><use xlink:href="#p" transform="translate(0,0)"/>'
        '<path d="M100 50 300 120 500 150"/>',
        '<g style="display: none"><path d="M0 0h9"/></g><path d="M0 150 100 50 300 120 500 150"/><text>a</text>',
    ],
)
def test_one_line_in_many_ways(shape: str, write: Write) -> None:
    truth = np.array([[0, 50], [100, 150], [300, 80], [500, 50]])
    drawing = read_drawing(write("line.svg", svg(shape)))
    np.testing.assert_allclose(drawing.points * 1e3, truth, atol=1e-9)


@pytest.mark.parametrize(("edge", "sign"), [("upper", 1), ("lower", -1)])
def test_an_outline_has_two_edges(edge: str, sign: int, write: Write) -> None:
    path = write("disc.svg", svg('<ellipse cx="300" cy="100" rx="250" ry="80"/>'))
    code, _, hint, _ = refusal(path)
    assert code == "closed"
    assert f"--edge {edge}" in hint
    drawing = read_drawing(path, HowToRead(edge=edge))
    half = arc((0, 0), 1, 180, 180 - 180 * sign)
    assert off(drawing, half * [250, 80] + [300, 100]) < EXACT


def test_the_walls_of_an_outline_are_no_part_of_its_edge(write: Write) -> None:
    path = write("car.svg", svg('<path d="M0 200V120C100 20 400 20 500 120V200Z"/>'))
    drawing = read_drawing(path, HowToRead(edge="upper"))
    assert off(drawing, bezier((0, 80), (100, 180), (400, 180), (500, 80))) < EXACT
    flat = read_drawing(path, HowToRead(edge="lower"))
    np.testing.assert_allclose(flat.points * 1e3, [[0, 0], [500, 0]], atol=1e-9)


def test_round_corners(write: Write) -> None:
    path = write("box.svg", svg('<rect x="100" y="50" width="400" height="100" rx="40"/>'))
    drawing = read_drawing(path, HowToRead(edge="upper"))
    truth = np.vstack([arc((140, 110), 40, 180, 90), arc((460, 110), 40, 90, 0)])
    assert off(drawing, truth) < EXACT


SEVERAL = """<g inkscape:label="roofs" xmlns:inkscape="i">
<path id="old" d="M0 100h250"/><path id="new" d="M250 100h250"/></g>
<path id="hill" d="M0 150 Q250 0 500 150"/><path d="M0 180h500"/>"""


def test_several_curves_have_names(write: Write) -> None:
    path = write("town.svg", svg(SEVERAL))
    code, message, hint, _ = refusal(path)
    assert (code, message) == ("several-curves", "there are 3 curves in it")
    assert "'roofs', 'hill', 'path 4'" in hint
    code, _, hint, _ = refusal(path, curve="hil")
    assert code == "no-such-curve"
    assert "'hill'" in hint
    for name in ("roofs", "hill", "path 4"):
        drawing = read_drawing(path, HowToRead(curve=name))
        assert drawing.points[-1, 0] == pytest.approx(0.5)
        assert f"curve '{name}'" in drawing.understood


def test_a_gap_says_where_and_how_wide(write: Write) -> None:
    code, message, _, line = refusal(write("gap.svg", svg('<g>\n<path d="M0 100H200M203 96H500"/>\n</g>')))
    assert (code, line) == ("gap", 3)
    assert "a gap of 5 mm, from 200, 100 mm to 203, 104 mm" in message


def test_a_gap_that_is_none_is_joined(write: Write) -> None:
    drawing = read_drawing(write("nogap.svg", svg('<path d="M0 100H200M200.006 100.006H500"/>')))
    assert "2 pieces joined" in drawing.understood


def test_branches_are_refused(write: Write) -> None:
    assert refusal(write("fork.svg", svg('<path d="M0 100H200M200 100L500 50M200 100L500 150"/>')))[0] == "fork"


ENTITIES = '<!DOCTYPE svg [<!ENTITY a "ha"><!ENTITY b "&a;&a;&a;&a;">]>' + svg('<path d="M0 0h500"/><text>&b;</text>')
USES = "".join(f'<g id="g{k}">' + f'<use href="#g{k + 1}"/>' * 10 + "</g>" for k in range(12))


@pytest.mark.parametrize(
    ("text", "code"),
    [
        (ENTITIES, "entity"),
        (ENTITIES.replace('"&a;&a;&a;&a;"', 'SYSTEM "/etc/passwd"'), "entity"),
        (svg("<g>" * 500 + "</g>" * 500), "too-large"),
        (svg(f'<defs>{USES}<path id="g12" d="M0 0h1"/></defs><use href="#g0"/>'), "too-large"),
        (svg('<g id="a"><use href="#a"/></g>'), "damaged"),
        (svg('<use href="#nobody"/>'), "damaged"),
        (svg('<path d="M0 0 L 100"/>'), "damaged"),
        (svg('<path d="M0 0 L 100 5 ! L 500 0"/>'), "damaged"),
        (svg('<path d="M0 0 L 1e999 5"/>'), "damaged"),
        (svg('<path d="M0 0 L 1e9 5"/>'), "far-away"),
        (svg('<path transform="turn(5)" d="M0 0h500"/>'), "damaged"),
        (svg('<path transform="scale(1e300)" d="M0 0h500"/>'), "damaged"),
        (svg('<polyline points="0 0 500"/>'), "damaged"),
        (svg('<polyline points="0 0 nan 4"/>'), "damaged"),
        (svg('<line x1="5em" x2="9"/>'), "damaged"),
        (svg('<path d="M0 0"/>'), "no-curve"),
        (svg('<path d="M5 5h0.001"/>'), "no-curve"),
        (svg(""), "no-curve"),
        (svg("<text>hill</text>"), "no-curve"),
        (svg('<path d="M0 0h500"/>', 'width="600mm" viewBox="0 0 0 0"'), "view-box"),
        (svg('<path d="M0 0h500"/>', 'width="100%" viewBox="0 0 600 200"'), "no-unit"),
        (svg('<path d="M0 0h500"/>', ""), "no-unit"),
        (svg('<path d="M0 0h500"/>')[:90], "cut-off"),
        (INKSCAPE[: INKSCAPE.index("</g>")], "cut-off"),
        (INKSCAPE.replace("</g>", "</q>", 1), "damaged"),
        ("<html><body><svg></svg></body></html>", "another-kind"),
    ],
)
def test_what_cannot_be_read_is_refused(text: str, code: str, write: Write) -> None:
    assert refusal(write("bad.svg", text))[0] == code


def test_a_width_for_a_curve_without_width(write: Write) -> None:
    assert refusal(write("wall.svg", svg('<path d="M5 0v100"/>')), width_mm=500.0)[0] == "no-width"


@pytest.mark.parametrize("encoding", ["utf-16", "iso-8859-1", "windows-1252"])
def test_other_encodings(encoding: str, write: Write) -> None:
    text = f'<?xml version="1.0" encoding="{encoding}"?>' + svg('<path id="Hügel" d="M0 100h500"/>')
    drawing = read_drawing(write("a.svg", text.encode(encoding)), HowToRead(curve="Hügel"))
    assert drawing.points[-1, 0] == pytest.approx(0.5)

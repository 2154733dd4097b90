"""Which reader a file goes to, what it is told, and what is not there."""

from __future__ import annotations

import sys
from collections.abc import Callable
from pathlib import Path

import pytest

from curveline.drawings.reading import KINDS, read_drawing
from curveline.drawings.sketch import HowToRead
from curveline.errors import InvalidInput, MissingExtra
from drawings.curves import refusal

Write = Callable[[str, str | bytes], Path]

SVG = '<svg width="500mm" viewBox="0 0 500 100"><path d="M0 0h500"/></svg>'
DXF = "0\nSECTION\n2\nENTITIES\n0\nENDSEC\n0\nEOF\n"
PNG = b"\x89PNG\r\n\x1a\n" + bytes(20)
JPEG = b"\xff\xd8\xff\xe0" + bytes(20)


@pytest.mark.parametrize(
    ("name", "content", "said"),
    [
        ("a.csv", SVG, "this file is SVG, and its name says CSV"),
        ("a.dxf", SVG, "this file is SVG, and its name says DXF"),
        ("a.svg", DXF, "this file is DXF, and its name says SVG"),
        ("a.svg", PNG, "this file is PNG, and its name says SVG"),
        ("a.jpg", PNG, "this file is PNG, and its name says JPEG"),
        ("a.png", JPEG, "this file is JPEG, and its name says PNG"),
        ("a.svg", "hello", "there is no SVG in this file"),
        ("a.dxf", "hello", "there is no DXF in this file"),
        ("a.png", "hello", "there is no PNG in this file"),
        ("a.svg", b"\x1f\x8b\x08" + bytes(9), "there is no SVG in this file"),
    ],
)
def test_a_file_is_what_its_name_says(name: str, content: str | bytes, said: str, write: Write) -> None:
    code, message, _, _ = refusal(write(name, content))
    assert (code, message) == ("another-kind", said)


def test_renaming_as_advised_helps(write: Write) -> None:
    path = write("a.dxf", SVG)
    _, _, hint, _ = refusal(path)
    assert hint.startswith("rename it to a.svg")
    assert read_drawing(path.rename(path.with_name("a.svg"))).points[-1, 0] == pytest.approx(0.5)


@pytest.mark.parametrize(
    ("name", "advice"),
    [
        ("a.dwg", "save it as DXF"),
        ("a.ai", "export it as SVG"),
        ("a.PDF", "export it as SVG"),
        ("a.webp", "save it as PNG"),
        ("a.xlsx", "save the sheet as CSV"),
        ("a.svgz", "gunzip"),
        ("a.md", ".csv"),
        ("drawing", ".csv"),
    ],
)
def test_other_kinds_are_refused_with_what_to_do(name: str, advice: str, write: Write) -> None:
    code, _, hint, _ = refusal(write(name, "x"))
    assert code == "kind"
    assert advice in hint


@pytest.mark.parametrize("suffix", sorted(KINDS))
def test_a_file_that_is_not_there(suffix: str, tmp_path: Path) -> None:
    assert refusal(tmp_path / f"none{suffix}")[0] == "no-such-file"
    (tmp_path / f"folder{suffix}").mkdir()
    assert refusal(tmp_path / f"folder{suffix}")[0] == "not-a-file"


def test_a_file_that_is_too_large(write: Write, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("curveline.drawings.reading.MAX_BYTES", {"SVG": 20})
    assert refusal(write("a.svg", SVG))[0] == "too-large"


@pytest.mark.parametrize(
    ("package", "name", "content"),
    [("svgelements", "a.svg", SVG), ("ezdxf", "a.dxf", DXF), ("PIL", "a.png", PNG), ("PIL", "a.jpg", JPEG)],
)
def test_a_package_that_is_missing_is_named(
    package: str, name: str, content: str | bytes, write: Write, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(sys.modules, package, None)
    with pytest.raises(MissingExtra, match="Pillow" if package == "PIL" else package) as caught:
        read_drawing(write(name, content))
    assert caught.value.hint == "pip install 'curveline[draw]'"


@pytest.mark.parametrize(
    "how",
    [{"unit": "mile"}, {"edge": "left"}, {"width_mm": 0.0}, {"width_mm": float("nan")}, {"unit": "mm", "width_mm": 9}],
)  # fmt: skip
def test_what_makes_no_sense_is_refused(how: dict[str, object]) -> None:
    with pytest.raises(InvalidInput) as caught:
        HowToRead(**how)  # type: ignore[arg-type]
    assert caught.value.hint

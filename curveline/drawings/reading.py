"""A drawing from a file, by its suffix and by what is in it."""

from __future__ import annotations

import importlib
from collections.abc import Callable, Mapping
from os import fspath
from pathlib import PurePath

from curveline.drawings.choosing import drawing_of
from curveline.drawings.drawing import Drawing
from curveline.drawings.sketch import HowToRead, Sketch
from curveline.errors import MissingExtra
from curveline.system.files import AnyPath, read_file, refuse_file

MAX_BYTES: Mapping[str, int] = {
    "CSV": 64_000_000,
    "SVG": 16_000_000,
    "DXF": 16_000_000,
    "PNG": 64_000_000,
    "JPEG": 64_000_000,
}
"""What takes less than half a minute to read."""
KINDS: Mapping[str, str] = {
    ".csv": "CSV",
    ".tsv": "CSV",
    ".txt": "CSV",
    ".svg": "SVG",
    ".dxf": "DXF",
    ".png": "PNG",
    ".jpg": "JPEG",
    ".jpeg": "JPEG",
}
"""What is read, by its suffix."""
READERS: Mapping[str, tuple[str, str, str]] = {
    "CSV": ("tables", "", ".csv"),
    "SVG": ("svg", "svgelements", ".svg"),
    "DXF": ("dxf", "ezdxf", ".dxf"),
    "PNG": ("pictures", "PIL", ".png"),
    "JPEG": ("pictures", "PIL", ".jpg"),
}
"""Kind -> the module here that reads it, the package which that needs, the suffix to give it."""
INSTEAD: Mapping[str, str] = {
    ".svgz": "unpack it with gunzip, or save it as plain SVG",
    ".dwg": "save it as DXF",
    ".dwt": "save it as DXF",
    **dict.fromkeys((".ai", ".eps", ".pdf", ".cdr", ".afdesign", ".fig", ".sketch", ".vsdx"), "export it as SVG"),
    **dict.fromkeys((".gif", ".bmp", ".tif", ".tiff", ".webp", ".heic", ".psd"), "save it as PNG"),
    **dict.fromkeys((".xls", ".xlsx", ".ods"), "save the sheet as CSV, with the columns x_mm and y_mm"),
    **dict.fromkeys((".step", ".stp", ".iges", ".igs", ".3dm"), "export the curve as DXF"),
}
"""What to do with files that people try."""


def read_drawing(path: AnyPath, how: HowToRead | None = None) -> Drawing:
    """The curve in a file: points in CSV, lines in SVG or DXF, the edge of a silhouette in PNG or JPEG.

    `Drawing.understood` says how it was read. InvalidInput for a file that cannot be read, does not say its unit, or
    has more than one curve, a gap or a closed outline and nobody said which; MissingExtra where a package is missing.
    """
    name, how = fspath(path), how or HowToRead()
    kind = _kind(name)
    data = read_file(path, MAX_BYTES[kind])
    if not data.strip():
        refuse_file(name, "empty", "this file is empty", "save the drawing again")
    found = kind_of_content(data)
    if found and found != kind:
        suffix = READERS[found][2]
        hint = f"rename it to {PurePath(name).stem}{suffix}, or name another file"
        refuse_file(name, "another-kind", f"this file is {found}, and its name says {kind}", hint)
    if not found and kind != "CSV":
        hint = f"save it as {kind} again; this may be another file, or what is left of one"
        refuse_file(name, "another-kind", f"there is no {kind} in this file", hint)
    return drawing_of(_reader(kind)(data, how, name), how, name)


def _kind(name: str) -> str:
    suffix = PurePath(name).suffix.lower()
    if suffix not in KINDS:
        message = f"drawings are not read from {suffix} files" if suffix else "the name of this file has no suffix"
        refuse_file(name, "kind", message, INSTEAD.get(suffix, f"name one that ends in {', '.join(KINDS)}"))
    return KINDS[suffix]


def kind_of_content(data: bytes) -> str:
    """What a file is by its first bytes; empty for what may be text of any kind."""
    if data.startswith(b"\x89PNG"):
        return "PNG"
    if data.startswith(b"\xff\xd8\xff"):
        return "JPEG"
    if data.startswith(b"AutoCAD Binary DXF"):
        return "DXF"
    head = data[:100_000].replace(b"\0", b"").lstrip(b"\xef\xbb\xbf\xff\xfe \t\r\n")
    if head.startswith(b"<"):
        return "SVG" if b"<svg" in head or b":svg" in head else ""
    words = head.split(None, 2)
    return "DXF" if words[:1] == [b"999"] or words[:2] == [b"0", b"SECTION"] else ""


def _reader(kind: str) -> Callable[[bytes, HowToRead, str], Sketch]:
    """What reads a kind of file; MissingExtra where it needs a package that is not there."""
    require_package(kind)
    module, _, _ = READERS[kind]
    reader: Callable[[bytes, HowToRead, str], Sketch] = importlib.import_module(f"curveline.drawings.{module}").read
    return reader


def require_package(kind: str) -> None:
    """MissingExtra where a kind of file needs a package that is not there."""
    package = READERS[kind][1]
    try:
        if package:
            importlib.import_module(package)
    except ImportError:
        raise MissingExtra(
            f"reading {kind} needs {'Pillow' if package == 'PIL' else package}, which is not installed",
            hint="pip install 'curveline[draw]'",
        ) from None

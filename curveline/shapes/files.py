"""Shape and display files: TOML in mm and degrees to a `Scene` in SI, or every problem of the file at once."""

from __future__ import annotations

import hashlib
import math
import os
import re
from collections.abc import Iterator, Mapping
from dataclasses import replace
from functools import cache
from importlib import resources
from importlib.resources.abc import Traversable

from curveline.errors import Diagnostic, InvalidInput
from curveline.scene import (
    DOWN,
    Axis,
    Display,
    Drive,
    Limits,
    Load,
    Node,
    Offsets,
    RadioSettings,
    Range,
    Scene,
    Segment,
    Vector,
)
from curveline.shapes.error_keys import check_errors, errors_of
from curveline.shapes.file_keys import (
    DisplayTable,
    DriveTable,
    LimitsTable,
    LoadTable,
    NodeTable,
    OffsetsTable,
    ShapeTable,
)
from curveline.shapes.library import builtin_shapes, given_shape
from curveline.shapes.profile_rules import profile_of
from curveline.shapes.rod_rules import rod_of
from curveline.shapes.rules import check_display, check_shape
from curveline.shapes.toml_document import Document, nearest, shown
from curveline.shapes.toml_location import KeyPath
from curveline.system.file_kinds import DISPLAY, SHAPE, refuse_other_kind
from curveline.system.files import AnyPath, decode_text, read_file, refuse_file, refuse_size
from curveline.system.given_files import GivenFile, is_stream, read_given
from curveline.units import deg, mm, nmm

QUANTITIES: Mapping[str, tuple[str, ...]] = {
    "nodes": ("height_mm", "angle_deg", "yaw_deg", "roll_deg"),
    "segments": ("length_mm",),
    "loads": ("at",),
}
"""Table of a shape file -> the keys in it whose numbers can be any in a range; besides these, the parts of a force."""

SAFE_PATH = re.compile(r"[^\\\x00-\x1f]*")
"""A path in quotes that means what it looks like, on every system."""

MAX_BYTES = 1_000_000
"""Size limit of a shape or display file; real ones have a few kilobytes."""


def read_shape(path: AnyPath) -> Scene:
    """The scene that a shape file describes, or a built-in shape by its name; a pipe will do, or `-`, standard input.

    InvalidInput lists every problem of the file, and of the display file that it names.
    """
    return ShapeFile.at(path).scene


class ShapeFile:
    """A shape file that was read, its scene, and that scene with other numbers in it.

    InvalidInput lists every problem of the file, and of the display file that it names.
    """

    def __init__(self, given: GivenFile) -> None:
        self._name = given.name
        if len(given.data) > MAX_BYTES:
            refuse_size(self._name, MAX_BYTES)
        self._digest = hashlib.sha256(given.data).hexdigest()
        text = decode_text(given.data, self._name)
        refuse_other_kind(text, self._name, SHAPE)
        self._document = Document(self._name, text, QUANTITIES)
        hint = "a shape needs name, display, nodes and segments: copy one of the examples in shapes/"
        _refuse_empty(self._document, hint)
        # What is of the wrong type must be known before the display is looked up by its name.
        model = self._document.validate(ShapeTable)
        self._display, self._elsewhere = _display_of(self._document, given.folder)
        self.scene = self._scene_of(self._document, model)

    @classmethod
    def at(cls, path: AnyPath) -> ShapeFile:
        """The one at a path, or the built-in one of a name; also through a pipe, or through standard input as `-`."""
        return cls(given_shape(path, MAX_BYTES))

    def varied(self, numbers: Mapping[KeyPath, float]) -> Scene:
        """The scene with `numbers` in place of those in the file, in the file's units.

        InvalidInput lists what would be wrong with a file that has them.
        """
        document = self._document.varied(numbers)
        return self._scene_of(document, document.validate(ShapeTable))

    def numbers(self) -> Iterator[KeyPath]:
        """Every place for a quantity that could be another one; where the file has none, its default stands."""
        for table, keys in QUANTITIES.items():
            for index, item in enumerate(self._document.get(table) or ()):
                yield from ((table, index, key) for key in keys)
                yield from ((table, index, "force_N", axis) for axis in range(len(item.get("force_N", ()))))

    def _scene_of(self, document: Document, model: ShapeTable | None) -> Scene:
        check_shape(document, self._display)
        if model is None or self._display is None or document.diagnostics():
            raise document.error(self._elsewhere)
        return _scene(model, self._display, self._name, self._digest)


def read_display(name_or_path: AnyPath, relative_to: AnyPath = "") -> Display:
    """A built-in display by name, or a display file by path, which a folder `relative_to` may precede.

    InvalidInput lists every problem of the file.
    """
    name = os.fspath(name_or_path)
    if name in builtin_displays():
        return _builtin_display(name)
    path = os.path.join(os.fspath(relative_to), os.path.expanduser(name))
    if not name.endswith(".toml") and not os.path.isfile(path):
        refuse_file(name, "unknown-display", f"there is no built-in display {shown(name)}", _hint_for_display(name))
    read = _display(read_file(path, MAX_BYTES), path, os.path.dirname(path))
    return replace(read, path=os.path.abspath(path))


def given_display(name_or_path: AnyPath) -> Display:
    """A display as somebody names it on a command line: as of `read_display`, or through a pipe, or `-`."""
    if is_stream(name_or_path):
        given = read_given(name_or_path, MAX_BYTES)
        return replace(_display(given.data, given.name, given.folder), path=given.name)
    return read_display(name_or_path)


@cache
def builtin_displays() -> tuple[str, ...]:
    """Names of the displays that come with the package."""
    folder = resources.files("curveline") / "shapes" / "displays"
    return tuple(sorted(entry.name[:-5] for entry in folder.iterdir() if entry.name.endswith(".toml")))


def builtin_text(name: str) -> str:
    """The file of a built-in display, for a lab to copy and change; InvalidInput if there is none of that name."""
    if name not in builtin_displays():
        refuse_file(name, "unknown-display", f"there is no built-in display {shown(name)}", _known_displays(name))
    return _builtin_file(name).read_text(encoding="utf-8")


@cache
def _builtin_display(name: str) -> Display:
    entry = _builtin_file(name)
    return _display(entry.read_bytes(), str(entry), "")


def _builtin_file(name: str) -> Traversable:
    return resources.files("curveline") / "shapes" / "displays" / f"{name}.toml"


def _display_of(document: Document, folder: str) -> tuple[Display | None, tuple[Diagnostic, ...]]:
    """The display that a shape names, and what is wrong in that display's own file."""
    name = document.get("display")
    if name is None:
        return None, ()
    try:
        return read_display(name, folder), ()
    except InvalidInput as error:
        first = error.diagnostics[0]
        # A display file may miss a file that it names itself.
        if first.code not in ("unknown-display", "no-such-file") or first.source:
            return None, error.diagnostics
        message = first.message if first.code == "unknown-display" else f"there is no display file {shown(first.path)}"
        escape = "write / between folders: in quotes a \\ begins an escape" if not SAFE_PATH.fullmatch(name) else ""
        document.problem(("display",), "unknown-display", message, escape or _hint_for_display(name))
        return None, ()


def _display(data: bytes, path: str, folder: str) -> Display:
    text = decode_text(data, path)
    refuse_other_kind(text, path, DISPLAY)
    document = Document(path, text)
    _refuse_empty(document, "copy the file of a built-in display and change it")
    model = document.validate(DisplayTable)
    check_display(document)
    check_errors(document)
    if model is None or document.diagnostics():
        raise document.error()
    profile, beside = profile_of(document, model.rod, folder)
    return Display(
        name=model.name,
        node_count=model.nodes,
        span=mm(model.span_mm),
        clamp=mm(model.clamp_mm),
        clamp_stiffness=_clamp_stiffness(model.clamp_stiffness_Nmm_per_deg),
        clamp_play=deg(model.clamp_play_deg),
        gravity=model.gravity is not False,
        down=_down(model.gravity),
        rod=rod_of(model.rod, profile),
        limits=_limits(model.limits),
        drive=_drive(model.drive),
        radio=RadioSettings(
            model.radio.channel, model.radio.data_rate, tuple(address.upper() for address in model.radio.addresses)
        ),
        digest=hashlib.sha256(data + beside).hexdigest(),
        errors=errors_of(model.errors),
        offsets=_offsets(model.offsets),
    )


def _offsets(table: OffsetsTable) -> Offsets:
    return Offsets(tuple(map(deg, table.angle_deg or ())), tuple(map(mm, table.length_mm or ())))


def _clamp_stiffness(per_degree: float | None) -> float:
    """In N m/rad from N mm/deg; infinite where the file gives none."""
    return math.inf if per_degree is None else nmm(per_degree) / deg(1.0)


def _refuse_empty(document: Document, hint: str) -> None:
    if not document.data:
        refuse_file(document.path, "empty", "the file says nothing", hint)


def _hint_for_display(name: str) -> str:
    if name in builtin_shapes():
        return f"{name} is a built-in shape, not a display: `curveline simulate {name}` takes it"
    return f"{_known_displays(name)}; a display of your own is a path that ends in .toml"


def _known_displays(name: str) -> str:
    known = list(builtin_displays())
    return f"{nearest(name, known)}built in: {', '.join(known)}"


def _scene(model: ShapeTable, display: Display, path: str, digest: str) -> Scene:
    return Scene(
        name=model.name,
        display=display,
        nodes=tuple(_node(node) for node in model.nodes),
        segments=tuple(Segment(mm(segment.length_mm), segment.state) for segment in model.segments),
        loads=tuple(_load(load) for load in model.loads),
        path=path,
        digest=digest,
    )


def _node(table: NodeTable) -> Node:
    return Node(mm(table.height_mm), deg(table.angle_deg), deg(table.yaw_deg), deg(table.roll_deg))


def _load(table: LoadTable) -> Load:
    across, up, *out = table.force_N
    return Load(table.segment - 1, table.at, (across, up), *out)


def _down(gravity: bool | list[float]) -> Vector:
    """The unit vector along which gravity acts."""
    if isinstance(gravity, bool):
        return DOWN
    x, y, z = (component / math.hypot(*gravity) for component in gravity)
    return x, y, z


def _limits(table: LimitsTable) -> Limits:
    return Limits(
        height=Range(*map(mm, table.height_mm)),
        angle=Range(*map(deg, table.angle_deg)),
        length=Range(*map(mm, table.length_mm)),
        yaw=Range(*map(deg, table.yaw_deg)),
        roll=Range(*map(deg, table.roll_deg)),
    )


def _drive(table: DriveTable) -> Drive:
    counts = table.counts_per_turn
    return Drive(
        extrude=Axis(counts / mm(table.extrude_mm_per_turn), mm(table.extrude_mm_per_s), mm(table.extrude_mm_per_s2)),
        bias=Axis(counts / deg(table.bias_deg_per_turn), deg(table.bias_deg_per_s), deg(table.bias_deg_per_s2)),
        translate=Axis(
            counts / mm(table.translate_mm_per_turn), mm(table.translate_mm_per_s), mm(table.translate_mm_per_s2)
        ),
        max_force=table.max_force_N,
        max_moment=nmm(table.max_moment_Nmm),
    )

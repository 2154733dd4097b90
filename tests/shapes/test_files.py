"""Valid files become scenes in SI; broken ones become diagnostics at the right place, and nothing else."""

from __future__ import annotations

import hashlib
import math
import os
import re
import time
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import NoReturn, get_args

import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from curveline import plan_file
from curveline.errors import Diagnostic, InvalidInput
from curveline.scene import Load, Node, Scene, Segment
from curveline.sections import Rectangle
from curveline.shapes.file_keys import RadioTable
from curveline.shapes.files import MAX_BYTES, builtin_displays, read_display, read_shape
from curveline.shapes.toml_document import MAX_DIAGNOSTICS
from curveline.system import given_files
from curveline.system.files import EXCERPT

HERE = Path(__file__).parents[1]
SHAPE = (HERE.parent / "shapes" / "level-up-peak.toml").read_bytes()
DISPLAY = (HERE.parent / "curveline" / "shapes" / "displays" / "single.toml").read_bytes()
BROKEN = sorted((HERE / "broken").rglob("*.toml"))


def problems(read: Callable[[], object]) -> tuple[Diagnostic, ...]:
    """The diagnostics of an input that must be refused."""
    with pytest.raises(InvalidInput) as caught:
        read()
    found = caught.value.diagnostics
    assert found
    assert all(d.hint and d.message and d.line >= 1 and d.column >= 1 for d in found)
    assert all(len(d.source) <= EXCERPT and "\n" not in d.source and "\x1b" not in d.source for d in found)
    return found


def places(found: tuple[Diagnostic, ...]) -> list[tuple[int, int, str]]:
    """Line, column and code of each diagnostic."""
    return [(d.line, d.column, d.code) for d in found]


def replaced(text: bytes, old: str, new: str) -> bytes:
    """`text` with a passage replaced that must occur in it."""
    assert old.encode() in text
    return text.replace(old.encode(), new.encode(), 1)


@pytest.fixture
def write(tmp_path: Path) -> Callable[[bytes], Path]:
    """Write the bytes of a shape file and return its path."""

    def write_bytes(data: bytes) -> Path:
        path = tmp_path / "shape.toml"
        path.write_bytes(data)
        return path

    return write_bytes


def test_a_shape_in_si(write: Callable[[bytes], Path]) -> None:
    data = SHAPE + b"\n[[loads]]\nsegment = 1\nat = 0.25\nforce_N = [0, -1.5]\n"
    path = write(data)
    scene = read_shape(path)
    assert scene.nodes == (Node(0.0, pytest.approx(0.5235987755982988)), Node(0.0, pytest.approx(-0.5235987755982988)))
    assert scene.segments == (Segment(pytest.approx(0.66), "peak"),)
    assert scene.loads == (Load(0, 0.25, (0.0, -1.5)),)
    assert scene.path == str(path)
    assert scene.digest == hashlib.sha256(data).hexdigest()


def test_the_display_in_si() -> None:
    display = read_display("single")
    assert (display.name, display.node_count, display.gravity) == ("single", 2, True)
    assert (display.span, display.clamp) == pytest.approx((0.5, 0.02))
    assert display.rod.youngs_modulus == pytest.approx(2.45e9)
    assert (display.rod.width, display.rod.thickness) == pytest.approx((0.01, 0.0024))
    assert display.rod.mass_per_length == pytest.approx(0.048)
    assert (display.limits.height.low, display.limits.length.high) == pytest.approx((-0.22, 0.9))
    assert display.limits.angle.high == pytest.approx(1.3089969389957472)
    assert display.drive.extrude.counts_per_unit == pytest.approx(8344 / 0.0377)
    assert display.drive.bias.counts_per_unit == pytest.approx(8344 / 2.0943951023931953)
    assert display.drive.translate.acceleration == pytest.approx(0.05)
    assert display.drive.max_moment == pytest.approx(0.5)
    assert display.radio.addresses == ("C1C1C1C101", "C1C1C1C102")
    assert display.digest == hashlib.sha256(DISPLAY).hexdigest()


def test_what_points_out_of_the_plane_in_si(write: Callable[[bytes], Path], tmp_path: Path) -> None:
    (tmp_path / "leaning.toml").write_bytes(replaced(DISPLAY, "gravity = true", "gravity = [0, -3, -4.0]"))
    turned = replaced(SHAPE, "angle_deg = -30.0", "angle_deg = -30.0, yaw_deg = 45, roll_deg = -720.0")
    pushed = b"\n[[loads]]\nsegment = 1\nat = 0.25\nforce_N = [0, -1.5, 2]\n"
    scene = read_shape(write(replaced(turned, '"single"', '"leaning.toml"') + pushed))
    assert scene.nodes[0] == Node(0.0, pytest.approx(math.pi / 6.0), 0.0, 0.0)
    assert scene.nodes[1] == Node(0.0, *map(pytest.approx, (-math.pi / 6.0, math.pi / 4.0, -4.0 * math.pi)))
    assert scene.loads == (Load(0, 0.25, (0.0, -1.5), 2.0),)
    assert scene.display.down == pytest.approx((0.0, -0.6, -0.8))
    assert scene.display.weight == pytest.approx((0.0, -0.6 * 0.048 * 9.80665, -0.8 * 0.048 * 9.80665))
    assert scene.beyond_the_plane[:2] == ("yaw at node 2", "roll at node 2")
    assert scene.beyond_the_plane[2:] == (
        "load 1 pushing out of the plane",
        "gravity that does not point straight down",
    )
    plain = read_shape(write(SHAPE))
    assert plain.beyond_the_plane == ()
    assert plain.display.weight == pytest.approx((0.0, -0.048 * 9.80665, 0.0))


def test_stiffness_in_twist_follows_from_the_rectangle_and_youngs_modulus_unless_given(tmp_path: Path) -> None:
    rod = read_display("single").rod
    assert rod.shear_modulus == pytest.approx(2.45e9 / 2.7)
    square = replace(rod, section=Rectangle(1.0, 1.0), shear_modulus=1.0)
    assert square.twisting_stiffness == pytest.approx(0.1405770, abs=1e-7)
    strip = replace(rod, section=Rectangle(width=1.0, thickness=0.001), shear_modulus=3.0)
    assert strip.twisting_stiffness == pytest.approx(1e-9 * (1.0 - 0.63025 * 0.001), rel=1e-6)
    upright = Rectangle(width=0.001, thickness=1.0)
    assert replace(strip, section=upright).twisting_stiffness == strip.twisting_stiffness
    given = "mass_g_per_m = 48.0\nshear_modulus_GPa = 0.5\nlateral_curvature_per_m = -0.25\n#"
    (tmp_path / "d.toml").write_bytes(replaced(DISPLAY, "mass_g_per_m = 48.0", given))
    own = read_display("d.toml", relative_to=tmp_path).rod
    assert (own.shear_modulus, own.lateral_curvature) == (pytest.approx(5e8), -0.25)


def test_a_display_may_keep_its_nodes_from_turning_out_of_the_plane(
    write: Callable[[bytes], Path], tmp_path: Path
) -> None:
    limits = read_display("single").limits
    assert (limits.yaw.high, limits.roll.low) == (pytest.approx(math.radians(75.0)), pytest.approx(-20.0 * math.pi))
    stiff = replaced(DISPLAY, "[drive]", "yaw_deg = [0, 0]\nroll_deg = [-90.0, 90.0]\n[drive]")
    (tmp_path / "stiff.toml").write_bytes(stiff)
    shape = replaced(SHAPE, '"single"', '"stiff.toml"')
    read_shape(write(shape))
    turned = replaced(shape, "angle_deg = -30.0", "angle_deg = -30.0, yaw_deg = 1.0, roll_deg = 91.0")
    yaw, roll = problems(lambda: read_shape(write(turned)))
    assert yaw.message == "node 2: yaw_deg is 1 deg, above the display's limit of 0 deg"
    assert roll.hint == "choose -90 to 90 deg"


def test_the_built_in_displays() -> None:
    assert set(builtin_displays()) == {"single", "quad"}
    single, quad = read_display("single"), read_display("quad")
    assert quad.node_count == len(set(quad.radio.addresses)) == 5
    assert (quad.limits, quad.drive, quad.span, quad.clamp) == (single.limits, single.drive, single.span, single.clamp)
    assert quad.rod.total_length > (quad.node_count - 1) * quad.limits.length.low


def test_accelerations_curvature_and_whole_numbers_are_optional(tmp_path: Path) -> None:
    lean = re.sub(rb"(natural_curvature_per_m|\w+_per_s2) = .*\n", b"", DISPLAY).replace(
        b"span_mm = 500.0", b"span_mm = 500"
    )
    (tmp_path / "lean.toml").write_bytes(lean)
    assert lean.count(b"\n") == DISPLAY.count(b"\n") - 4
    display = read_display("lean.toml", relative_to=tmp_path)
    assert (display.drive, display.rod, display.span) == (read_display("single").drive, read_display("single").rod, 0.5)


def test_a_display_file_is_found_beside_the_shape(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "own").mkdir()
    (tmp_path / "own" / "flat.toml").write_bytes(replaced(DISPLAY, "gravity = true", "gravity = false"))
    (tmp_path / "own" / "shape.toml").write_bytes(replaced(SHAPE, '"single"', '"flat.toml"'))
    monkeypatch.chdir(tmp_path)
    assert read_shape("own/shape.toml").display.gravity is False


def test_a_broken_display_file_is_reported_in_its_own_file(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "own").mkdir()
    (tmp_path / "own" / "d.toml").write_bytes(replaced(DISPLAY, "gravity = true", "gravity = 1"))
    (tmp_path / "own" / "shape.toml").write_bytes(replaced(replaced(SHAPE, '"single"', '"d.toml"'), "30.0", "nan"))
    monkeypatch.chdir(tmp_path)
    first, second = problems(lambda: read_shape("own/shape.toml"))
    assert (first.path, first.code, second.path, second.code) == (
        "own/shape.toml",
        "not-finite",
        "own/d.toml",
        "wrong-type",
    )
    line = DISPLAY[: DISPLAY.index(b"gravity")].count(b"\n") + 1
    assert (second.line, second.column, second.source) == (line, 11, second.source)
    assert second.source.startswith("gravity = 1")


def test_the_rod_of_all_segments_together(tmp_path: Path) -> None:
    quad = (HERE.parent / "curveline" / "shapes" / "displays" / "quad.toml").read_bytes()
    (tmp_path / "d.toml").write_bytes(replaced(quad, "total_length_mm = 4000.0", "total_length_mm = 2399.0"))
    nodes = "{ height_mm = 0, angle_deg = 0 }, " * 5
    segments = '{ length_mm = 600, state = "peak" }, ' * 4
    path = tmp_path / "shape.toml"
    path.write_text(f'name = "x"\ndisplay = "d.toml"\nnodes = [{nodes}]\nsegments = [{segments}]\n')
    (found,) = problems(lambda: read_shape(path))
    assert places((found,)) == [(4, 12, "too-long")]
    assert "2400 mm" in found.message
    assert "2399 mm" in found.message
    assert "tails of -0.5 mm at both ends" in found.message
    assert "take 1 mm off" in found.hint


def test_the_minimum_length_of_the_hint_is_enough_and_not_generous(write: Callable[[bytes], Path]) -> None:
    steep = replaced(
        replaced(SHAPE, "30.0", "70.0"), "height_mm = 0.0, angle_deg = -30.0", "height_mm = 200, angle_deg = 20.0"
    )
    (found,) = problems(lambda: read_shape(write(replaced(steep, "660.0", "501.0"))))
    enough = float(re.search(r"at least ([\d.]+)", found.hint)[1])  # type: ignore[index]
    assert found.code == "too-short"
    read_shape(write(replaced(steep, "660.0", f"{enough}")))
    (again,) = problems(lambda: read_shape(write(replaced(steep, "660.0", f"{enough - 0.11}"))))
    assert again.code == "too-short"


def test_a_straight_segment_may_be_as_long_as_the_way(write: Callable[[bytes], Path]) -> None:
    level = replaced(replaced(SHAPE, "angle_deg = 30.0", "angle_deg = 0.0"), "angle_deg = -30.0", "angle_deg = 0.0")
    flat = replaced(replaced(level, "660.0", "500.0"), '"peak"', '"straight"')
    (segment,) = read_shape(write(flat)).segments
    assert (segment.length, segment.state) == (0.5, "straight")
    raised = replaced(flat, "{ height_mm = 0.0", "{ height_mm = 30.0")
    for length, is_long_enough in (("500.9", True), ("500.88", False)):
        text = replaced(raised, "500.0", length)
        if is_long_enough:
            read_shape(write(text))
            continue
        (found,) = problems(lambda text=text: read_shape(write(text)))  # type: ignore[misc]
        assert found.code == "too-short"
        assert found.hint == "make length_mm 500.937 to go straight, or bring heights and angles closer together"
    (found,) = problems(lambda: read_shape(write(replaced(flat, "straight", "peak"))))
    assert found.code == "too-short"
    assert 'more to bend, write state = "straight", or bring' in found.hint
    (found,) = problems(lambda: read_shape(write(replaced(flat, "straight", "strait"))))
    assert "straight" in found.hint + found.message


@pytest.mark.parametrize("path", BROKEN, ids=lambda path: f"{path.parent.name}/{path.stem}")
def test_broken_file(path: Path) -> None:
    """The first line of each file says where it is broken: `# expect: 5:12 unknown-key, ...`."""
    expected = re.findall(r"(\d+):(\d+) ([a-z-]+)", path.read_text(encoding="utf-8").split("\n")[0])
    read = read_shape if path.parent.name == "shapes" else read_display
    found = problems(lambda: read(path))
    assert sorted(places(found)) == sorted((int(line), int(column), code) for line, column, code in expected)
    assert all(d.path == str(path) for d in found)
    lines = path.read_text(encoding="utf-8").split("\n")
    for d in found:
        if d.code not in ("empty", "wrong-kind"):  # these are of the file as a whole
            assert d.source in lines[d.line - 1]
            assert d.source[d.caret - 1 : d.caret] == lines[d.line - 1][d.column - 1 : d.column]


def test_the_corpus_is_large() -> None:
    assert len(BROKEN) >= 45


ODD_BYTES = {
    "empty": (b"", (1, 1, "empty")),
    "only-a-mark": (b"\xef\xbb\xbf", (1, 1, "empty")),
    "binary": (bytes(range(256)) * 20, (1, 1, "encoding")),
    "zero-byte": (b'name = "x"\ndisplay\0 = "single"\n', (2, 8, "encoding")),
    "latin-1": (b'name = "x"\ndisplay = "b\xfcro"\n', (2, 13, "encoding")),
    "latin-1-after-utf-8": ('name = "\u00fc\u00fc'.encode() + b'\xfc"\n', (1, 11, "encoding")),
    "latin-1-after-a-mark": (b'\xef\xbb\xbfname = "\xfc"\n', (1, 9, "encoding")),
    "utf-16": ('name = "x"\n'.encode("utf-16"), (1, 1, "encoding")),
    "surrogate": (b'name = "\xed\xa0\x80"\n', (1, 9, "encoding")),
    "lone-carriage-return": (b'name = "x"\rdisplay = "single"\n', (1, 11, "toml-syntax")),
    "escape-sequence": (b'name = "x"\n\x1b[31m\n', (2, 1, "toml-syntax")),
    "bad-escape": (b'name = "a\\q"\n', (1, 8, "toml-syntax")),
    "ten-megabytes": (b"#" * 10_000_000, (1, 1, "too-large")),
    "one-byte-too-many": (b"#" * (MAX_BYTES + 1), (1, 1, "too-large")),
}


@pytest.mark.parametrize(("data", "place"), ODD_BYTES.values(), ids=ODD_BYTES)
def test_odd_bytes(data: bytes, place: tuple[int, int, str], write: Callable[[bytes], Path]) -> None:
    assert places(problems(lambda: read_shape(write(data)))) == [place]


def test_a_byte_order_mark_and_windows_line_ends_are_tolerated(write: Callable[[bytes], Path]) -> None:
    data = b"\xef\xbb\xbf" + SHAPE.replace(b"\n", b"\r\n")
    assert read_shape(write(data)).nodes == read_shape(write(SHAPE)).nodes
    (found,) = problems(lambda: read_shape(write(data.replace(b"display", b"\xc2\xb5 = 1\r\ndisplay"))))
    assert (found.column, found.code) == (1, "toml-syntax")


def test_a_refused_file_is_not_parsed(write: Callable[[bytes], Path], monkeypatch: pytest.MonkeyPatch) -> None:
    def parse(text: str) -> NoReturn:
        raise AssertionError("parsed")

    path = write(b"a = 1\n" * 2_000_000)
    monkeypatch.setattr("tomllib.loads", parse)
    assert places(problems(lambda: read_shape(path))) == [(1, 1, "too-large")]


def test_what_is_no_file(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(given_files, "PATIENCE_S", 0.05)
    os.mkfifo(tmp_path / "pipe.toml")
    (tmp_path / "loop.toml").symlink_to(tmp_path / "loop.toml")
    (tmp_path / "file").write_text("")
    (tmp_path / "folder.toml").mkdir()
    expected = {
        "": "not-a-file",
        "pipe.toml": "not-a-file",
        "missing.toml": "no-such-file",
        "file/below.toml": "no-such-file",
        "folder.toml": "not-a-file",
        "zero\0byte.toml": "no-such-file",
        "loop.toml": "unreadable",
        "n" * 5000 + ".toml": "unreadable",
    }
    for name, code in expected.items():
        path = os.path.join(tmp_path, name)
        given = "no-input" if name == "pipe.toml" else code
        assert places(problems(lambda path=path: read_shape(path))) == [(1, 1, given)]
        if name:
            assert places(problems(lambda path=path: read_display(path))) == [(1, 1, code)]
    assert places(problems(lambda: read_shape("/dev/zero"))) == [(1, 1, "not-a-file")]


def test_a_file_that_may_not_be_read(write: Callable[[bytes], Path], monkeypatch: pytest.MonkeyPatch) -> None:
    def deny(*_: object) -> NoReturn:
        raise PermissionError(13, "Permission denied")

    path = write(SHAPE)
    monkeypatch.setattr(os, "open", deny)
    assert places(problems(lambda: read_shape(path))) == [(1, 1, "permission")]


def test_a_file_that_turns_into_a_pipe_is_refused(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Between looking and opening somebody can exchange the file: opening must not wait for a writer."""
    os.mkfifo(tmp_path / "pipe.toml")
    (tmp_path / "file.toml").write_bytes(SHAPE)
    earlier, look = os.stat(tmp_path / "file.toml"), os.stat
    monkeypatch.setattr(os, "stat", lambda path, **_: earlier if str(path).endswith("pipe.toml") else look(path))
    assert places(problems(lambda: read_shape(tmp_path / "pipe.toml"))) == [(1, 1, "not-a-file")]


def test_an_unknown_display_by_name() -> None:
    (found,) = problems(lambda: read_display("quadd"))
    assert (found.code, found.path) == ("unknown-display", "quadd")
    assert "did you mean quad?" in found.hint


def test_an_unknown_key_of_another_table_says_where_it_belongs(tmp_path: Path) -> None:
    (tmp_path / "d.toml").write_bytes(replaced(DISPLAY, "gravity = true", "gravity = true\nmax_strain = 0.1"))
    (found,) = problems(lambda: read_display(tmp_path / "d.toml"))
    assert "rod" in found.hint


def test_a_flood_of_problems_is_cut_off(write: Callable[[bytes], Path]) -> None:
    data = SHAPE + b"".join(b"key%d = 1\n" % i for i in range(70_000))
    start = time.monotonic()
    with pytest.raises(InvalidInput, match=f"{MAX_DIAGNOSTICS} of them shown") as caught:
        read_shape(write(data))
    assert len(caught.value.diagnostics) == MAX_DIAGNOSTICS
    assert time.monotonic() - start < 20.0


HOSTILE = {
    "dots": b"a." * 400_000 + b"a = 1",
    "long-paths": b"\n".join(b"k%d." % i + b"a." * 30 + b"a=1" for i in range(12_000)),
    "long-header": b"[" + b".".join([b"a"] * 31) + b"]\n" + b"\n".join(b"k%d=1" % i for i in range(80_000)),
    "arrays": b"a = " + b"[" * 900_000,
    "tables": b"a = " + b"{a=" * 300_000,
    "items": b"[[nodes]]\n" * 90_000,
    "digits": b"nodes = 0x" + b"f" * 900_000,
    "escapes": b'name = "' + b"\\\\" * 400_000 + b'"',
    "open": b'name = """' + b'"" ' * 300_000,
    "many-nodes": b"nodes = [" + b"1, " * 300_000 + b"]",
}


@pytest.mark.parametrize("data", HOSTILE.values(), ids=HOSTILE)
def test_hostile_file_is_refused_in_time(data: bytes, write: Callable[[bytes], Path]) -> None:
    start = time.monotonic()
    problems(lambda: read_shape(write(data)))
    assert time.monotonic() - start < 20.0


def test_the_plan_and_the_display_file_know_the_same_data_rates() -> None:
    assert get_args(RadioTable.model_fields["data_rate"].annotation) == plan_file.DATA_RATES


NUMBERS = [
    b"0",
    b"-1",
    b"nan",
    b"inf",
    b"1e308",
    b"1e-308",
    b"9" * 30,
    b"0xffffffffffffffff",
    b"true",
    b'"1"',
    b"[]",
    b"2024-01-01",
    b"1" * 4400,
]


def mutated(data: bytes, draw: Callable[[st.SearchStrategy[int]], int]) -> bytes:
    """`data` after one random accident."""
    here, length = draw(st.integers(0, len(data))), draw(st.integers(0, 20))
    accident = draw(st.integers(0, 5))
    if accident == 0:
        return data[:here] + data[here + length :]
    if accident == 1:
        noise = bytes(draw(st.integers(0, 255)) for _ in range(min(length, 4)))
        return data[:here] + noise + data[here:]
    if accident == 2:
        return data[:here] + bytes([draw(st.integers(0, 255))]) + data[here + 1 :]
    if accident == 3:
        lines = data.split(b"\n")
        i, j = draw(st.integers(0, len(lines) - 1)), draw(st.integers(0, len(lines) - 1))
        lines[i], lines[j] = lines[j], lines[i]
        return b"\n".join(lines)
    if accident == 4:
        return data[:here] + data[here : here + length] + data[here:]
    spots = list(re.finditer(rb"-?\d+\.?\d*", data))
    if not spots:
        return data
    spot = spots[draw(st.integers(0, len(spots) - 1))]
    return data[: spot.start()] + NUMBERS[draw(st.integers(0, len(NUMBERS) - 1))] + data[spot.end() :]


@st.composite
def accidents(draw: Callable[[st.SearchStrategy[int]], int], data: bytes) -> bytes:
    """`data` after one to four random accidents."""
    for _ in range(draw(st.integers(1, 4))):
        data = mutated(data, draw)
    return data


LOADED = (
    replaced(SHAPE, "angle_deg = -30.0", "angle_deg = -30.0, yaw_deg = 10.0, roll_deg = 400.0")
    + b"loads = [ { segment = 1, at = 0.5, force_N = [0.0, -1.5, 0.2] } ]\n"
)
LEANING = replaced(DISPLAY, "gravity = true", "gravity = [0.0, -0.87, -0.5]")
STEADY = settings(derandomize=True, max_examples=400, deadline=None, database=None)


@STEADY
@given(accidents(LOADED))
@example(LOADED)
def test_a_damaged_shape_is_a_scene_or_diagnostics(tmp_path_factory: pytest.TempPathFactory, data: bytes) -> None:
    path = tmp_path_factory.getbasetemp() / "damaged.toml"
    path.write_bytes(data)
    try:
        assert isinstance(read_shape(path), Scene)
    except InvalidInput as error:
        check_damage(error, data)


@STEADY
@given(accidents(LEANING))
@example(LEANING)
def test_a_damaged_display_is_a_display_or_diagnostics(tmp_path_factory: pytest.TempPathFactory, data: bytes) -> None:
    path = tmp_path_factory.getbasetemp() / "damaged-display.toml"
    path.write_bytes(data)
    try:
        assert read_display(path).rod.bending_stiffness > 0.0
    except InvalidInput as error:
        check_damage(error, data)


def check_damage(error: InvalidInput, data: bytes) -> None:
    """Every diagnostic lies in the file, and they are in file order."""
    found = error.diagnostics
    assert found
    assert all(d.hint and d.line <= data.count(b"\n") + 1 and d.column <= len(data) + 1 for d in found)
    assert [(d.line, d.column) for d in found] == sorted((d.line, d.column) for d in found)


def test_bounds_are_told_without_exponents(write: Callable[[bytes], Path]) -> None:
    (found,) = problems(lambda: read_shape(write(replaced(SHAPE, "660.0", "1e-9"))))
    assert "but must be at least 0.000001 mm" in found.message
    assert "make it at least 0.000001 mm" in found.hint

"""A file that is not TOML says what to write instead; whoever writes that, as it is printed, has a valid file."""

from __future__ import annotations

import random
import re
import time
import tomllib
from collections.abc import Callable
from pathlib import Path

import pytest

from curveline.errors import Diagnostic, InvalidInput
from curveline.shapes.files import builtin_text, read_display, read_shape
from curveline.shapes.toml_fault import TomlFault, closing
from curveline.shapes.toml_repair import MAX_CHARACTERS, slips_of, syntax_problems

ROOT = Path(__file__).parents[2]
LEVEL = """name = "x"
display = "single"
nodes = [
  { height_mm = 0.0, angle_deg = 30.0 },
  { height_mm = 0.0, angle_deg = -30.0 },
]
segments = [ { length_mm = 660.5, state = "peak" } ]
"""

SLIPS: dict[str, tuple[str, str, str]] = {
    # what stands in a sound file, what somebody writes there, and what the message or the hint says
    "newline in braces": ("{ height_mm = 0.0, angle_deg = 30", "{\n height_mm = 0.0,\n angle_deg = 30", "on one line"),
    "comments in braces": ("{ height_mm = 0.0,", "{ # left\n height_mm = 0.0, # level\n", "on one line"),
    "long table": ("30.0 }", "30.0,\n  yaw_deg = 0.0, roll_deg = 0.0,\n }", "from this { to its }"),
    "comma before a brace": ('"peak" }', '"peak", }', "remove `,`"),
    "two commas": ("0.0, angle_deg = 30.0", "0.0,, angle_deg = 30.0", "two commas"),
    "decimal comma": ("660.5", "660,5", "write `660.5` instead of `660,5`"),
    "thousands": ("660.5", "0,660.5", "write `660.5` instead of `0,660.5`"),
    "points between thousands": ("0.0, angle_deg = 30.0", "0.000,0, angle_deg = 30.0", "digits stand together"),
    "spaces in a number": ("660.5", "0 660.5", "write `660.5`"),
    "narrow spaces in a number": ("660.5", "0\u202f660,5", "write `660.5`"),
    "minus of Unicode": ("-30.0", "\u221230.0", "write `-30.0` instead of `\u221230.0`"),
    "en dash": ("-30.0", "\u201330", "write `-30` instead of `\u201330`"),
    "minus apart": ("-30.0", "- 30.0", "the sign stands at its digits"),
    "leading zero": ("30.0 }", "030 }", "write `30` instead of `030`"),
    "leading zeros": ("-30.0", "-007.5", "write `-7.5` instead of `-007.5`"),
    "trailing point": ("30.0 }", "30. }", "write `30.0` instead of `30.`"),
    "leading point": ("0.0, angle_deg = 30.0", ".5, angle_deg = 30.0", "write `0.5` instead of `.5`"),
    "unit": ("660.5", "660.5 mm", "write `660.5` instead of `660.5 mm`: it stands alone, in mm"),
    "unit without a space": ("660.5", "660mm", "write `660` instead of `660mm`"),
    "another unit": ("660.5", "66.05 cm", "write `660.5` instead of `66.05 cm`: it stands alone, in mm"),
    "metres": ("660.5", "0.66 m", "write `660` instead of `0.66 m`"),
    "inches": ("660.5", "26 in", "write `660.4` instead of `26 in`"),
    "radians": ("30.0 }", "0.5 rad }", "write `28.64788976` instead of `0.5 rad`"),
    "degrees": ("30.0 }", "30\u00b0 }", "write `30` instead of `30\u00b0`"),
    "strange unit": ("660.5", "660 furlongs", "as the number of mm"),
    "product": ("660.5", "2*330", "write `660` instead of `2*330`"),
    "quotient": ("30.0 }", "60/2 }", "TOML does not calculate"),
    "sum": ("660.5", "600 + 60", "write `660`"),
    "word": ('"single"', "single", 'write `"single"` instead of `single`'),
    "words": ('"x"', "my arch", 'write `"my arch"` instead of `my arch`'),
    "state": ('"peak"', "peak", "text stands in quotes"),
    "no first quote": ('"single"', 'single"', "a quote is missing"),
    "no last quote": ('"single"', '"single', 'write `"single"` instead of `"single`'),
    "no last quote in braces": ('"peak"', '"peak', 'write `"peak"` instead of `"peak`'),
    "no last quote before a comment": ('"x"', '"x # a name', 'write `"x"` instead of `"x`'),
    "unequal quotes": ('"x"', "'x\"", "these are no quotes of TOML"),
    "quotes of a word processor": ('"x"', "\u201cx\u201d", 'write `"x"` instead of `\u201cx\u201d`'),
    "one such quote": ('"peak"', '"peak\u201d', "these are no quotes of TOML"),
    "French quotes": ('"x"', "\u00abx\u00bb", "these are no quotes of TOML"),
    "German quotes": ('"x"', "\u201ex\u201c", "these are no quotes of TOML"),
    "single quotes of a word processor": ('"x"', "\u2018x\u2019", "these are no quotes of TOML"),
    "backticks": ('"x"', "`x`", "these are no quotes of TOML"),
    "key in such quotes": ("name", "\u201cname\u201d", "these are no quotes of TOML"),
    "no-break space": ("name =", "name\u00a0=", "put a blank in its place"),
    "ideographic space": ("display =", "display\u3000=", "put a blank in its place"),
    "zero width space": ("name", "\u200bname", "which cannot be seen"),
    "carriage returns": ('"x"\n', '"x"\r', "begin a new line here"),
    "no equals sign": ("name =", "name", "write `=` here"),
    "no equals sign in braces": ("length_mm =", "length_mm", "write `=` here"),
    "colon": ("name =", "name:", "write `=` instead of `:`"),
    "colons in braces": ("height_mm = 0.0, angle_deg =", "height_mm: 0.0, angle_deg :", "write `=` instead of `:`"),
    "two equals signs": ("name =", "name ==", "write `=` instead of `==`"),
    "arrow": ("name =", "name =>", "write `=` instead of `=>`"),
    "colon and equals sign": ("name =", "name :=", "write `=` instead of `:=`"),
    "semicolon": ('"x"', '"x";', "remove `;`"),
    "comma at the end": ('"x"', '"x",', "remove `,`"),
    "bracket too many": ('"peak" } ]', '"peak" } ] ]', "remove `]`"),
    "two statements on a line": ('"x"\n', '"x" ', "begin a new line here"),
    "comment of C": ("name", "// a shape\nname", "a comment begins with #"),
    "comment of C at the end": ('"x"', '"x" // a name', "a comment begins with #"),
    "comment of C in an array": ("nodes = [", "nodes = [ // two", "a comment begins with #"),
    "block comment": ("name", "/* a shape */\nname", "a comment begins with #"),
    "comment of SQL": ("name", "-- a shape\nname", "a comment begins with #"),
    "comment of TeX": ("name", "% a shape\nname", "a comment begins with #"),
    "no comma between keys": ("0.0, angle_deg = 30.0", "0.0 angle_deg = 30.0", "write `,` after `height_mm = 0.0`"),
    "no comma between tables": ("30.0 },\n  { h", "30.0 }\n  { h", "a comma is missing"),
    "open array": ("\n]", "\n", "the [ of line 3 is not closed"),
    "open array at the end": ('"peak" } ]', '"peak" }', "the [ of line 7 is not closed"),
    "open table": ("30.0 },", "30.0,", "the { of line 4 is not closed"),
    "open table in an array": ('"peak" } ]', '"peak" ]', "the { of line 7 is not closed"),
    "open table and array": ('"peak" } ]', '"peak"', "write `}]` after"),
    "wrong bracket": ('"peak" } ]', '"peak" ) ]', "write `}` instead of `)`"),
    "backslash": ('"x"', r'"a\x"', r"in quotes a \ begins an escape"),
    "space in a key": ("length_mm", "length mm", "write `length_mm` instead of `length mm`"),
    "many at once": ('"x"\ndisplay = "single"', "x\ndisplay: \u201csingle\u201d", "text stands in quotes"),
}  # fmt: skip

OF_DISPLAYS: dict[str, tuple[str, str, str]] = {
    "truth": ("gravity = true", "gravity = True", "write `true` instead of `True`"),
    "yes": ("gravity = true", "gravity = yes", "write `true` instead of `yes`"),
    "parentheses": ("[-75.0, 75.0]", "(-75.0, 75.0)", "an array stands in square brackets"),
    "no comma between numbers": ("[-75.0, 75.0]", "[-75.0 75.0]", "a comma is missing"),
    "units in an array": ("[-75.0, 75.0]", "[-75\u00b0, 75\u00b0]", "it stands alone, in deg"),
    "open header": ("[limits]", "[limits", "write `]` after `[limits`"),
    "header with two brackets": ("[limits]", "[limits]]", "remove `]`"),
    "key behind a header": ("[radio]\n", "[radio] ", "begin a new line here"),
    "modulus": ("youngs_modulus_GPa = 2.45", "youngs_modulus_GPa = 2.45 GPa", "it stands alone, in GPa"),
    "unit of a speed": ("bias_deg_per_s = 45.0", "bias_deg_per_s = 45 deg/s", "it stands alone, in deg/s"),
}


def obeyed(text: str, found: tuple[Diagnostic, ...]) -> str:
    """The text after all that the diagnostics say to write, from the last to the first."""
    lines = text.split("\n")
    for each in reversed(found):
        at = sum(len(line) + 1 for line in lines[: each.line - 1]) + each.column - 1
        text = text[:at] + rewritten(text[at:], each.hint)
    return text


def rewritten(rest: str, hint: str) -> str:
    """What begins at a place, after a hint was followed there."""
    if match := re.match(r"write `(.*)` instead of `(.*?)`(?=: |$)", hint):
        assert rest.startswith(match[2])
        return match[1] + rest[len(match[2]) :]
    if match := re.match(r"write `(.*?)` (?:here|after .*)", hint):
        return match[1] + rest
    if match := re.match(r"remove `(.*)`", hint):
        assert rest.startswith(match[1])
        return rest[len(match[1]) :]
    if "on one line" in hint:
        end = closing(rest, 0)
        assert end is not None
        joined = re.sub(r",? *\}$", " }", re.sub(r"\s*(#.*)?\n\s*", " ", rest[: end + 1]))
        assert joined in hint or "from this { to its }" in hint
        return joined + rest[end + 1 :]
    simple = {"remove it": "", "put a blank in its place": " ", "begin a new line here": "\n"}
    # Of what is removed or replaced, one character; a new line is begun before what stands there, or in place of a
    # carriage return.
    return simple[hint] + (rest[1:] if hint != "begin a new line here" or rest[0] == "\r" else rest)


def refused(read: Callable[[Path], object], path: Path) -> tuple[Diagnostic, ...]:
    with pytest.raises(InvalidInput) as caught:
        read(path)
    return caught.value.diagnostics


@pytest.mark.parametrize(("sound", "slip", "said"), SLIPS.values(), ids=SLIPS)
def test_a_slip_in_a_shape_is_told_and_mended_as_told(sound: str, slip: str, said: str, tmp_path: Path) -> None:
    check(LEVEL, (sound, slip, said), tmp_path / "shape.toml", read_shape)


@pytest.mark.parametrize(("sound", "slip", "said"), OF_DISPLAYS.values(), ids=OF_DISPLAYS)
def test_a_slip_in_a_display_is_told_and_mended_as_told(sound: str, slip: str, said: str, tmp_path: Path) -> None:
    check(builtin_text("single"), (sound, slip, said), tmp_path / "mine.toml", read_display)


def check(base: str, row: tuple[str, str, str], path: Path, read: Callable[[Path], object]) -> None:
    sound, slip, said = row
    assert sound in base
    text = base.replace(sound, slip, 1)
    path.write_bytes(text.encode())
    found = refused(read, path)
    assert {each.code for each in found} == {"toml-syntax"}
    assert all(each.message.startswith("this is not TOML: ") for each in found)
    assert said in " ".join(f"{each.message}: {each.hint}" for each in found)
    path.write_bytes(obeyed(text, found).encode())
    read(path)


def test_every_slip_of_a_file_is_told_at_once(tmp_path: Path) -> None:
    path = tmp_path / "shape.toml"
    text = (
        LEVEL.replace("660.5", "660,5")
        .replace('"x"', "\u201cx\u201d")
        .replace("-30.0", "\u221230")
        .replace("= 30.0", "= 030")
    )
    path.write_text(text, encoding="utf-8")
    found = refused(read_shape, path)
    assert [(each.line, each.column) for each in found] == [(1, 8), (4, 34), (5, 34), (7, 28)]
    path.write_text(obeyed(text, found), encoding="utf-8")
    assert read_shape(path).segments[0].length == pytest.approx(0.6605)


UNKNOWN = {
    "no value": ('"x"', "", "name has no value"),
    "no value in braces": ("= 0.0, angle_deg = 30.0", "= , angle_deg = 30.0", "height_mm has no value"),
    "two signs": ("-30.0", "+-30", "here is no value"),
    "formula": ("30.0 }", "pi/6 }", "here is no value"),
    "letters beyond ASCII": ("name", "n\u00e4me", "a key has letters a to z, digits, _ and -"),
    "remark behind a key": ("name", "name (of it)", "a key is followed by ="),
    "two numbers": ("660.5", "660 65", "a bracket is not closed"),
    "braces below a header": ("segments = [ {", "[segments]\n{", "write `segments = [` in place of `[segments]`"),
    "open long text": ('"x"', '"""x', "text in quotes is not closed"),
}


@pytest.mark.parametrize(("sound", "slip", "said"), UNKNOWN.values(), ids=UNKNOWN)
def test_where_nobody_knows_what_was_meant_the_rule_is_told(sound: str, slip: str, said: str, tmp_path: Path) -> None:
    path = tmp_path / "shape.toml"
    path.write_text(LEVEL.replace(sound, slip, 1), encoding="utf-8")
    found = refused(read_shape, path)
    assert said in f"{found[0].message}: {found[0].hint}"
    for jargon in ("initial character", "key/value", "inline", "invalid"):
        assert jargon not in found[0].message


def test_nothing_that_steers_a_terminal_is_repeated(tmp_path: Path) -> None:
    path = tmp_path / "shape.toml"
    for slip in (
        '"x\x1b[31m',
        "x\x1b[31m",
        "\u201cx\x1b\u201d",
        "\x1b",
        '"a\\x\u202e"',
        "\u202ex",
        "1\x1b5",
        "x\x9b31m",
    ):
        path.write_text(LEVEL.replace('"x"', slip, 1), encoding="utf-8")
        for each in refused(read_shape, path):
            assert re.fullmatch(r"[^\x00-\x1f\x7f-\x9f\u202e]+", each.message + each.hint + each.source)


TWICE = {
    "headers": ("[nodes]\na = 1\n[nodes]\na = 1\n", 5, "write `[[nodes]]` for each of them"),
    "items, then a header": ("[[nodes]]\na = 1\n[nodes]\na = 1\n", 5, "write `[[nodes]]` for each of them"),
    "a header, then items": ("[segments]\na = 1\n[[segments]]\na = 1\n", 5, "write `[[segments]]` for each of them"),
    "an array, then items": ("nodes = []\n[[nodes]]\na = 1\n", 4, "keep one of the two ways"),
    "tables": ("[a]\nb = 1\n[a]\nc = 2\n", 5, "keep one [a], with the keys of both"),
    "a key": ('name = "y"\n', 3, "keep one of the two"),
}


@pytest.mark.parametrize(("text", "line", "hint"), TWICE.values(), ids=TWICE)
def test_what_stands_there_twice_is_told_in_words(text: str, line: int, hint: str, tmp_path: Path) -> None:
    path = tmp_path / "shape.toml"
    path.write_text('name = "x"\ndisplay = "single"\n' + text)
    (found,) = refused(read_shape, path)
    assert (found.code, found.line, found.hint) == ("duplicate-key", line, hint)
    assert "stands here for the second time, after line" in found.message


@pytest.mark.parametrize("first", ["[nodes]", "[[nodes]]"])
def test_headers_that_are_written_as_told_are_several_tables(first: str, tmp_path: Path) -> None:
    path = tmp_path / "shape.toml"
    node = "height_mm = 0.0\nangle_deg = 0.0\n"
    text = f"{LEVEL[: LEVEL.index('nodes')]}{LEVEL[LEVEL.index('segments') :]}{first}\n{node}[nodes]\n{node}"
    path.write_text(text)
    refused(read_shape, path)
    path.write_text(re.sub(r"\[+nodes\]+", "[[nodes]]", text))
    assert len(read_shape(path).nodes) == 2


def test_one_header_for_one_of_several_tables_says_how_they_are_written(tmp_path: Path) -> None:
    path = tmp_path / "shape.toml"
    path.write_text(LEVEL[: LEVEL.index("segments")] + '[segments]\nlength_mm = "660"\nstate = "peak"\n')
    (found,) = refused(read_shape, path)
    assert "write `[[segments]]` above each" in found.hint
    path.write_text(path.read_text().replace("[segments]", "[[segments]]"))
    (found,) = refused(read_shape, path)
    assert found.hint.startswith("write 660, without quotes")


def test_a_display_is_found_from_home_and_by_slashes(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("HOME", str(tmp_path))
    monkeypatch.setenv("USERPROFILE", str(tmp_path))
    (tmp_path / "displays").mkdir()
    (tmp_path / "displays" / "nice.toml").write_text(builtin_text("single"))
    path = tmp_path / "shape.toml"
    for name in ('"~/displays/nice.toml"', '"displays/nice.toml"'):
        path.write_text(LEVEL.replace('"single"', name))
        assert read_shape(path).display.name == "single"
    assert read_display("~/displays/nice.toml").path == str(tmp_path / "displays" / "nice.toml")
    for name in (r'"displays\nice.toml"', r'"displays\\nice.toml"', r"'displays\nice.toml'"):
        path.write_text(LEVEL.replace('"single"', name))
        (found,) = refused(read_shape, path)
        assert (found.code, found.line, found.column) == ("unknown-display", 2, 11)
        assert "write / between folders" in found.hint


ACCIDENTS = [*",.}]{[\"'=:\n 0-#;\\\r\u2212\u201c\u00a0", "mm", "//"]


@pytest.mark.parametrize("seed", range(60))
def test_whatever_is_advised_on_a_damaged_file_helps_as_it_is_printed(seed: int) -> None:
    chance = random.Random(f"slip {seed}")
    text = LEVEL
    for _ in range(chance.randint(1, 3)):
        at = chance.randrange(len(text))
        text = text[:at] + chance.choice(["", *ACCIDENTS]) + text[at + chance.choice([0, 1, 1, 3]) :]
    fault = TomlFault.of(text)
    if fault is None:
        return
    found = list(syntax_problems(fault))
    assert found
    assert all(each.what and each.hint and 0 <= each.offset <= len(text) for each in found)
    mended = text
    for slip in slips_of(text)[:1]:
        mended = text[: slip.start] + rewritten(text[slip.start :], slip.hint)
        after = TomlFault.of(mended)
        assert after is None or after.left < fault.left


LARGEST = MAX_CHARACTERS - 10
HOSTILE = {
    "digits": "a = 1" + " 1" * (LARGEST // 2),
    "quotes": 'a = "' + "'\u201c" * (LARGEST // 2),
    "words": "a = " + "b " * (LARGEST // 2),
    "braces": "a = [" + "{b=1}, " * (LARGEST // 7) + "{c",
    "open braces": "a = " + "[" * 30 + "{b=1," * (LARGEST // 6),
    "newlines": "a = {" + "\n" * LARGEST + "}",
    "slips": "a = 1,5\n" * 3 + "".join(f"k{i} = 1,5\n" for i in range(1500)),
    "points": "a = " + "1," * (LARGEST // 2) + ".",
    "spaces": "a = 1" + " " * LARGEST + "x",
    "backslashes": 'a = "' + "\\" * (LARGEST // 2 * 2 - 1) + 'q"',
    "dashes": "--" * (LARGEST // 2),
}


@pytest.mark.parametrize("text", HOSTILE.values(), ids=HOSTILE)
def test_a_hostile_text_is_looked_into_in_time(text: str) -> None:
    assert len(text) <= MAX_CHARACTERS
    with pytest.raises(tomllib.TOMLDecodeError):
        tomllib.loads(text)
    fault = TomlFault.of(text)
    assert fault is not None
    begin = time.process_time()
    assert list(syntax_problems(fault))
    assert time.process_time() - begin < 5.0

"""The manifest of a folder of lines: what it may say, and what a person is told of one that cannot be used."""

from __future__ import annotations

from pathlib import Path

import pytest

from curveline.errors import InvalidInput
from curveline.shapes.file_keys import MAX_LINES
from curveline.shapes.files import read_shape
from curveline.shapes.lines_file import MANIFEST, read_lines_file

DOCS = Path(__file__).parents[2] / "docs"
LINE = '[[lines]]\nname = "front"\nplan = "front.json"\n'


def refusal(folder: Path, text: str | bytes) -> InvalidInput:
    """Why a manifest is refused."""
    (folder / MANIFEST).write_bytes(text if isinstance(text, bytes) else text.encode())
    with pytest.raises(InvalidInput) as caught:
        read_lines_file(folder)
    return caught.value


def test_a_name_and_a_limit_of_current_are_those_of_all_lines(tmp_path: Path) -> None:
    (tmp_path / MANIFEST).write_text('name = "roof"\ncurrent_limit_A = 6.5\n' + LINE + "current_A = 2\n")
    found = read_lines_file(tmp_path)
    assert (found.name, found.current_limit) == ("roof", 6.5)


def test_names_of_plans_and_displays_begin_in_the_folder(tmp_path: Path) -> None:
    rest = (
        '[[lines]]\nname = "back"\nplan = "plans/back.json"\ndisplay = "displays/back.toml"\n[surface]\npitch_mm = 75\n'
    )
    (tmp_path / MANIFEST).write_text(LINE + 'radio = "serial:/dev/ttyACM0"\ncurrent_A = 2\n' + rest)
    found = read_lines_file(tmp_path)
    assert (found.name, found.current_limit) == (tmp_path.name, None)
    front, back = found.lines
    assert (front.name, front.radio, front.current, front.display) == ("front", "serial:/dev/ttyACM0", 2.0, "")
    assert front.plan == str(tmp_path / "front.json")
    assert (back.radio, back.current) == ("", None)
    assert back.plan == str(tmp_path / "plans" / "back.json")
    assert back.display == str(tmp_path / "displays" / "back.toml")


def test_the_example_says_what_there_is_to_say(tmp_path: Path) -> None:
    (tmp_path / MANIFEST).write_text((DOCS / "examples" / MANIFEST).read_text())
    found = read_lines_file(tmp_path)
    assert (found.name, found.current_limit, len(found.lines)) == ("roof", 6.0, 2)
    assert found.lines[0].radio == found.lines[1].radio


def test_a_folder_without_a_manifest_says_what_to_write(tmp_path: Path) -> None:
    with pytest.raises(InvalidInput, match=f"there is no {MANIFEST} in this folder") as caught:
        read_lines_file(tmp_path)
    for word in ("`[[lines]]`", "name =", "plan =", "radio ="):
        assert word in caught.value.hint


def test_what_the_hint_says_to_write_is_a_manifest(tmp_path: Path) -> None:
    with pytest.raises(InvalidInput) as caught:
        read_lines_file(tmp_path)
    lines = [part for part in caught.value.hint.split("`") if part.startswith("[[") or " = " in part]
    (tmp_path / MANIFEST).write_text("\n".join(lines))
    assert read_lines_file(tmp_path).lines[0].plan.endswith("line-1.json")


@pytest.mark.parametrize(
    ("text", "code", "line", "words"),
    [
        ("lines = []\n", "item-count", 1, "at least 1"),
        ('name = "roof"\n', "missing-key", 1, "lines is missing"),
        ('[[lines]]\nname = "front"\n', "missing-key", 1, "plan is missing"),
        (LINE + "[[lines]]\nname = 3\nplan = 'a'\n", "wrong-type", 5, "must be text"),
        (LINE + "currents = 3\n", "unknown-key", 4, "no key `currents`"),
        ("curent_limit_A = 3\n" + LINE, "unknown-key", 1, "no key `curent_limit_A`"),
        ("current_limit_A = 0\n" + LINE, "out-of-range", 1, "above 0"),
        ("current_limit_A = nan\n" + LINE, "not-finite", 1, "not a finite number"),
        ("current_limit_A = 3\n" + LINE, "no-current", 2, "does not say what it draws"),
        (
            "current_limit_A = 3\n" + LINE + "current_A = 4\n",
            "beyond-limit",
            5,
            "draws 4 A, more than all lines may: 3 A",
        ),
        (
            LINE + LINE.replace("front.json", "back.json").replace("front", "FRONT"),
            "duplicate-name",
            5,
            "called FRONT, too",
        ),
        (LINE + LINE.replace('"front"', '"back"'), "same-plan", 6, "line front has this plan, too"),
        (LINE.replace("front.json", "../front.json"), "outside", 3, "not within the folder"),
        (LINE.replace("front.json", "/etc/passwd"), "outside", 3, "not within the folder"),
        (LINE.replace("front.json", "a/../../b.json"), "outside", 3, "not within the folder"),
        (LINE.replace('"front.json"', "'C:\\\\plans\\\\front.json'"), "outside", 3, "not within the folder"),
        (LINE.replace('"front.json"', "'..\\\\front.json'"), "outside", 3, "not within the folder"),
        (LINE.replace('"front.json"', '"a\\u0000b"'), "bad-name", 3, "nobody can read"),
        (LINE.replace('"front.json"', '"a\\u001b[2Jb"'), "bad-name", 3, "nobody can read"),
        (LINE + 'radio = "serial:\\u001b"\n', "bad-name", 4, "nobody can read"),
        (LINE.replace('"front.json"', '""'), "outside", 3, "not within the folder"),
        (LINE + 'display = "../display.toml"\n', "outside", 4, "not within the folder"),
        (LINE.replace('"front"', '" "'), "bad-name", 2, "no line can be called"),
        (LINE.replace('"front"', '"a\\u001bb"'), "bad-name", 2, "no line can be called"),
        (LINE.replace('"front"', f'"{"x" * 25}"'), "bad-value", 2, "at most 24"),
        ('name = "a\\u0007"\n' + LINE, "bad-name", 1, "text on one line"),
        (LINE * (MAX_LINES + 1), "item-count", 1, f"at most {MAX_LINES}"),
        ("[[lines]\n", "toml-syntax", 1, "not TOML"),
        ('display = "single"\n[[nodes]]\n[[segments]]\n', "wrong-kind", 1, "this is a shape"),
    ],
)
def test_a_damaged_manifest_says_where_what_and_what_to_do(
    text: str, code: str, line: int, words: str, tmp_path: Path
) -> None:
    found = refusal(tmp_path, text).diagnostics[0]
    assert (found.code, found.line) == (code, line)
    assert words in found.message
    assert found.hint


@pytest.mark.parametrize("content", [b"", b"# nothing\n", b"\xff\xfe", b"a\0b", b"x" * 1_000_001])
def test_what_is_no_manifest_at_all_is_refused(content: bytes, tmp_path: Path) -> None:
    error = refusal(tmp_path, content)
    assert error.hint or error.diagnostics[0].hint


def test_a_link_that_leads_out_of_the_folder_is_refused(tmp_path: Path) -> None:
    folder = tmp_path / "roof"
    folder.mkdir()
    (tmp_path / "front.json").write_text("{}")
    (folder / "front.json").symlink_to(tmp_path / "front.json")
    assert refusal(folder, LINE).diagnostics[0].code == "outside"


def test_a_manifest_in_place_of_a_shape_is_called_by_its_name(tmp_path: Path) -> None:
    (tmp_path / MANIFEST).write_text(LINE)
    with pytest.raises(InvalidInput) as caught:
        read_shape(tmp_path / MANIFEST)
    found = caught.value.diagnostics[0]
    assert found.message == "this is the manifest of a folder of lines, not a shape"
    assert "takes the folder that it is in" in found.hint

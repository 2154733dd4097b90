"""Folders of surfaces: what is in them, that they are whole or not there, and whom they are not taken from."""

from __future__ import annotations

import json
import os
import tomllib
from pathlib import Path
from types import SimpleNamespace

import pytest

import curveline
from curveline.errors import InvalidInput
from curveline.plan_file import read_plan
from curveline.shapes import changed_display
from curveline.shapes.files import builtin_text, read_display, read_shape
from curveline.surfaces import folder as folder_module
from curveline.surfaces.fit_surface import FittedSurface
from curveline.surfaces.line_displays import line_displays
from curveline.system import portable

BOW = "60*sin(pi*x/500)*cos(pi*(y-40)/900)"
KEYS = {"name", "plan", "display", "radio", "current_A"}
"""What a line of `lines.toml` may have, by docs/contracts.md."""


@pytest.fixture(scope="module")
def bow() -> FittedSurface:
    """Two lines of the display single, planned."""
    return curveline.surface(curveline.surface_of_formula(BOW), "single", curveline.SurfaceRequest(curveline.Laying(2)))


def contents(folder: Path) -> dict[str, bytes]:
    return {path.name: path.read_bytes() for path in folder.iterdir()}


def left(folder: Path) -> list[str]:
    return sorted(path.name for path in folder.iterdir())


def test_a_folder_has_all_that_sending_needs(bow: FittedSurface, tmp_path: Path) -> None:
    names = curveline.write_surface(bow, tmp_path / "bow")
    assert set(names) == {path.name for path in (tmp_path / "bow").iterdir()}
    said = tomllib.loads((tmp_path / "bow" / "lines.toml").read_text())
    assert set(said) == {"lines", "surface"}
    assert len(said["lines"]) == 2
    addresses: set[str] = set()
    for number, line in enumerate(said["lines"], start=1):
        assert line.keys() <= KEYS
        assert line["name"] == str(number)
        assert line["current_A"] == pytest.approx(3.6)
        plan, display = read_plan(tmp_path / "bow" / line["plan"]), read_display(tmp_path / "bow" / line["display"])
        assert plan.drive.digest == display.digest
        assert plan.drive.display == display.name == f"single-{number}"
        assert plan.drive.addresses == display.radio.addresses
        assert not addresses & set(display.radio.addresses)
        addresses |= set(display.radio.addresses)
        shape = read_shape(tmp_path / "bow" / f"line-{number}.toml")
        assert shape.display.digest == display.digest
        assert plan.provenance["shape_sha256"] == shape.digest
        assert plan.provenance["display"] == str(tmp_path / "bow" / line["display"])
    assert left(tmp_path) == ["bow"]


def test_what_surface_json_says_is_so(bow: FittedSurface, tmp_path: Path) -> None:
    curveline.write_surface(bow, tmp_path / "bow")
    told = json.loads((tmp_path / "bow" / "surface.json").read_text())
    assert told["distance"]["rms_mm"] == pytest.approx(max(line["distance"]["rms_mm"] for line in told["lines"]))
    assert told["budget"]["nodes"] == 4
    assert told["budget"]["motors"] == 12
    assert told["budget"]["current_A"] == pytest.approx(7.2)
    assert told["budget"]["polls_per_s"] == pytest.approx(200.0)
    plans = [read_plan(tmp_path / "bow" / f"line-{number}.json") for number in (1, 2)]
    assert told["budget"]["seconds_together"] == pytest.approx(max(plan.seconds for plan in plans))
    assert told["budget"]["seconds_in_turn"] == pytest.approx(sum(plan.seconds for plan in plans))
    lengths = [segment["length_mm"] for line in told["lines"] for segment in line["segments"]]
    assert told["budget"]["rod_m"] == pytest.approx(1e-3 * sum(lengths), abs=1e-6)
    (pair,) = told["across"]
    assert pair["lines"] == [1, 2]
    assert pair["rms_mm"] <= pair["max_mm"] < 1.0


def test_bytes_are_the_same_whatever_the_number_of_processes(tmp_path: Path) -> None:
    # Not every start leads to the same shape of such a line, so that the order of random numbers shows.
    rough = curveline.surface_of_formula("40*sin(pi*x/125) + 30*cos(pi*x/90 + y/50)")
    for jobs in (1, 2):
        request = curveline.SurfaceRequest(curveline.Laying(3), jobs=jobs)
        found = curveline.surface(rough, "single", request)
        assert any(line.fit.hits < line.fit.starts for line in found.lines)
        curveline.write_surface(found, tmp_path / "rough", force=True)
        if jobs == 1:
            first = contents(tmp_path / "rough")
    assert contents(tmp_path / "rough") == first


def test_a_folder_that_is_there_is_left_alone(bow: FittedSurface, tmp_path: Path) -> None:
    target = tmp_path / "bow"
    target.mkdir()
    curveline.write_surface(bow, target)
    with pytest.raises(InvalidInput) as caught:
        curveline.write_surface(bow, target)
    assert caught.value.diagnostics[0].code == "not-empty"
    curveline.write_surface(bow, target, force=True)
    for name in ("notes.txt", "line-1.toml"):
        (target / name).write_text("mine")
        with pytest.raises(InvalidInput, match=name):
            curveline.write_surface(bow, target, force=True)
        assert (target / name).read_text() == "mine"
        (target / "notes.txt").unlink(missing_ok=True)


@pytest.mark.parametrize("said", ["", "[]", "{}", '{"files": 5}', '{"files": {"notes.txt": 5}}', "[" * 100_000])
def test_what_no_surface_made_is_not_replaced(bow: FittedSurface, tmp_path: Path, said: str) -> None:
    (tmp_path / "notes.txt").write_text("mine")
    (tmp_path / "surface.json").write_text(said)
    with pytest.raises(InvalidInput) as caught:
        curveline.write_surface(bow, tmp_path, force=True)
    assert caught.value.diagnostics[0].code == "not-ours"
    assert left(tmp_path) == ["notes.txt", "surface.json"]


def test_folders_and_links_in_it_are_not_its_own(bow: FittedSurface, tmp_path: Path) -> None:
    target = tmp_path / "bow"
    curveline.write_surface(bow, target)
    said = json.loads((target / "surface.json").read_text())
    (tmp_path / "mine").mkdir()
    for digest in ("none", "None", "", None):
        said["files"]["mine"] = digest
        (target / "surface.json").write_text(json.dumps(said))
        for make in (lambda path: path.mkdir(), lambda path: path.symlink_to(tmp_path / "mine")):
            make(target / "mine")
            with pytest.raises(InvalidInput, match="mine"):
                curveline.write_surface(bow, target, force=True)
            (target / "mine").unlink() if (target / "mine").is_symlink() else (target / "mine").rmdir()


def test_a_link_stays_a_link_and_the_current_folder_stays(
    bow: FittedSurface, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "real").mkdir()
    (tmp_path / "link").symlink_to(tmp_path / "real")
    curveline.write_surface(bow, tmp_path / "link")
    assert (tmp_path / "link").is_symlink()
    assert (tmp_path / "real" / "lines.toml").exists()
    (tmp_path / "here").mkdir()
    monkeypatch.chdir(tmp_path / "here")
    with pytest.raises(InvalidInput) as caught:
        curveline.write_surface(bow, ".")
    assert caught.value.diagnostics[0].code == "in-use"
    curveline.write_surface(bow, "new")
    assert left(tmp_path / "here") == ["new"]


def test_where_no_folder_can_be(bow: FittedSurface, tmp_path: Path) -> None:
    (tmp_path / "file").write_text("mine")
    for name, code in (
        ("file", "not-a-folder"),
        ("no/bow", "no-such-folder"),
        ("a\0b", "bad-name"),
        ("b" * 300, "bad-name"),
    ):
        with pytest.raises(InvalidInput) as caught:
            curveline.write_surface(bow, tmp_path / name)
        assert caught.value.diagnostics[0].code == code
    assert left(tmp_path) == ["file"]


def test_a_disk_that_is_full_leaves_what_was_there(
    bow: FittedSurface, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    curveline.write_surface(bow, tmp_path / "bow")
    before = contents(tmp_path / "bow")
    calls = 0

    def full(descriptor: int) -> None:
        nonlocal calls
        calls += 1
        if calls > 3:
            raise OSError(28, os.strerror(28))

    monkeypatch.setattr(portable, "sync", full)
    with pytest.raises(InvalidInput, match="No space left"):
        curveline.write_surface(bow, tmp_path / "bow", force=True)
    with pytest.raises(InvalidInput, match="No space left"):
        curveline.write_surface(bow, tmp_path / "new")
    assert contents(tmp_path / "bow") == before
    assert left(tmp_path) == ["bow"]


def test_a_folder_that_cannot_be_put_in_place_leaves_the_old_one(
    bow: FittedSurface, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    curveline.write_surface(bow, tmp_path / "bow")
    before = contents(tmp_path / "bow")
    whole = portable.replace

    def fails(source: Path, target: Path) -> None:
        if source.suffix == ".part":
            raise PermissionError(13, "not now")
        whole(source, target)

    monkeypatch.setattr(folder_module.portable, "replace", fails)
    with pytest.raises(InvalidInput, match="not now"):
        curveline.write_surface(bow, tmp_path / "bow", force=True)
    assert contents(tmp_path / "bow") == before
    assert left(tmp_path) == ["bow"]


def test_displays_of_lines_keep_their_comments(tmp_path: Path) -> None:
    text = builtin_text("quad").replace('name = "quad"', "'name' = 'mine' # my own").replace("1C104", "1C1ff")
    (tmp_path / "mine.toml").write_text(text)
    displays = line_displays(read_display(tmp_path / "mine.toml"), 64)
    addresses = [each for own in displays for each in own.display.radio.addresses]
    assert len(set(addresses)) == len(addresses) == 320
    assert displays[0].display.radio.addresses[3] == "C1C1C1C1FF"
    assert len({own.display.name for own in displays}) == 64
    changed = displays[5].text
    assert "'name' = \"mine-6\" # my own" in changed
    comments = [line.partition("#")[2] for line in text.splitlines()]
    assert [line.partition("#")[2] for line in changed.splitlines()] == comments
    before, after = tomllib.loads(text), tomllib.loads(changed)
    del before["name"], after["name"], before["radio"]["addresses"], after["radio"]["addresses"]
    assert before == after


def test_addresses_say_which_line_it_is(tmp_path: Path) -> None:
    second, third = (own.display.radio.addresses for own in line_displays(read_display("single"), 3)[1:])
    assert second == ("C1C1C1C201", "C1C1C1C202")
    assert third == ("C1C1C1C301", "C1C1C1C302")
    # Nodes that differ in that very byte: who comes first has the address.
    text = builtin_text("single").replace('"C1C1C1C102"', '"C1C1C1C201"')
    (tmp_path / "mine.toml").write_text(text)
    displays = line_displays(read_display(tmp_path / "mine.toml"), 3)
    assert len({each for own in displays for each in own.display.radio.addresses}) == 6
    # The last address has a first one after it.
    text = builtin_text("single").replace('"C1C1C1C102"', '"FFFFFFFFFF"')
    (tmp_path / "mine.toml").write_text(text)
    assert line_displays(read_display(tmp_path / "mine.toml"), 2)[1].display.radio.addresses[1] == "00000000FF"


@pytest.mark.parametrize(
    "written", ['name = """single"""', "'name' = 'single'  # a name, [or] not", '"na\\u006de" = "single"']
)
def test_displays_are_changed_however_they_are_written(written: str, tmp_path: Path) -> None:
    (tmp_path / "mine.toml").write_text(builtin_text("single").replace('name = "single"', written))
    found = line_displays(read_display(tmp_path / "mine.toml"), 2)
    assert [each.display.name for each in found] == ["single-1", "single-2"]
    assert written.partition("#")[2] in found[0].text


def test_displays_that_cannot_be_changed_are_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(changed_display, "TomlMap", lambda text: SimpleNamespace(values={}))
    with pytest.raises(InvalidInput) as caught:
        line_displays(read_display("single"), 2)
    assert caught.value.diagnostics[0].code == "not-written"


def test_a_rod_that_is_bent_when_free_goes_along(tmp_path: Path) -> None:
    (tmp_path / "rods").mkdir()
    (tmp_path / "rods" / "mine.csv").write_text("place_mm,curvature_per_m\n0,0.0\n2000,0.2\n")
    text = builtin_text("single").replace("natural_curvature_per_m = 0.0 ", 'natural_curvature_file = "rods/mine.csv" ')
    (tmp_path / "mine.toml").write_text(text)
    display = read_display(tmp_path / "mine.toml")
    request = curveline.SurfaceRequest(curveline.Laying(2), curveline.FitRequest(is_planned=False))
    found = curveline.surface(curveline.surface_of_formula(BOW), display, request)
    curveline.write_surface(found, tmp_path / "bow")
    shape = read_shape(tmp_path / "bow" / "line-2.toml")
    assert shape.display.rod.profile == display.rod.profile
    assert (tmp_path / "bow" / "mine.csv").read_bytes() == (tmp_path / "rods" / "mine.csv").read_bytes()

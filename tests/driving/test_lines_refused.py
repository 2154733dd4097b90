"""Lines that cannot be sent together are refused before a radio is opened, with what is wrong and what to do."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest

import curveline
from curveline.errors import InvalidInput
from curveline.plan_file import Plan, read_plan, sealed, write_plan

from .lines_folder import display_file, lines_folder, quick_lines, quick_plan


def refusal(folder: Path, runs: Path, radio: str = "") -> InvalidInput:
    """Why a folder is not sent; nothing has been opened or written for that."""
    with pytest.raises(InvalidInput) as caught:
        curveline.send_lines(folder, radio, runs=runs)
    assert not runs.exists()
    return caught.value


def change(folder: Path, line: int, **drive: object) -> None:
    """Have the plan of a line say something else of its display."""
    path = folder / f"line-{line}.json"
    plan = read_plan(path)
    write_plan(sealed(replace(plan, drive=replace(plan.drive, **drive))), path, force=True)  # type: ignore[arg-type]


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """Three lines on two radios."""
    return quick_lines(tmp_path / "roof", ["mock", "mock", "mock:seed=3"])


@pytest.mark.parametrize("other", [2, 3])
def test_the_same_display_twice_is_refused(other: int, folder: Path, tmp_path: Path) -> None:
    plan = quick_plan(folder, 1)
    write_plan(sealed(replace(plan, name="another")), folder / f"line-{other}.json", force=True)
    error = refusal(folder, tmp_path / "runs")
    assert error.message == f"lines L1 and L{other} are of the same display, line-1"
    assert "a name and addresses of its own" in error.hint


def test_displays_whose_names_are_one_as_files_are_the_same(folder: Path, tmp_path: Path) -> None:
    change(folder, 2, display="LINE 3")
    change(folder, 3, display="line_3")
    assert "lines L2 and L3 are of the same display" in refusal(folder, tmp_path / "runs").message


@pytest.mark.parametrize("other", [2, 3])
def test_addresses_that_collide_are_refused_on_one_radio_and_on_two(other: int, folder: Path, tmp_path: Path) -> None:
    change(folder, other, addresses=("c1c1c10102", "C1C1C1FFFF"))
    error = refusal(folder, tmp_path / "runs")
    assert error.message == f"lines L1 and L{other} both have a node with the address C1C1C10102 on one channel"


def test_addresses_on_channels_of_their_own_do_not_collide(folder: Path, tmp_path: Path) -> None:
    change(folder, 3, addresses=("C1C1C10102", "C1C1C10101"), channel=99)
    result = curveline.send_lines(folder, runs=tmp_path / "runs")
    assert result.outcome == "done"


@pytest.mark.parametrize(("key", "value"), [("channel", 99), ("data_rate", "2Mbps")])
def test_lines_on_one_radio_are_on_one_channel_at_one_rate(
    key: str, value: object, folder: Path, tmp_path: Path
) -> None:
    change(folder, 2, **{key: value})
    error = refusal(folder, tmp_path / "runs")
    assert error.message.startswith("lines L1 and L2 share the radio mock, but are on channel ")
    assert "its own radio" in error.hint


def test_a_plan_that_does_not_fit_its_display_is_refused(folder: Path, tmp_path: Path) -> None:
    manifest = folder / "lines.toml"
    manifest.write_text(manifest.read_text().replace('name = "L2"', 'name = "L2"\ndisplay = "display-3.toml"'))
    error = refusal(folder, tmp_path / "runs")
    assert error.message.startswith("line L2: what is to be sent is of display line-2, not as ")
    manifest.write_text(manifest.read_text().replace("display-3.toml", "display-2.toml"))
    display = display_file(folder, 2)
    display.write_text(display.read_text().replace("span_mm = 500", "span_mm = 501"))
    error = refusal(folder, tmp_path / "runs")
    assert error.message.startswith("line L2: what is to be sent was made for another file of display line-2")
    assert "plan again" in error.hint


def test_a_plan_beyond_the_limits_of_its_display_is_refused(folder: Path, tmp_path: Path) -> None:
    plan = read_plan(folder / "line-3.json")
    axis = replace(plan.drive.axes[0], low=-1.0, high=1.0)
    change(folder, 3, axes=(axis, *plan.drive.axes[1:]))
    with pytest.raises(InvalidInput, match="line L3: "):
        curveline.send_lines(folder, runs=tmp_path / "runs")
    assert not (tmp_path / "runs").exists()


@pytest.mark.parametrize("content", [None, "{}", "", "not a plan", '{"curveline_plan": 2}'])
def test_a_plan_that_is_missing_or_damaged_is_refused(content: str | None, folder: Path, tmp_path: Path) -> None:
    path = folder / "line-2.json"
    path.unlink() if content is None else path.write_text(content)
    error = refusal(folder, tmp_path / "runs")
    assert error.message.startswith("line L2: ")
    assert error.diagnostics[0].path == str(path)


def test_an_edited_plan_is_refused(folder: Path, tmp_path: Path) -> None:
    path = folder / "line-2.json"
    path.write_text(path.read_text().replace('"seconds": 0.1', '"seconds": 0.2', 1))
    assert refusal(folder, tmp_path / "runs").diagnostics[0].code == "broken-seal"


def test_a_line_without_a_radio_is_refused_unless_one_is_named_for_all(tmp_path: Path) -> None:
    folder = quick_lines(tmp_path / "roof", ["", "mock"])
    error = refusal(folder, tmp_path / "runs")
    assert error.message == "line L1: no radio was named"
    assert "--radio" in error.hint
    assert curveline.send_lines(folder, "mock:fresh", runs=tmp_path / "runs").outcome == "done"


def test_a_radio_that_does_not_exist_is_refused(tmp_path: Path) -> None:
    folder = quick_lines(tmp_path / "roof", ["mock", "smoke"])
    assert refusal(folder, tmp_path / "runs").message.startswith("line L2: there is no radio 'smoke'")


def test_a_shape_in_place_of_a_plan_is_planned_from_where_its_line_stands(tmp_path: Path) -> None:
    folder = quick_lines(tmp_path / "roof", ["mock", "mock"])
    manifest = folder / "lines.toml"
    shape = 'name = "up"\ndisplay = "display-1.toml"\n' + "[[nodes]]\nheight_mm = 120\nangle_deg = 0\n" * 2
    (folder / "up.toml").write_text(f'{shape}[[segments]]\nlength_mm = 600\nstate = "peak"\n')
    manifest.write_text(manifest.read_text().replace("line-1.json", "up.toml"))
    first = curveline.send_lines(folder, runs=tmp_path / "runs")
    assert first.is_wanted
    assert first[0].run.plan.name == "up"
    (folder / "up.toml").write_text((folder / "up.toml").read_text().replace("120", "140"))
    manifest.write_text(manifest.read_text().split('[[lines]]\nname = "L2"')[0])
    second = curveline.send_lines(folder, runs=tmp_path / "runs")
    assert second.is_wanted
    assert [round(each.translate_mm, 1) for each in second[0].run.plan.start] == [120.0, 120.0]


def test_a_folder_that_names_its_displays_may_be_moved(tmp_path: Path) -> None:
    folder = lines_folder(tmp_path / "roof", ["mock"], plans=3)
    moved = folder.rename(tmp_path / "moved")
    without = curveline.send_lines(moved, runs=tmp_path / "runs")
    assert without[0].run.playback is None
    manifest = moved / "lines.toml"
    manifest.write_text(f'{manifest.read_text()}display = "display-1.toml"\n')
    result = curveline.send_lines(moved, "mock:fresh", runs=tmp_path / "runs")
    assert result[0].run.playback is not None
    assert result.is_wanted


def made_elsewhere(plan: Plan) -> Plan:
    """A plan that begins where its display does not stand."""
    return sealed(replace(plan, start=plan.steps[-1].targets))


def test_a_line_that_stands_elsewhere_than_its_plan_begins_is_refused_and_none_moves(tmp_path: Path) -> None:
    folder = quick_lines(tmp_path / "roof", ["mock", "mock"])
    write_plan(made_elsewhere(quick_plan(folder, 2)), folder / "line-2.json", force=True)
    with pytest.raises(curveline.CurvelineError, match="line L2: node 1 does not stand where the plan starts"):
        curveline.send_lines(folder, runs=tmp_path / "runs")
    assert not list((tmp_path / "runs").glob("0*"))

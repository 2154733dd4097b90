"""Commands over a dongle: its port, its nodes, and who else is on the air."""

from __future__ import annotations

import json
from collections.abc import Iterator
from pathlib import Path

import pytest

from curveline.drive_settings import drive_settings
from curveline.plan_file import write_plan
from curveline.shapes.files import read_display
from radio.dongle_host import DongleHost, Room, dongle_host, write_keys

from .conftest import Run, small_plan

DRIVE = drive_settings(read_display("single"))


@pytest.fixture
def host(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[DongleHost]:
    monkeypatch.setenv("CURVELINE_KEYS", str(tmp_path / "site.json"))
    with dongle_host(tmp_path / "dongle", Room(DRIVE, write_keys(tmp_path / "site.json", DRIVE))) as host:
        yield host


def test_a_scan_tells_which_channels_others_use(run: Run, host: DongleHost) -> None:
    host.core.carriers = {0, 3, 4, 5, 125}
    code, out, _ = run("status", "--radio", f"serial:{host.path}", "--scan")
    assert code == 0
    assert f"others send on 0, 3-5, 125; the display is on {DRIVE.channel}" in out
    host.core.carriers = set()
    code, out, _ = run("status", "--radio", f"serial:{host.path}", "--scan")
    assert "others send on no channel" in out
    code, out, _ = run("status", "--radio", f"serial:{host.path}", "--scan", "--json")
    assert json.loads(out)["busy_channels"] == []
    code, out, _ = run("status", "--radio", "mock:noise=1@0.9", "--scan", "--json")
    assert json.loads(out)["busy_channels"] == list(range(2, 23))
    code, out, _ = run("status", "--radio", "mock", "--radio-test", "--json")
    assert json.loads(out)["busy_channels"] is None


def test_the_air_is_measured_through_it(run: Run, host: DongleHost) -> None:
    host.core.carriers = {75, 76, 77}
    done = run("radio", "scan", "--radio", f"serial:{host.path}", "--seconds", "0.3", "--json")
    found = json.loads(done.out)
    assert (done.code, found["present"]["in_use"]) == (1, 1.0)
    assert abs(found["advised"] - 76) > 2
    done = run("radio", "range", "1", "--radio", f"serial:{host.path}", "--seconds", "2", "--json")
    assert done.code == 0, done.err
    assert [each["lost"] for each in json.loads(done.out)["levels"]] == [0, 0, 0, 0]
    assert host.core.powers[-1] == 3
    assert {0, 1, 2, 3} <= set(host.core.powers)


def test_a_plan_is_sent_through_it(run: Run, host: DongleHost, tmp_path: Path) -> None:
    plan = small_plan()
    write_plan(plan, tmp_path / "plan.json")
    code, out, err = run("send", tmp_path / "plan.json", "--radio", f"serial:{host.path}", "--yes")
    assert (code, "done: 2 of 2 steps" in out) == (0, True), err
    assert host.room.positions() == [target.counts for target in plan.steps[-1].targets]


def test_one_sentence_tells_why_it_cannot(run: Run, host: DongleHost, tmp_path: Path) -> None:
    for spec, code, said in (
        ("serial:", 2, "the serial radio needs a port"),
        (f"serial:{tmp_path / 'nothing'}", 3, "there is no port"),
    ):
        found = run("status", "--radio", spec)
        assert found.code == code
        assert said in found.err
        assert "Traceback" not in found.err
    host.unplug()
    assert run("status", "--radio", f"serial:{host.path}").code == 3

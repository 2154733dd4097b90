"""`curveline node update` on the mock: what it says, what it asks, what it refuses."""

from __future__ import annotations

import json
import re
import signal
import subprocess
import sys
from contextlib import closing
from pathlib import Path
from random import Random

import pytest

from curveline.drive_settings import drive_settings
from curveline.driving.one_node import OneNode
from curveline.plan_file import write_plan
from curveline.radio.host.link import read_status
from curveline.radio.host.updating import ProgramUpdate, update_node
from curveline.radio.interface import open_radio
from curveline.radio.site.program_file import program_in
from curveline.shapes.files import read_display
from programs import updatable_hex

from .conftest import Run, small_plan

MOCK = ("--radio", "mock", "--yes")


@pytest.fixture
def program(tmp_path: Path) -> Path:
    path = tmp_path / "updatable.hex"
    path.write_text(updatable_hex())
    return path


def test_a_node_gets_a_program(run: Run, program: Path) -> None:
    code, out, err = run("node", "update", "1", "--hex", program, *MOCK)
    assert code == 0, err
    assert out.startswith("node 1: firmware 4 before, firmware 5 now, ")
    assert "100% of the program is there" in err


def test_it_is_told_to_the_end_how_far_it_is(run: Run, tmp_path: Path) -> None:
    path = tmp_path / "large.hex"
    path.write_text(updatable_hex(length=42032))
    _, _, err = run("node", "update", "1", "--hex", path, *MOCK)
    assert [line[:-1] for line in re.findall(r"\d+%", err)] == ["26", "50", "76", "100"]


def test_it_is_told_as_plain_data(run: Run, program: Path) -> None:
    code, out, _ = run("node", "update", "2", "--hex", program, *MOCK, "--json")
    document = json.loads(out)
    assert code == 0
    assert document["node"] == 2
    assert (document["update"]["was"], document["update"]["firmware"]) == (4, 5)


def test_nothing_is_replaced_without_consent(run: Run, program: Path) -> None:
    code, _, err = run("node", "update", "1", "--hex", program, "--radio", "mock")
    assert code == 2
    assert "add --yes to agree" in err


def test_ctrl_c_says_how_to_go_on(run: Run, program: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def strike(*arguments: object, **options: object) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr(OneNode, "update", strike)
    code, _, err = run("node", "update", "1", "--hex", program, *MOCK)
    assert code == 130
    assert "node 1 may wait in its loader: the same command goes on" in err


def test_a_node_without_a_loader_is_sent_to_the_cable(run: Run, program: Path) -> None:
    code, _, err = run("node", "update", "1", "--hex", program, "--radio", "mock:noloader=1", "--yes")
    assert code == 3
    assert "node 1 has no loader" in err
    assert "make -C firmware updatable" in err


def test_an_image_without_a_loader_is_refused(run: Run, tmp_path: Path) -> None:
    path = tmp_path / "node.hex"
    code, _, err = run("node", "update", "1", "--hex", tmp_path / "none.hex", *MOCK)
    assert (code, "none.hex" in err) == (2, True)
    path.write_text(":10000000000102030405060708090A0B0C0D0E0F78\n:00000001FF\n")
    code, _, err = run("node", "update", "1", "--hex", path, *MOCK)
    assert code == 2
    assert "no program behind a loader" in err


# Left in its loader

KILLED = """
import os, signal, sys
from pathlib import Path
from curveline.drive_settings import drive_settings
from curveline.driving.site_keys import read_program
from curveline.shapes.files import read_display
from curveline.radio.host.updating import ProgramUpdate, update_node
from curveline.radio.interface import open_radio

def seen(part):
    if part >= float(sys.argv[2]):
        os.kill(os.getpid(), signal.SIGKILL)

drive = drive_settings(read_display("single"))
radio = open_radio("mock", drive, Path(os.environ["CURVELINE_RUNS"]))
update_node(radio, drive, 1, ProgramUpdate(read_program(sys.argv[1]), seen=seen))
"""


def broken_off(program: Path, part: float) -> None:
    """An update of node 1 whose process is killed when the node has that part of the program."""
    done = subprocess.run([sys.executable, "-c", KILLED, program, str(part)], check=False)
    assert done.returncode == -signal.SIGKILL


def test_an_update_that_was_killed_goes_on_with_the_next_command(run: Run, tmp_path: Path) -> None:
    path = tmp_path / "long.hex"
    path.write_text(updatable_hex(length=9000))
    broken_off(path, 0.6)
    code, out, err = run("node", "update", "1", "--hex", path, *MOCK)
    assert code == 0, err
    told = re.fullmatch(r"node 1: its loader before, firmware 5 now, (\d+) frames\n", out)
    assert told
    assert int(told[1]) < 64 * 9 * 0.6, "what was there is not sent again"
    assert json.loads(run("node", "info", "1", "--radio", "mock", "--json").out)["info"]["firmware"] == 5
    code, out, _ = run("node", "update", "1", "--hex", path, *MOCK)
    assert (code, out.startswith("node 1: firmware 5 before, firmware 5 now")) == (0, True)


def test_a_node_that_is_left_in_its_loader_says_so(run: Run, program: Path) -> None:
    broken_off(program, 0.3)
    for command in (("status",), ("node", "status", "1")):
        code, out, err = run(*command, "--radio", "mock")
        assert code == 3, err
        assert "silent" not in out
        said = " ".join((out + err).split())
        assert "curveline node update 1" in said, said
    document = json.loads(run("status", "--radio", "mock", "--json").out)
    first, second = document["nodes"]
    assert (first["state"], first["counts"], first["position"], first["boot"]) == ("boot", None, None, 2)
    assert "in its loader" in first["obstacle"]
    assert second["state"] == "ready"
    for command in (("node", "info", "1"), ("node", "settings", "1", "--yes"), ("node", "home", "1", "--yes")):
        code, _, err = run(*command, "--radio", "mock")
        assert code == 3, err
        assert "node 1 is in its loader" in err, err
    code, _, err = run("stop", "--radio", "mock")
    assert code == 0, err


def test_nothing_is_sent_to_a_display_with_a_node_in_its_loader(run: Run, program: Path, tmp_path: Path) -> None:
    broken_off(program, 0.3)
    plan = tmp_path / "plan.json"
    write_plan(small_plan(), plan)
    code, _, err = run("send", plan, "--radio", "mock", "--yes")
    assert code == 3, err
    assert "node 1 is in its loader" in err
    assert "curveline node update 1" in err


def test_a_node_whose_program_is_whole_leaves_its_loader_when_nobody_asks(tmp_path: Path) -> None:
    drive = drive_settings(read_display("single"))
    with closing(open_radio("mock", drive, tmp_path)) as radio:
        with pytest.raises(KeyboardInterrupt):
            update_node(radio, drive, 1, ProgramUpdate(program_in(updatable_hex(), "p"), seen=_interrupt))
        assert read_status(radio, drive)[0].state == "boot"
        radio.sleep_until(radio.now_us() + 60_000_000)
        assert read_status(radio, drive)[0].state == "boot", "there is no whole program"
    with closing(open_radio("mock:fresh", drive, tmp_path)) as radio:
        (station, _) = radio.modelled._stations
        station.board.in_loader = True
        station.power_up(Random(1))
        radio.modelled._restless.add(station)
        assert read_status(radio, drive)[0].state == "boot"
        radio.sleep_until(radio.now_us() + 21_000_000)
        read_status(radio, drive)
        radio.sleep_until(radio.now_us() + 1_000_000)
        assert read_status(radio, drive)[0].state == "ready"


def _interrupt(part: float) -> None:
    raise KeyboardInterrupt

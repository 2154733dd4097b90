"""`curveline node update` on the mock: what it says, what it asks, what it refuses."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from curveline.driving.one_node import OneNode
from programs import updatable_hex

from .conftest import Run

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

"""Stopping a display that somebody else drives."""

from __future__ import annotations

from pathlib import Path

import pytest

from curveline.errors import LinkError
from curveline.radio.host.journal import Journal, new_run
from curveline.radio.host.link import Progress, send_plan
from curveline.radio.host.stopping import Stopped, stop_all
from curveline.radio.interface import Answer
from curveline.radio.mock.display import open_radio
from curveline.radio.node.state import NodeSession
from curveline.radio.protocol.codes import Fault, NodeState
from curveline.radio.protocol.frames import HelloFrame
from curveline.radio.protocol.motion import axes_of, plan_move

from .bench import drive_table, make_plan


@pytest.mark.parametrize("settings", ["", "loss=0.5,seed=4", "stale=0.4,dup=0.3,corrupt=0.05,seed=5"])
def test_a_running_display_stops_and_its_host_says_why(tmp_path: Path, settings: str) -> None:
    radio = open_radio(settings, drive_table(), tmp_path)
    stopped: list[Stopped] = []
    stands = []

    def stop(progress: Progress) -> None:
        if not stopped and progress.step == 2 and 0.2 < progress.fraction < 0.8:
            stopped.extend(stop_all(radio, drive_table()))
            stands.append(radio.positions())

    journal = Journal(new_run(tmp_path, "x"))
    with pytest.raises(LinkError, match=r"node [12] was stopped in step 2 by a stop broadcast"):
        send_plan(make_plan(seconds=4.0), radio, journal, stop)
    journal.close()
    assert [each.is_sure for each in stopped] == [True, True]
    assert {each.state for each in stopped} <= {NodeState.HOLD, NodeState.HOLD_LINK}
    assert radio.positions() == stands[0]
    radio.close()
    assert radio.positions() == stands[0]


def test_an_idle_display_stands_already(tmp_path: Path) -> None:
    radio = open_radio("", drive_table(20), tmp_path)
    assert [each.state for each in stop_all(radio, drive_table(20))] == [NodeState.HOLD] * 20
    radio.close()


def test_a_silent_node_is_not_sure(tmp_path: Path) -> None:
    radio = open_radio("", drive_table(), tmp_path)
    radio._stations[1].deaf_until_ms = 2**60
    sure, silent = stop_all(radio, drive_table())
    assert sure.is_sure
    assert (silent.is_sure, silent.state, silent.link.answered) == (False, None, 0)
    radio.close()


def test_a_node_that_moves_on_is_not_sure(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A node with another stop key, as of another site, hears questions but no STOP."""
    radio = open_radio("", drive_table(), tmp_path)
    node = radio.nodes[0]
    monkeypatch.setattr(node, "_handlers", {kind: act for kind, act in node._handlers.items() if kind.name != "STOP"})
    first, second = stop_all(radio, drive_table())
    assert (first.is_sure, first.state) == (False, NodeState.READY)
    assert second.is_sure
    assert radio.now_us() > 10_000_000
    radio.close()


def test_a_hold_of_the_owner_is_no_proof_and_nor_is_an_acknowledgement(tmp_path: Path) -> None:
    """Whoever jams STOP and forges its acknowledgement lets the questions through: the host holds the node, no STOP."""
    radio = open_radio("", drive_table(), tmp_path)
    node = radio.nodes[0]
    node.advance(0)
    node._session = NodeSession(1, bytes(16), HelloFrame(1, 0, 0, 0, 60_000), hold_gen=1)
    exchange = radio.exchange

    def only_questions(frames):
        return [exchange([frame])[0] if frame[1][0] & 15 == 3 else Answer(bytes(32)) for frame in frames]

    radio.exchange = only_questions
    first, _ = stop_all(radio, drive_table())
    assert (first.is_sure, first.state) == (False, NodeState.HOLD)
    radio.close()


def test_a_node_that_still_brakes_is_not_sure(tmp_path: Path) -> None:
    """In fault it says so at once, and comes to rest a ramp later."""
    radio = open_radio("", drive_table(), tmp_path)
    node = radio.nodes[0]
    node.memory.fault = Fault.STALL
    node.move = plan_move((0, 0, 0), (9000, 0, 0), axes_of(drive_table()), 0)
    node.plant.settles_ms = lambda: None
    first, second = stop_all(radio, drive_table())
    assert (first.is_sure, second.is_sure) == (False, True)
    node.move = None
    radio.close()


def test_a_device_that_the_site_does_not_know_cannot_be_sure(tmp_path: Path) -> None:
    radio = open_radio("", drive_table(), tmp_path)
    object.__setattr__(radio.site, "chips", (0, radio.site.chips[1]))
    first, second = stop_all(radio, drive_table())
    assert (first.is_sure, second.is_sure) == (False, True)
    assert radio.nodes[0].state is NodeState.HOLD, "it stopped all the same"
    assert radio.now_us() < 1_000_000, "there is nothing to wait for"
    radio.close()

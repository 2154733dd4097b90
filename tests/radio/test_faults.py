"""Every fault that a mock display can be asked for: its cause, message, hint and exit code, and that nothing is lost.

Faults that the link must bear are in `BORNE`, all others in `HALTING`; together they are the whole of `MISHAPS`.
"""

from __future__ import annotations

import re
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pytest

from curveline.errors import EXIT_LINK, LinkError
from curveline.radio.host.journal import Journal, new_run, read_journal
from curveline.radio.host.link import Halted, RunReport, send_plan
from curveline.radio.host.scan import problems, scan
from curveline.radio.host.stop_causes import Cause
from curveline.radio.interface import RadioGone
from curveline.radio.mock.air import Air
from curveline.radio.mock.display import MockRadio, open_radio
from curveline.radio.mock.fault_injection import MISHAPS
from curveline.radio.protocol.codes import NodeState
from curveline.radio.protocol.keys import Site

from .bench import drive_table, make_plan

SECONDS = 4.0
"""Long enough steps that a silence of the dead-man's length catches a node on its way."""


EITHER = -1
"""Both nodes are struck; the one that says so first is named."""


@dataclass(frozen=True)
class Row:
    """What must come of a mishap: which node (0 for all) is named in which words, and what to do about it."""

    setting: str
    cause: Cause | None
    node: int
    message: str
    hint: str
    moves: bool = True
    """Whether anything may have moved at all."""


HALTING = [
    Row("stall=1@step2", Cause.STALL, 1, "node 1 has stalled in step 2: its bias motor does not follow", "free what"),
    Row("encoder=2@step1", Cause.LOST, 2, r"node 2 has lost its position in step 1 \(extrude: encoder\)", "encoder"),
    Row(
        "runaway=1@step3",
        Cause.RUNAWAY,
        1,
        r"node 1 moved against its command in step 3 \(extrude\)",
        "wrong way round",
    ),
    Row("driver=2@step2", Cause.DRIVER, 2, "node 2 reports a fault of its motor driver in step 2", "short circuit"),
    Row("brownout=1@step2", Cause.BROWN_OUT, 1, r"the supply of node 1 sagged in step 2 \(whole drive\)", "supply"),
    Row(
        "reboot=2@step3",
        Cause.REBOOT,
        2,
        "node 2 has restarted in step 3: boot number 2 instead of 1",
        "send the shape",
    ),
    Row("off=1@step2", Cause.SILENT, 1, r"node 1 does not answer any more, for 6\.\d s", "power and antenna"),
    Row("silence=2@step2", Cause.HELD, 2, "node 2 heard nothing for longer than its dead-man time", "resume the run"),
    Row("taken=1@step2", Cause.TAKEN, 1, "node 1 no longer obeys this radio session", "only one host"),
    Row("jam@step2", Cause.DEAF, 0, "no node answers any more, for", "jamming"),
    Row("gone@step2", None, 0, "the radio does not answer this computer any more", "plug it in again"),
    Row(
        "sleep@step2",
        Cause.SUSPENDED,
        0,
        r"this computer fell silent in step 2 \(for 1\d\.\d s, as if",
        "keep it awake",
    ),
    Row("stop@step2", Cause.STOPPED, EITHER, "node [12] was stopped in step 2 by a stop broadcast", "find out who"),
    Row("disk=full@step2", Cause.JOURNAL, 0, "record of the run cannot be written.*No space left", "free space"),
    Row(
        "unhomed=2",
        Cause.NOT_HOMED,
        2,
        "node 2 does not know where it is: it has not been homed",
        "`curveline node home 2",
        moves=False,
    ),
    Row(
        "estop=1",
        Cause.LATCHED,
        1,
        "node 1 has been stopped for good by an emergency stop",
        "switch the node",
        moves=False,
    ),
    Row(
        "version=2",
        Cause.VERSION,
        2,
        "node 2 speaks another version.*has 3, this release needs 2",
        "flash",
        moves=False,
    ),
    Row("config=1", Cause.CONFIG, 1, "node 1 holds other limits or speeds than this display", "settings", moves=False),
    Row("chip=2", Cause.CHIP, 2, "node 2 is another device than the site knows: chip", "keys adopt", moves=False),
    Row("busy=1", Cause.BUSY, 1, "node 1 belongs to another host that is sending to it", "--takeover", moves=False),
    Row("clone=2", Cause.CLONE, 2, "the answers of node 2 come cut short", "--radio-test", moves=False),
    Row(
        "chip=1,twin=1", Cause.TWIN, 1, "two devices answer on the address of node 1: chips", "switch one", moves=False
    ),
]
ALIKE = [
    Row("reversed=extrude@1", Cause.RUNAWAY, 1, r"node 1 moved against its command in step 1 \(extrude\)", "wired"),
    Row("swapped=bias@2", Cause.LOST, 2, r"node 2 has lost its position in step \d \(\w+: encoder\)", "cable of that"),
    Row("noisy=extrude@1", Cause.LOST, 1, r"node 1 has lost its position in step 1 \(extrude: encoder\)", "cable"),
    Row("loose=extrude@2", Cause.LOST, 2, r"node 2 has lost its position in step 1 \(extrude: encoder\)", "cable"),
    Row("key=2", Cause.UNTRUSTED, 2, "node 2 answers, but not to the key of this site", "keys node", moves=False),
    Row("channel=1", Cause.SILENT, 1, "node 1 does not answer", "the channel", moves=False),
    Row("away=2", Cause.SILENT, 2, "node 2 does not answer", "check its power", moves=False),
    Row("absent=bias@2", Cause.LOST, 2, r"node 2 has lost its position in step 2 \(bias: encoder\)", "cable of that"),
]
"""Rows whose cause another row has, too."""
BORNE = [
    "firmware=1",
    "noloader=1",
    "gear=bias@1",
    "switch=translate@2",
    "open=translate@2",
    "supply=1",
    "twin=1",
    "reset@step2",
    "replug@step2",
    "stranger=0.5",
    "replay=0.5",
    "stranger=0.6,replay=0.6",
    "cut=1@word3",
]
WEATHER = ["", ",loss=0.3,dup=0.1,stale=0.2"]


def keys_of(setting: str) -> set[str]:
    return {re.split("[=@]", part)[0] for part in setting.split(",")}


def test_every_mishap_has_its_row() -> None:
    rows = [keys_of(row.setting) for row in HALTING + ALIKE] + [keys_of(setting) for setting in BORNE]
    assert set.union(*rows) == set(MISHAPS)


def test_every_row_has_a_cause_of_its_own() -> None:
    causes = [row.cause for row in HALTING]
    assert len(set(causes)) == len(causes)


def test_every_mishap_says_what_it_is() -> None:
    assert len({row.text for row in MISHAPS.values()}) == len(MISHAPS)


class Ran:
    """A run on a mock display, its record, and how it ended."""

    def __init__(self, runs: Path, settings: str) -> None:
        self.radio: MockRadio = open_radio(settings, drive_table(), runs)
        self.report: RunReport | None = None
        self.error: LinkError | None = None
        journal = Journal(new_run(runs, "test"), self.radio.disk)
        try:
            self.report = send_plan(make_plan(seconds=SECONDS), self.radio, journal)
        except LinkError as error:
            self.error = error
        journal.close()
        self.records: list[Any] = read_journal(journal.path)

    def of(self, kind: str) -> list[Any]:
        return [record for record in self.records if record["type"] == kind]


def check_order(ran: Ran) -> None:
    """Nobody ran ahead: of what was released, of the record, of the slowest node by more than a step."""
    released = max([record["step"] for record in ran.of("release")], default=0)
    barriers = [record["step"] for record in ran.of("barrier")]
    assert barriers == list(range(1, len(barriers) + 1))
    keeping = [node.memory for node in ran.radio.nodes if node.memory.run_tag and node.memory.boot == 1]
    assert all(memory.started <= released for memory in keeping)
    assert released <= len(barriers) + 1


def check_rest(ran: Ran) -> None:
    """Once the run has ended nothing sets off any more, however long one waits; what still brakes comes to rest."""
    radio = ran.radio
    before = [node.memory.started for node in radio.nodes]
    radio.close()
    rest = radio.positions()
    assert all(node.move is None for node in radio.nodes)
    assert [node.memory.started for node in radio.nodes] == before
    for node in radio.nodes:
        node.advance(radio.now_us() // 1000 + 3_600_000)
    radio.sleep_until(radio.now_us() + 3_600_000_000)
    assert radio.positions() == rest


@pytest.mark.parametrize("weather", WEATHER, ids=["calm", "rough"])
@pytest.mark.parametrize("row", HALTING + ALIKE, ids=lambda row: row.setting)
def test_a_fault_halts_the_run_and_is_told(tmp_path: Path, row: Row, weather: str) -> None:
    ran = Ran(tmp_path, f"seed=7,{row.setting}{weather}")
    assert ran.error is not None, ran.report
    assert re.search(row.message, ran.error.message), ran.error.message
    assert row.hint in ran.error.hint
    assert ran.error.exit_code == EXIT_LINK
    assert ran.error.node == row.node or (row.node == EITHER and ran.error.node in (1, 2))
    if row.cause is None:
        assert isinstance(ran.error, RadioGone)
    else:
        assert isinstance(ran.error, Halted)
        assert ran.error.halt.cause is row.cause
    if not row.moves:
        assert ran.radio.motion() == [(seconds, ((0, 0, 0),) * 2) for seconds, _ in ran.radio.motion()]
        assert ran.of("release") == []
    check_order(ran)
    check_rest(ran)


@pytest.mark.parametrize("weather", WEATHER, ids=["calm", "rough"])
@pytest.mark.parametrize("setting", BORNE)
def test_a_fault_that_must_be_borne_costs_nothing_but_time(tmp_path: Path, setting: str, weather: str) -> None:
    plan = make_plan(seconds=SECONDS)
    ran = Ran(tmp_path, f"seed=7,{setting}{weather}")
    assert ran.error is None
    assert ran.report is not None
    assert (ran.report.outcome, ran.report.steps_done) == ("done", len(plan.steps))
    assert [record["step"] for record in ran.of("release")] == [1, 2, 3]
    assert ran.radio.positions() == tuple(each.counts for each in plan.steps[-1].targets)
    calm = Ran(tmp_path / "calm", f"seed=7{weather}")
    turns = [len(station.plant.spans()) for station in calm.radio._stations]
    if "replug" not in setting:
        assert [len(station.plant.spans()) for station in ran.radio._stations] == turns, "each step was done once"
    check_order(ran)
    check_rest(ran)
    calm.radio.close()


def test_strangers_and_replays_are_counted(tmp_path: Path) -> None:
    ran = Ran(tmp_path, "seed=3,stranger=0.3,replay=0.3")
    for node in ran.radio.nodes:
        assert node.tally.bad_tags > 10
        assert node.tally.old_frames > 10
        assert node.state is NodeState.READY
    found = scan(ran.radio, drive_table())
    assert all(page.bad_tags > 10 for each in found for page in each.pages.values())
    ran.radio.close()


def test_a_twin_that_a_run_bears_is_found_by_a_scan(tmp_path: Path) -> None:
    radio = open_radio("twin=1", drive_table(), tmp_path)
    first, second = (problems(each, 0, drive_table()) for each in scan(radio, drive_table()))
    assert "2 devices" in first[0]
    assert second == []
    radio.close()


def test_a_fault_needs_its_step_to_be_done_in_this_run(tmp_path: Path) -> None:
    """Steps that nodes remember of the run before are none of this one."""
    ran = Ran(tmp_path, "")
    ran.radio.close()
    radio = open_radio("off=1@step2,jam@step1,gone@step3", drive_table(), tmp_path)
    assert [node.memory.started for node in radio.nodes] == [3, 3]
    for found in scan(radio, drive_table()):
        assert found.link.lost == 0
    radio.close()


def test_faults_can_be_combined(tmp_path: Path) -> None:
    ran = Ran(tmp_path, "seed=2,stall=1@step2,reboot=2@step3,reset@step1,stranger=0.2,loss=0.2")
    assert isinstance(ran.error, Halted)
    assert ran.error.halt.cause is Cause.STALL
    ran.radio.close()
    for order in ("stall=1@step3,driver=1@step2", "driver=1@step2,stall=1@step3"):
        ran = Ran(tmp_path / order, order)
        assert isinstance(ran.error, Halted)
        assert ran.error.halt.cause is Cause.DRIVER
        ran.radio.close()


def test_a_reset_makes_the_radio_number_its_packets_anew(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    resets: list[Air] = []
    monkeypatch.setattr(Air, "reset", lambda air: resets.append(air))
    ran = Ran(tmp_path, "reset@step2")
    assert ran.error is None
    assert len(resets) == 1
    ran.radio.close()


def test_a_node_with_another_sites_key_is_no_other_device(tmp_path: Path) -> None:
    radio = open_radio("", drive_table(), tmp_path)
    radio.site = Site(bytes(range(16)), radio.site.chips)
    journal = Journal(new_run(tmp_path, "test"))
    with pytest.raises(Halted, match="node 1 answers, but not to the key of this site") as caught:
        send_plan(make_plan(), radio, journal)
    assert "curveline keys node" in caught.value.hint
    journal.close()
    radio.close()

"""A plan through everything that is C in the dongle: host, packets, core, chip driver, chips, air and nodes, on one
modelled clock."""

from __future__ import annotations

from pathlib import Path
from random import Random

import pytest

from curveline.drive_settings import DriveSettings
from curveline.radio.host.journal import Journal, new_run
from curveline.radio.host.link import read_status, send_plan
from curveline.radio.mock.air import Weather
from curveline.radio.mock.display import mock_site
from curveline.radio.node.machine import NodeMachine
from curveline.radio.node.plant import MotorPlant
from curveline.radio.node.state import Identity, Memory
from curveline.radio.ports.serial import READ_S, SerialRadio
from curveline.radio.protocol.keys import Site
from curveline.radio.protocol.motion import axes_of
from radio.bench import drive_table, make_plan
from radio.chip import Chip
from radio.chip_node import ChipNode
from radio.chip_setup import Listener
from radio.ether import Ether

from .dongle_core import Core, Sender

PLAN = make_plan(2, [(3.0, 2.0, 0.5), (1.0, 0.0, 0.0), (4.0, -3.0, 1.0)], seconds=0.4)
SEED = 21


class Wire:
    """The line to a core, on the ether's clock."""

    def __init__(self, core: Core, ether: Ether) -> None:
        self._core, self._ether = core, ether

    def write(self, data: bytes) -> None:
        self._core.feed(data)

    def read(self) -> bytes:
        while self._core.step(self._ether.now_us // 1000):
            pass
        said = self._core.take()
        if not said:
            self._ether.advance(self._ether.now_us + round(READ_S * 1e6))
        return said

    def now_s(self) -> float:
        return self._ether.now_us / 1e6

    def close(self) -> None:
        self._core.abandon()


class ChainRadio(SerialRadio):
    """The serial radio, on the ether's clock."""

    def __init__(self, drive: DriveSettings, site: Site, core: Core, ether: Ether) -> None:
        self._ether = ether
        super().__init__("chain", drive, site, lambda path: Wire(core, ether))

    def now_us(self) -> int:
        return self._ether.now_us

    def sleep_until(self, moment_us: int) -> None:
        self._ether.advance(max(moment_us, self._ether.now_us))


@pytest.mark.parametrize("rate", ["250kbps", "1Mbps", "2Mbps"])
@pytest.mark.parametrize("loss", [0.0, 0.3])
def test_a_plan_is_carried_through(tmp_path: Path, rate: str, loss: float) -> None:
    print(f"seed {SEED}")
    table = drive_table()
    drive = DriveSettings(table.display, table.digest, table.axes, 76, rate, table.addresses)
    site, ether = mock_site(drive), Ether(loss=loss, seed=SEED)
    sender = Sender(Chip(ether, "dongle"), ether)
    core = Core(sender.transmit)
    core.configure = sender.configure
    plants = [MotorPlant((0, 0, 0)) for _ in drive.addresses]
    for index, address in enumerate(drive.addresses):
        node = NodeMachine(Identity(index + 1, site), axes_of(drive), plants[index], Memory())
        listener = Listener(ether, bytes.fromhex(address), rate, 76)
        ChipNode(listener, node, Weather(), Random(SEED))
    radio = ChainRadio(drive, site, core, ether)
    journal = Journal(new_run(tmp_path, "chain"))
    report = send_plan(PLAN, radio, journal)
    journal.close()
    assert (report.outcome, report.steps_done) == ("done", len(PLAN.steps))
    positions = [plant.positions(ether.now_us // 1000) for plant in plants]
    assert positions == [target.counts for target in PLAN.steps[-1].targets]
    assert [each.state for each in read_status(radio, drive)] == ["ready", "ready"]
    assert (sum(node.link.retries for node in report.nodes) > 0) == (loss > 0)

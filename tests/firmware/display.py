"""A small display of nodes that run the real image, and a short plan for it."""

from __future__ import annotations

import struct
from collections.abc import Callable, Iterator
from pathlib import Path
from zlib import crc32

import pytest

from curveline.errors import LinkError
from curveline.plan_file import NodeTarget, Plan, Step
from curveline.radio.host.journal import Journal
from curveline.radio.host.link import Control, Progress, RunReport, read_status, send_plan
from curveline.radio.host.node_status import NodeStatus
from curveline.radio.protocol.motion import axes_of

from .fleet import AXES, STORE, ChipRadio, Fleet, drive_table
from .image import Image
from .machine import Machine

POSES = ((1.0, 2.0, 0.4), (0.5, -1.0, 0.8), (0.0, 0.5, 0.2))


def target(pose: tuple[float, float, float]) -> NodeTarget:
    extrude, bias, translate = (axis.counts(value) for axis, value in zip(AXES, pose, strict=True))
    return NodeTarget(*pose, (extrude, bias, translate))


def short_plan(count: int, poses: tuple[tuple[float, float, float], ...] = POSES) -> Plan:
    steps = tuple(
        Step(number, "move", 0.2, (target(pose),) * count, (600.0,), ("peak",), 1.0, 1.0, "test", 0.01, 1.0, 1.0)
        for number, pose in enumerate(poses, start=1)
    )
    return Plan("test", drive_table(count), (target((0.0, 0.0, 0.0)),) * count, steps, ("peak",), (600.0,))


def records(flash: bytes) -> Iterator[int]:
    """Where records begin in a node's store."""
    return (at for at in range(0, len(flash), 32) if flash[at : at + 2] == b"CL")


def sealed(flash: bytearray) -> bytes:
    """The store with checksums that fit its records."""
    for at in records(flash):
        flash[at + 28 : at + 32] = (crc32(flash[at : at + 24]) >> 1).to_bytes(4, "little")
    return bytes(flash)


def tied(flash: bytes, number: int) -> bytes:
    """The store as if its positions were those of node `number` of a display as in fleet.py."""
    ends = [end for axis in axes_of(drive_table(1)) for end in (axis.low, axis.high)]
    sum_of_settings = crc32(struct.pack("<I6i", number, *ends))
    changed = bytearray(flash)
    for at in records(flash):
        changed[at + 2 : at + 4] = ((sum_of_settings ^ sum_of_settings >> 16) & 0xFFFF).to_bytes(2, "little")
    return sealed(changed)


class Rig:
    """Homed nodes, a host's radio, and a folder for the record of a run."""

    def __init__(self, image: Image, flash: bytes, folder: Path, *, count: int = 2, loss: float = 0.0) -> None:
        self.plan = short_plan(count)
        self.fleet = Fleet(image, self.plan.drive, loss=loss, seed=20)
        for number, machine in enumerate(self.fleet.machines, start=1):
            machine.write_flash(STORE, tied(flash, number))
            machine.power_cycle()
        self.radio = ChipRadio(self.fleet)
        self.fleet.run(20_000)
        self._folder = folder

    @property
    def machines(self) -> list[Machine]:
        return self.fleet.machines

    def send(
        self, observer: Callable[[Progress], None] = lambda progress: None, control: Control | None = None
    ) -> RunReport:
        return send_plan(self.plan, self.radio, Journal(self._folder), observer, control)

    def status(self) -> list[NodeStatus]:
        return read_status(self.radio, self.plan.drive)

    def send_until_moving(self, event: Callable[[], object]) -> LinkError:
        """Send the plan; once node 1 moves let something happen. The error that the run ends with."""
        happened = False

        def watch(progress: Progress) -> None:
            nonlocal happened
            if not happened and progress.status.node == 1 and abs(self.machines[0].motors[0].speed) > 500:
                happened = True
                event()

        with pytest.raises(LinkError) as caught:
            self.send(watch)
        assert happened
        return caught.value

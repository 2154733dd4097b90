"""How many encoder edges the real image can count: all that a display file may ask for, and not three times as many."""

from __future__ import annotations

from random import Random

import pytest

from curveline.drive_settings import MAX_EDGES_PER_S
from curveline.radio.host.link import read_status

from .fleet import ChipRadio, Fleet, drive_table
from .image import Image
from .kl26 import CYCLES_PER_US
from .machine import Machine
from .motors import QUADRATURE, Motor

UNEVEN = 0.25
"""Part of their distance by which the edges of a cheap encoder come early or late."""
TURN_US = 60_000
RETURN = b"\x70\x47"


class Turning(Motor):
    """A motor that turns by itself, at so many edges per second, until its speed is set to zero."""

    def __init__(self, rate: float, seed: int) -> None:
        super().__init__(speed=rate)
        self.sent = 0
        self._random = Random(seed)
        self._apart = 1e6 * CYCLES_PER_US / rate
        self._next: float | None = None

    def step(self, duty: float, now: int, cycles: int) -> list[tuple[int, int]]:
        """See Motor."""
        due = now + self._apart * self._random.uniform(UNEVEN, 1.0) if self._next is None else self._next
        edges = []
        while self.speed and due < now + cycles:
            self.sent += 1
            edges.append((int(due + self._apart * self._random.uniform(-UNEVEN, UNEVEN)), QUADRATURE[self.sent & 3]))
            due += self._apart
        self._next = due
        return edges


def turn(image: Image, rates: tuple[float, ...], *, asks: bool = True) -> tuple[list[int], list[str], Machine]:
    """Let the encoders turn; edges lost per axis, and what the node says of itself if a host asks meanwhile."""
    fleet = Fleet(image, drive_table(1))
    fleet.run(60_000)
    (machine,) = fleet.machines
    machine.cpu.patch("persist_serve", RETURN)  # the flash, which stops everything, is written at rest only
    radio = ChipRadio(fleet)
    turning = [Turning(rate, seed) for seed, rate in enumerate(rates)]
    machine.motors[:] = turning
    end, states = fleet.now_us + TURN_US, []
    while fleet.now_us < end:
        if asks:
            states.append(read_status(radio, fleet.drive)[0].state)
        fleet.run(10_000)
    for motor in turning:
        motor.speed = 0.0
    fleet.run(3_000)
    lost = [motor.sent - machine.cpu.word("counts", 4 * axis) for axis, motor in enumerate(turning)]
    return lost, states, machine


@pytest.mark.parametrize("shares", [(0.333, 0.333, 0.334), (0.98, 0.01, 0.01), (0.5, 0.45, 0.05)], ids=str)
def test_as_many_edges_as_a_display_may_bring_are_counted(image: Image, shares: tuple[float, float, float]) -> None:
    lost, states, machine = turn(image, tuple(share * MAX_EDGES_PER_S for share in shares))
    assert lost == [0, 0, 0]
    assert [machine.cpu.word("illegal", 4 * axis) for axis in range(3)] == [0, 0, 0]
    assert len(states) >= 4
    assert set(states) == {"unhomed"}
    assert machine.watchdog_resets == 0


def test_three_times_as_many_are_too_many(image: Image) -> None:
    lost, _, _ = turn(image, (3.0 * MAX_EDGES_PER_S, 10.0, 10.0), asks=False)
    assert lost[0] > 0

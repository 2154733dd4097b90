"""Motors without a loop as the mock display has them, and what may be wrong with the wires of a board.

A gear motor: a speed that follows its duty with a time constant, less than nothing below what friction takes. What is
known of the real ones: 6953 counts/s at full duty and 30 ms, both modelled; friction is a guess.
"""

from __future__ import annotations

from dataclasses import dataclass
from random import Random

from curveline.radio.node.workbench import Turn, Workbench
from curveline.radio.protocol.codes import AXIS_COUNT, READING_SAMPLES, Counts

FULL_COUNTS_PER_S = 6953
TIME_CONSTANT_MS = 30
BREAK_DUTY = 80
FRICTION_DUTY = 50
"""Thousandths of full duty that set a motor going, and that friction takes of what a turning one is given."""
SHORTED_MS = 10
SUPPLY_MV = 3300
SAGGING_MV = 2720
NOISE = 0.04
"""Share of the edges that a noisy encoder loses."""
LOOSE_MS = 60
LOOSE_SHARE = 0.4
"""A loose encoder gives no counts for this part of every so many milliseconds."""


@dataclass
class Wiring:
    """What is wrong with a board; axes as bits, bit 0 for the first. Each field but the last is a set of axes."""

    reversed: int = 0  # motor wires exchanged
    swapped: int = 0  # encoder plug exchanged with that of the next axis
    absent: int = 0  # motor not connected
    noisy: int = 0  # encoder loses edges
    loose: int = 0  # encoder gives counts now and then
    stuck_switches: int = 0  # switch always closed
    geared: int = 0  # a motor with another gear than the display file says
    is_sagging: bool = False  # the supply goes down while a motor turns

    @property
    def crossed(self) -> int:
        """Axes whose encoder plugs are exchanged, both of each pair."""
        return self.swapped | (self.swapped << 1 & 0b111) | self.swapped >> (AXIS_COUNT - 1)

    @property
    def mute(self) -> int:
        """Axes of which no counts come when they are driven."""
        return self.absent | self.crossed

    @property
    def doubtful(self) -> int:
        """Axes whose counts cannot be trusted."""
        return self.mute | self.noisy | self.loose

    def encoder_of(self, axis: int) -> int:
        """The axis (from 0) whose socket the encoder of `axis` is plugged into."""
        for index in range(AXIS_COUNT):
            if self.swapped >> index & 1:
                pair = index, (index + 1) % AXIS_COUNT
                if axis in pair:
                    return pair[1 - pair.index(axis)]
        return axis

    def supply_mv(self, *, turns: bool) -> int:
        """What the chip measures of its supply."""
        return SAGGING_MV if self.is_sagging and turns else SUPPLY_MV


@dataclass(frozen=True)
class BenchFacts:
    """Of one axis: missed edges and duty now; of the last turn threshold, samples kept, and some of them."""

    missed: int
    duty: int
    kept: tuple[int, int, tuple[int, ...]]


class Bench:
    """The motors of a board, each turned by itself; it remembers the last turn and the edges that were missed."""

    def __init__(self) -> None:
        self._workbench = Workbench()
        self._random = Random(1)
        self._missed = [0] * AXIS_COUNT
        self._duties: list[int] = []
        self._begin_ms = 0

    def run(self, now_ms: int, turn: Turn, start: Counts, wiring: Wiring) -> tuple[Counts, ...]:
        """Counts of every ms of a turn, from its beginning to its end."""
        bench, axis = self._workbench, turn.axis - 1
        bench.start(turn, start)
        counts, path = start, [start]
        self._begin_ms, self._duties = now_ms, [0]
        motor = _Motor()
        socket = wiring.encoder_of(axis)
        while bench.busy:
            duty = bench.tick(counts)
            step = 0 if wiring.absent >> axis & 1 else motor.tick(-duty if wiring.reversed >> axis & 1 else duty)
            counts = self._counted(counts, socket, self._seen(axis, step, len(path), wiring))
            path.append(counts)
            self._duties.append(duty)
        return tuple(path)

    def stop(self, now_ms: int) -> None:
        """The turn was ended; the motor is shorted."""
        self._workbench.stop()
        del self._duties[max(1, now_ms - self._begin_ms) :]

    def facts(self, now_ms: int, axis: int, first: int) -> BenchFacts:
        """What there is to say of an axis (from 1), and of the samples from `first` on."""
        bench, at = self._workbench, now_ms - self._begin_ms
        duty = self._duties[at] if axis == bench.turn.axis and 0 <= at < len(self._duties) else 0
        known = bench.samples[first : first + READING_SAMPLES]
        trace = (*known, *(0,) * (READING_SAMPLES - len(known)))
        return BenchFacts(self._missed[axis - 1], duty, (bench.threshold, len(bench.samples), trace))

    def trembling(self, now_ms: int, counts: Counts, wiring: Wiring) -> Counts:
        """What the encoders say; a noisy one is a count to and fro even at rest."""
        for index in range(AXIS_COUNT):
            if wiring.noisy >> index & 1:
                counts = self._counted(counts, index, now_ms // 7 % 3 - 1)
                self._missed[index] += now_ms // 11 % 2
        return counts

    def _seen(self, axis: int, step: int, at_ms: int, wiring: Wiring) -> int:
        """Counts that an encoder gives for those that its motor makes."""
        if wiring.loose >> axis & 1 and at_ms % LOOSE_MS < LOOSE_SHARE * LOOSE_MS:
            return 0
        if wiring.noisy >> axis & 1 and step and self._random.random() < NOISE * abs(step):
            self._missed[axis] += 1
            return step - 1 if step > 0 else step + 1
        return step

    @staticmethod
    def _counted(counts: Counts, index: int, step: int) -> Counts:
        x, y, z = (each + step if number == index else each for number, each in enumerate(counts))
        return x, y, z


class _Motor:
    """A gear motor at 1 kHz: whole counts come out, fractions stay."""

    def __init__(self) -> None:
        self._speed = 0.0
        self._at = 0.0

    def tick(self, duty: int) -> int:
        """One ms at a duty in thousandths, 0 shorts the motor; the counts it makes."""
        grip = FRICTION_DUTY if self._speed else BREAK_DUTY
        push = max(0, abs(duty) - grip) * (1 if duty > 0 else -1)
        wanted = push / 1000.0 * FULL_COUNTS_PER_S
        self._speed += (wanted - self._speed) / (TIME_CONSTANT_MS if duty else SHORTED_MS)
        if abs(self._speed) < 1.0:
            self._speed = 0.0
        before = int(self._at)
        self._at += self._speed / 1000.0
        return int(self._at) - before

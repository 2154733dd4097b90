"""Three geared motors with quadrature encoders, as the node program meets them: PWM in, edges out.

A motor takes on the speed that its duty asks for with a time constant; friction eats the first few per cent. The
encoder sits on the motor: behind a jammed axis it can still turn back by the play of the gears. What is left out: that
play in ordinary motion, and the rod's forces.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import exp, floor

NO_LOAD = 6953.0
"""Counts per second at full duty: 50 turns a minute of 8344 counts."""
TIME_CONSTANT_S = 0.030
FRICTION_DUTY = 0.05
STEP_US = 500
PLAY = 40.0
"""Counts: two degrees behind the gears."""

QUADRATURE = (0b00, 0b01, 0b11, 0b10)
"""Levels of channels B and A in the order in which counts grow."""


@dataclass
class Motor:
    """One motor: `at` in counts since it was built, `speed` in counts per second."""

    at: float = 0.5
    speed: float = 0.0
    low: float = float("-inf")
    high: float = float("inf")

    @property
    def levels(self) -> int:
        """What the encoder shows."""
        return QUADRATURE[floor(self.at) & 3]

    def jam(self) -> None:
        """Something gets in the way of the axis, on the side that it moves to."""
        play = PLAY if self.speed > 0 else -PLAY
        self.low, self.high = sorted((self.at, self.at - play))

    def step(self, duty: float, now: int, cycles: int) -> list[tuple[int, int]]:
        """Turn for `cycles` from `now` on: when (in cycles) the encoder changes, and to which levels."""
        wanted = 0.0 if abs(duty) <= FRICTION_DUTY else NO_LOAD * duty
        seconds = cycles / 48e6
        self.speed = wanted + (self.speed - wanted) * exp(-seconds / TIME_CONSTANT_S)
        if abs(self.speed) < 1.0 and wanted == 0.0:
            self.speed = 0.0
        begin, end = self.at, min(self.high, max(self.low, self.at + self.speed * seconds))
        if end in (self.low, self.high):
            self.speed = 0.0
        self.at = end
        return self._crossings(begin, end, now, cycles)

    @staticmethod
    def _crossings(begin: float, end: float, now: int, cycles: int) -> list[tuple[int, int]]:
        first, last = floor(begin), floor(end)
        if first == last:
            return []
        step = 1 if last > first else -1
        places = range(first + step, last + step, step)
        edges = []
        for place in places:
            border = place if step > 0 else place + 1
            share = (border - begin) / (end - begin)
            edges.append((now + int(share * (cycles - 1)), QUADRATURE[place & 3]))
        return edges

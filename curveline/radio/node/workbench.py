"""One motor turned without a loop, at 1 kHz, to see what comes of it: the specification of firmware/core/workbench.c.

Duty grows until an encoder gives counts, goes a little higher and stays; or it is all there from the beginning. The
turn ends after so many counts of any encoder, after its time, or when the drivers report a fault; then the motor is
shorted for a moment. What it is for: which encoder belongs to which motor, which way round, and what duty that needs.
"""

from __future__ import annotations

from dataclasses import dataclass

from curveline.radio.protocol.codes import TRACE_MS, TRACE_SAMPLES, Counts

LIFE_COUNTS = 4
"""Fewer counts may be the noise of a dead channel."""
MARGIN_DUTY = 100
"""Above the duty at which something moved [thousandths], so that it goes on moving."""
REST_MS = 60
DRIVER_MS = 2
"""Drivers may report a fault for so long before it counts; theirs ends by itself after about 1 ms."""
SAMPLE_MOST = 0x7FFF
THOUSAND = 1000


@dataclass(frozen=True, slots=True)
class Turn:
    """What a turn is to be: axis from 1, duty in thousandths with its sign, and what ends it."""

    axis: int
    duty: int
    counts: int
    span_ms: int
    at_once: bool = False


class Workbench:
    """A turn as it goes on, and what the last one came to; call `tick` once a millisecond."""

    def __init__(self) -> None:
        self.turn = Turn(1, 0, 0, 0)
        self.busy = False
        self.duty = 0
        self.threshold = 0
        self.samples: list[int] = []
        self._begin: Counts = (0, 0, 0)
        self._at_ms = self._rest_ms = self._driver_ms = self._sample_ms = 0

    def start(self, turn: Turn, counts: Counts) -> None:
        """Begin, with the encoders at `counts`."""
        self.turn, self._begin, self.busy = turn, counts, True
        self.duty = self.threshold = 0
        self.samples = []
        self._at_ms = self._rest_ms = self._driver_ms = self._sample_ms = 0

    def stop(self) -> None:
        """Somebody has ended it: the motor is shorted."""
        self.busy, self.duty = False, 0

    def tick(self, counts: Counts, *, driver_fault: bool = False) -> int:
        """One millisecond; the duty for the motor in thousandths."""
        if not self.busy:
            return 0
        self._at_ms += 1
        far = max(abs(now - begin) for now, begin in zip(counts, self._begin, strict=True))
        self._note(counts, far)
        self._driver_ms = self._driver_ms + 1 if driver_fault else 0
        is_over = far >= self.turn.counts or self._at_ms > self.turn.span_ms or self._driver_ms > DRIVER_MS
        if is_over or self._rest_ms:
            self._rest_ms += 1
            self.busy = self._rest_ms < REST_MS
            self.duty = 0
        else:
            self.duty = self._wanted()
        return self.duty

    def _note(self, counts: Counts, far: int) -> None:
        if self.threshold == 0 and far >= LIFE_COUNTS:
            self.threshold = max(1, abs(self.duty))
        if (self.turn.at_once or self.threshold) and len(self.samples) < TRACE_SAMPLES:
            if self._sample_ms % TRACE_MS == 0:
                gone = counts[self.turn.axis - 1] - self._begin[self.turn.axis - 1]
                self.samples.append(max(-SAMPLE_MOST, min(SAMPLE_MOST, gone)))
            self._sample_ms += 1

    def _wanted(self) -> int:
        turn, most = self.turn, abs(self.turn.duty)
        if turn.at_once:
            duty = most
        elif self.threshold:
            duty = min(most, self.threshold + MARGIN_DUTY)
        else:
            duty = most * self._at_ms // turn.span_ms
        return duty if turn.duty > 0 else -duty

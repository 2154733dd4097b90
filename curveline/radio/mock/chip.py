"""The sending end of a modelled radio: one chip, one stretch of air and one clock, which several displays may share."""

from __future__ import annotations

import time
from random import Random

from curveline.radio.clock import steady_us
from curveline.radio.mock.air import Air
from curveline.radio.mock.spec import MockSpec


class MockChip:
    """What all displays behind one modelled radio have in common; its time is virtual unless that of the world counts.

    `random` is what chance there is, the same for the same seed.
    """

    def __init__(self, spec: MockSpec, data_rate: str) -> None:
        self.random = Random(spec.seed)
        self.air = Air(spec.weather, data_rate, self.random)
        self._realtime = spec.realtime
        self._start_us = steady_us()
        self._virtual_us = 0

    @property
    def is_virtual(self) -> bool:
        """Whether time passes only as it is let pass."""
        return not self._realtime

    def now_us(self) -> int:
        """Time since the radio was opened."""
        return steady_us() - self._start_us if self._realtime else self._virtual_us

    def sleep_until(self, moment_us: int) -> None:
        """Let time pass."""
        if self._realtime:
            time.sleep(max(0, moment_us - self.now_us()) / 1e6)
        else:
            self._virtual_us = max(self._virtual_us, moment_us)

    def skip_to(self, moment_us: int) -> None:
        """Nobody drives any more: from here on time is virtual, and it is that late."""
        self._virtual_us = max(moment_us, 0 if self._realtime else self._virtual_us)
        self._realtime = False

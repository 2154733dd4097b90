"""The real image gets other settings from the real host, which is killed on the way and begins again."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import pytest

from curveline.radio.host.resettling import NodeSeat, Resettling
from curveline.radio.interface import Answer
from curveline.radio.protocol.keys import Site

from .display import Rig
from .fleet import MASTER, ChipRadio, Fleet
from .image import Image

NEW_MASTER = bytes(range(60, 76))


class Killed(BaseException):
    """The host's process is gone."""


class MortalRadio(ChipRadio):
    """A host's radio, whose process dies before one exchange."""

    left = 10**9

    def exchange(self, frames: Sequence[tuple[str, bytes]]) -> Sequence[Answer]:
        MortalRadio.left -= 1
        if MortalRadio.left < 0:
            raise Killed
        return super().exchange(frames)


class FleetTuner:
    """A host's radio that is set up for one display file or the other."""

    def __init__(self, fleet: Fleet) -> None:
        self.fleet = fleet
        self._radio: ChipRadio | None = None

    def radio(self, seat: NodeSeat) -> ChipRadio:
        if self._radio is None or self.fleet.drive != seat.drive:
            self.fleet.drive = seat.drive
            self._radio = MortalRadio(self.fleet)
        self._radio.site = seat.site
        return self._radio

    def now_s(self) -> float:
        return 1e-6 * self.fleet.now_us


@pytest.mark.parametrize("last", [None, 30, 80, 120])
def test_a_host_brings_a_real_program_to_other_settings(
    image: Image, homed_flash: bytes, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, last: int | None
) -> None:
    """Channel, rate, address and key; the position survives. Killed before, as, or while it tries them, it goes on."""
    rig = Rig(image, homed_flash, tmp_path, count=1)
    rig.fleet.run(100_000)
    drive, chips = rig.plan.drive, rig.fleet.site.chips
    moved = replace(drive, channel=90, data_rate="2Mbps", addresses=("D2D2D2D255",))
    old, new = NodeSeat(drive, Site(MASTER, chips), 1), NodeSeat(moved, Site(NEW_MASTER, chips), 1)
    told: list[str] = []
    if last is not None:
        monkeypatch.setattr(MortalRadio, "left", last)
        first = Resettling(FleetTuner(rig.fleet), new, old, told.append)
        with pytest.raises(Killed):
            first.carry_out()
    monkeypatch.setattr(MortalRadio, "left", 10**9)
    way = Resettling(FleetTuner(rig.fleet), new, old, told.append)
    found = way.carry_out()
    assert way.is_settled(found)
    assert (found.seat, found.standing.generation, found.report.axes) == (new, 1, (0, 0, 0))
    assert found.axes == new.settings.axes
    assert Resettling(FleetTuner(rig.fleet), new, old, told.append).find() == replace(found, report=found.report)

"""A radio that sends to nodes of more than one display file in turn: other channels, other data rates, other keys."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

from curveline.drive_settings import DriveSettings
from curveline.radio.host.resettling import NodeSeat
from curveline.radio.interface import Radio, open_radio
from curveline.radio.mock.display import MockRadio
from curveline.radio.mock.spec import parse_spec
from curveline.radio.site.key_file import at_hand, lenient


def is_open_mock(spec: str) -> bool:
    """Whether a radio is a mock display whose nodes hold the mock's open key."""
    name, _, settings = spec.partition(":")
    return name == "mock" and not parse_spec(settings).keys


class RadioTuner:
    """The radio that `spec` names, for a display at first; `close` gives it back.

    A mock display is tuned as it is, since its time goes on; any other radio is opened anew.
    """

    def __init__(self, spec: str, drive: DriveSettings, runs: Path) -> None:
        self.spec = spec
        self.masters: tuple[bytes, ...] = ()
        """Keys that the boards of a mock display may hold; nothing else needs them."""
        self._drive = drive
        self._runs = runs
        self._radio: Radio | None = None
        self._past_s = 0.0

    def __repr__(self) -> str:
        return f"<radio {self.spec}>"

    def radio(self, seat: NodeSeat) -> Radio:
        """See Tuner."""
        radio = self._tuned(seat.drive)
        radio.site = seat.site
        return radio

    def now_s(self) -> float:
        """See Tuner."""
        return self._past_s + (0.0 if self._radio is None else 1e-6 * self._radio.now_us())

    def listeners(self) -> Mapping[str, int]:
        """Which chip listens on which address, if the radio is a mock display."""
        radio = self._tuned(self._drive)
        return radio.listeners() if isinstance(radio, MockRadio) else {}

    def close(self) -> None:
        """Give the radio back."""
        if self._radio is not None:
            self._past_s = self.now_s()
            self._radio.close()
            self._radio = None

    def _tuned(self, drive: DriveSettings) -> Radio:
        here = self._drive.channel, self._drive.data_rate
        is_elsewhere = (drive.channel, drive.data_rate) != here or drive.display != self._drive.display
        if self._radio is not None and is_elsewhere and not isinstance(self._radio, MockRadio):
            self.close()
        if self._radio is None:
            with lenient(without_file=True), at_hand(*self.masters):
                self._radio = open_radio(self.spec, drive, self._runs)
        elif is_elsewhere and isinstance(self._radio, MockRadio):
            self._radio.tune(drive)
        self._drive = drive
        return self._radio

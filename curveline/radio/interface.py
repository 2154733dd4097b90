"""The radio link: frames, the state machines of host and node, the journal, and the back ends that carry frames.

A back end is one module with an `open(spec, drive, runs)` of the shape of `open_radio`, and one row in `BACK_ENDS`.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from importlib import import_module
from pathlib import Path
from typing import Protocol, cast

from curveline.drive_settings import ADDRESS, DriveSettings
from curveline.errors import InvalidInput, LinkError
from curveline.radio.frame_tap import FrameTap, Tap
from curveline.radio.protocol.codes import FRAME_BYTES
from curveline.radio.protocol.keys import Site

BACK_ENDS = {
    "mock": "curveline.radio.mock.display",
    "nrf24": "curveline.radio.ports.nrf24",
    "serial": "curveline.radio.ports.serial",
}
"""Name of a radio -> module that opens it; loaded when first used."""

BATCH = 16
"""Frames in one exchange at most: what even a row of silent nodes answers within 50 ms."""


@dataclass(frozen=True, slots=True)
class Answer:
    """What came back for one frame: a payload, empty if the node had none loaded, or None if nothing came.

    `retries` is how often the chip repeated the packet.
    """

    payload: bytes | None
    retries: int = 0


class RadioGone(LinkError):
    """The radio itself went away, not a node; while it `may_return`, a further exchange tries to reach it again."""

    code = "radio-gone"

    def __init__(self, message: str, hint: str = "", *, may_return: bool) -> None:
        super().__init__(message, hint)
        self.may_return = may_return


class InUse(LinkError):
    """Another process of this computer has the radio, or the mock display, most likely for a run."""

    code = "in-use"


class Radio(Protocol):
    """A way to the nodes of one site, and the clock that its times are told by.

    `tap` is told of every exchange, once it is over.
    """

    site: Site
    tap: Tap

    def exchange(self, frames: Sequence[tuple[str, bytes]]) -> Sequence[Answer]:
        """Send up to `BATCH` frames, each an address and a payload, in order; what came back for each."""
        ...

    def close(self) -> None:
        """Give the radio back; a second call does nothing."""
        ...

    def carriers(self) -> Sequence[int]:
        """The channels, of 126, on which somebody sends just now, in rising order; nothing is sent meanwhile."""
        ...

    def set_power(self, power: str) -> None:
        """Send with one of `POWERS_DBM` from now on; LinkError if this radio has only one."""
        ...

    def now_us(self) -> int:
        """Time that only grows [us]."""
        ...

    def sleep_until(self, moment_us: int) -> None:
        """Let time pass."""
        ...


def check_frames(frames: Sequence[tuple[str, bytes]]) -> None:
    """InvalidInput unless these can go out in one exchange: not too many, whole frames, addresses of five bytes."""
    if len(frames) > BATCH:
        raise InvalidInput(f"an exchange takes at most {BATCH} frames, not {len(frames)}")
    for address, payload in frames:
        if len(payload) != FRAME_BYTES:
            raise InvalidInput(f"a frame has {FRAME_BYTES} bytes, not {len(payload)}")
        if re.fullmatch(ADDRESS, address) is None:
            raise InvalidInput(f"an address has ten hexadecimal digits, not {address[:40]!r}")


Opener = Callable[[str, DriveSettings, Path], Radio]


def check_radio(spec: str) -> None:
    """InvalidInput unless there is a radio of the kind that `spec` names; it is not opened."""
    name = spec.partition(":")[0]
    if name not in BACK_ENDS:
        there = ", ".join(sorted(BACK_ENDS))
        raise InvalidInput(
            f"there is no radio {name!r} in this release of curveline; there is: {there}",
            hint="use `--radio mock` for a model of the display, `serial:PORT` for a dongle, `nrf24:CE,CSN` for a chip",
        )


def open_radio(spec: str, drive: DriveSettings, runs: Path) -> Radio:
    """The radio that `spec` names, as `NAME` or `NAME:SETTINGS`; InvalidInput for what does not exist.

    `runs` is the runs folder, in which a mock display keeps its state.
    """
    check_radio(spec)
    name, _, settings = spec.partition(":")
    opener = cast(Opener, import_module(BACK_ENDS[name]).open_radio)
    radio = opener(settings, drive, runs)
    radio.tap = FrameTap(spec, [(drive, radio.site)], runs, radio.now_us)
    return radio

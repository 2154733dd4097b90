"""One radio for several displays: each sees it as its own, with the keys of its nodes."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import ExitStack, contextmanager
from importlib import import_module
from pathlib import Path

from curveline.drive_settings import DriveSettings
from curveline.radio.frame_tap import FrameTap, Tap, untapped
from curveline.radio.interface import BACK_ENDS, Answer, Radio, check_radio, open_radio
from curveline.radio.protocol.keys import Site
from curveline.radio.site.key_file import hardware_site


class RadioShare:
    """See Radio; what one display has of a radio that others use, too. Whoever opened the radio closes it."""

    def __init__(self, radio: Radio, site: Site) -> None:
        self.site = site
        self.tap: Tap = untapped  # the radio has one
        self._radio = radio

    def exchange(self, frames: Sequence[tuple[str, bytes]]) -> Sequence[Answer]:
        """See Radio."""
        return self._radio.exchange(frames)

    def carriers(self) -> Sequence[int]:
        """See Radio."""
        return self._radio.carriers()

    def set_power(self, power: str) -> None:
        """See Radio."""
        self._radio.set_power(power)

    def close(self) -> None:
        """See Radio; the radio stays with the others."""

    def now_us(self) -> int:
        """See Radio."""
        return self._radio.now_us()

    def sleep_until(self, moment_us: int) -> None:
        """See Radio."""
        self._radio.sleep_until(moment_us)


@contextmanager
def opened_together(spec: str, drives: Sequence[DriveSettings], runs: Path) -> Iterator[list[Radio]]:
    """The radio that `spec` names, as each of some displays has it, which are all on one channel at one data rate.

    Errors as of `open_radio`.
    """
    check_radio(spec)
    name, _, settings = spec.partition(":")
    module = import_module(BACK_ENDS[name])
    with ExitStack() as opened:
        if hasattr(module, "open_together"):
            radios: list[Radio] = module.open_together(settings, drives, runs)
            for each, drive in zip(radios, drives, strict=True):
                opened.callback(each.close)
                each.tap = FrameTap(spec, [(drive, each.site)], runs, each.now_us)
            yield radios
            return
        radio = open_radio(spec, drives[0], runs)
        opened.callback(radio.close)
        radio.tap = FrameTap(spec, [(drive, hardware_site(drive)) for drive in drives], runs, radio.now_us)
        yield [RadioShare(radio, hardware_site(drive)) for drive in drives]

"""The radio behind a USB serial port: a dongle that sends up to 16 frames by itself for each request.

A dongle that goes away is noticed within 200 ms, and looked for over 30 s, wherever it comes up again.
"""

from __future__ import annotations

import errno
import time
from collections.abc import Callable, Sequence
from contextlib import suppress
from pathlib import Path
from typing import TypeVar

from curveline.drive_settings import DriveSettings
from curveline.errors import InvalidInput, LinkError
from curveline.radio.clock import steady_us
from curveline.radio.frame_tap import Tap, untapped
from curveline.radio.interface import Answer, InUse, RadioGone, check_frames
from curveline.radio.ports.dongle import CAN_SET_POWER, FLASH_HINT, HELLOS, Dongle, DongleIdent, Line, LineLost
from curveline.radio.protocol.air_time import RATES_KBPS
from curveline.radio.protocol.band import FULL_POWER
from curveline.radio.protocol.keys import Site
from curveline.radio.site.key_file import hardware_site

READ_S = 0.02
"""How long one look at the port waits for the first byte."""
WRITE_S = 0.05
RETURN_S = 30.0
"""How long a dongle that has gone may take to come back."""
LOOK_S = 0.05
"""Pause between two looks for it."""
PJRC = 0x16C0
"""USB vendor number of Teensy boards."""

GONE_HINT = "plug it in again; a run that this has ended goes on with `curveline send --resume RUN`"
NONE_HINT = "see that it is the dongle's port, and that the dongle runs the program in firmware/dongle"
LOCKED = frozenset({errno.EAGAIN, errno.EACCES, errno.EBUSY})
Said = TypeVar("Said")
BAUD = 115200
"""Means nothing on USB, but a port must be opened with some rate."""


def open_radio(settings: str, drive: DriveSettings, runs: Path) -> SerialRadio:
    """The dongle at the port that `settings` names, locked for this process and ready to send."""
    path = settings.strip()
    if not path:
        raise InvalidInput("the serial radio needs a port: `--radio serial:PORT`", hint=_ports_hint())
    if drive.data_rate not in RATES_KBPS:
        raise InvalidInput(f"data rate {drive.data_rate!r} is unknown; there are {', '.join(RATES_KBPS)}")
    return SerialRadio(path, drive, hardware_site(drive))


class SerialRadio:
    """A `Radio` at a serial port; `gone_since_us` tells since when its dongle has been away, None while it is there."""

    def __init__(
        self, path: str, drive: DriveSettings, site: Site, opener: Callable[[str], Line] | None = None
    ) -> None:
        self.site = site
        self.tap: Tap = untapped
        self.path = path
        self.gone_since_us: int | None = None
        self._drive = drive
        self._open = opener or SerialLine
        self._why, self._hint = "", GONE_HINT
        self._closed = False
        self._power = FULL_POWER
        self._dongle, ident = self._connect(path, HELLOS)
        self._unique, self._capabilities = ident.unique, ident.capabilities
        self._usb_serial = _usb_serial(path)

    # Radio

    def exchange(self, frames: Sequence[tuple[str, bytes]]) -> Sequence[Answer]:
        """See Radio; RadioGone if the dongle is away, and again at every call until it is back.

        No frames at all only ask whether it is back. What was under way when it went counts as not answered.
        """
        check_frames(frames)
        if self._closed:
            raise LinkError(f"the radio at {self.path} is closed")
        if self.gone_since_us is not None:
            self._look_for_it()
        try:
            answers = self._dongle.exchange(frames) if frames else []
        except LineLost as lost:
            self._dongle.line.close()
            self._why, self._hint = str(lost), lost.hint or GONE_HINT
            self.gone_since_us = self.now_us()
            raise self._gone() from lost
        self.tap(frames, answers)
        return answers

    def close(self) -> None:
        """See Radio."""
        self._closed = True
        self._dongle.line.close()

    def now_us(self) -> int:
        """See Radio."""
        return steady_us()

    def sleep_until(self, moment_us: int) -> None:
        """See Radio."""
        time.sleep(max(0, moment_us - self.now_us()) / 1e6)

    def carriers(self) -> Sequence[int]:
        """See Radio."""
        return self._asked(lambda dongle: dongle.scan())

    def set_power(self, power: str) -> None:
        """See Radio; a dongle that comes back is given it again."""
        if power != FULL_POWER and not self._capabilities & CAN_SET_POWER:
            hint = f"{FLASH_HINT}; or measure with `--level {FULL_POWER}` alone"
            raise LinkError(f"the program of the dongle at {self.path} is too old to send with less power", hint)
        self._power = power
        self._asked(lambda dongle: dongle.configure(self._drive.channel, self._drive.data_rate, power))

    def _asked(self, question: Callable[[Dongle], Said]) -> Said:
        """What the dongle says to a question; LinkError if it is gone."""
        try:
            return question(self._dongle)
        except LineLost as lost:
            raise LinkError(f"the dongle at {self.path} is out of action: {lost}", lost.hint or GONE_HINT) from lost

    # The dongle, and its return

    def _connect(self, path: str, tries: int) -> tuple[Dongle, DongleIdent]:
        """Open a port, see that a dongle of our version is behind it, and set up its radio; LinkError if not."""
        line = self._open(path)
        try:
            dongle = Dongle(line, path)
            ident = dongle.introduce(tries)
            power = self._power if ident.capabilities & CAN_SET_POWER else FULL_POWER
            dongle.configure(self._drive.channel, self._drive.data_rate, power)
        except LineLost as lost:
            line.close()
            raise LinkError(f"no dongle can be used at {path}: {lost}", lost.hint or NONE_HINT) from lost
        except BaseException:
            line.close()
            raise
        return dongle, ident

    def _look_for_it(self) -> None:
        """Take the dongle back if it is there again, the same one, at its old port or at another."""
        for path in self._places():
            try:
                dongle, ident = self._connect(path, tries=1)
            except LinkError as error:
                self._why, self._hint = error.message, error.hint
                continue
            if ident.unique == self._unique:
                self._dongle, self.path, self.gone_since_us = dongle, path, None
                return
            dongle.line.close()
            self._why, self._hint = f"there is another dongle at {path}", GONE_HINT
        time.sleep(LOOK_S)
        raise self._gone()

    def _places(self) -> list[str]:
        others = [] if self._usb_serial is None else _ports_with(self._usb_serial)
        return [self.path, *(path for path in others if path != self.path)]

    def _gone(self) -> RadioGone:
        since_us = self.gone_since_us if self.gone_since_us is not None else self.now_us()
        away_s = (self.now_us() - since_us) / 1e6
        may_return = away_s < RETURN_S and not self._closed
        for_long = "" if may_return else f", for {away_s:.0f} s"
        message = f"the dongle at {self.path} is out of action{for_long}: {self._why}"
        return RadioGone(message, self._hint, may_return=may_return)


class SerialLine:
    """A serial port, open for this process alone."""

    def __init__(self, path: str) -> None:
        import serial

        try:
            self._port = serial.Serial(path, BAUD, timeout=READ_S, write_timeout=WRITE_S, exclusive=True)
        except (OSError, ValueError) as error:
            raise _cannot_open(path, error) from None
        except Exception as error:  # termios.error, where there is one, is nothing but an Exception
            raise LinkError(f"{path} cannot be used as a serial port: {error}", _ports_hint()) from None

    def write(self, data: bytes) -> None:
        """See Line."""
        try:
            self._port.write(data)
        except OSError as error:
            raise LineLost(_how(error)) from error

    def read(self) -> bytes:
        """See Line."""
        try:
            first: bytes = self._port.read(1)
            rest: bytes = self._port.read(self._port.in_waiting) if first else b""
        except OSError as error:
            raise LineLost(_how(error)) from error
        return first + rest

    def now_s(self) -> float:
        """See Line."""
        return time.monotonic()

    def close(self) -> None:
        """See Line."""
        with suppress(OSError):
            self._port.close()


def _how(error: OSError) -> str:
    return "it takes nothing any more" if "timeout" in str(error).lower() else "it was unplugged"


def _cannot_open(path: str, error: Exception) -> LinkError:
    """Why a port could not be opened, in a sentence of ours."""
    number, said = getattr(error, "errno", None), str(error)
    # On Windows pyserial gives no number, but the name of the system's error, and a port has one user at a time.
    if number == errno.ENOENT or isinstance(error, FileNotFoundError) or "FileNotFoundError" in said:
        return LinkError(f"there is no port {path}", _ports_hint())
    if ("lock" in said and number in LOCKED) or (number is None and "PermissionError" in said):
        return InUse(f"the port {path} is in use by another program", "only one program can use a dongle at a time")
    if number in (errno.EACCES, errno.EPERM):
        hint = "the udev rule in firmware/dongle/README.md, or membership of the group dialout, permits it"
        return LinkError(f"this user may not open {path}", hint)
    return LinkError(f"{path} cannot be used as a serial port: {said}", _ports_hint())


def _ports_hint() -> str:
    from serial.tools import list_ports

    ports = list(list_ports.comports())
    likely = [port for port in ports if port.vid == PJRC] or [port for port in ports if port.vid is not None]
    if not likely:
        return "no USB serial port is there: plug the dongle in"
    named = ", ".join(
        f"serial:{port.device} ({port.description})" for port in sorted(likely, key=lambda port: port.device)
    )
    return f"there is {named}"


def _usb_serial(path: str) -> str | None:
    """The USB serial number of the device at a port, None if it has none."""
    from serial.tools import list_ports

    real = str(Path(path).resolve())
    return next((port.serial_number for port in list_ports.comports() if port.device in (path, real)), None)


def _ports_with(usb_serial: str) -> list[str]:
    from serial.tools import list_ports

    return [port.device for port in list_ports.comports() if port.serial_number == usb_serial]

"""Which of a board's GPIO chips its pin header hangs on, and which one pyrf24 was built for.

The library opens the chip that it was built for, and nothing can tell it another one. Boards and kernels number their
chips as they like: on a Raspberry Pi 5 the header was the fifth one until its kernels were taught to make it the first.
"""

from __future__ import annotations

import importlib.util
import os
import re
from contextlib import suppress
from pathlib import Path

from curveline.system import portable

HEADERS = ("pinctrl-rp1", "pinctrl-bcm2711", "pinctrl-bcm2835")
"""What kernels call the chip of a Raspberry Pi's header: 5; 4; those before."""
MOST_CHIPS = 16
CHIP_INFO = 0x8044B401
"""The kernel's GPIO_GET_CHIPINFO_IOCTL: name and label, 32 bytes each, and the number of lines."""
_INFO_BYTES, _LABEL = 68, slice(32, 64)
_CHIP_NAME = re.compile(rb"/dev/gpiochip[0-9]+")


def header_chip() -> tuple[str, str] | None:
    """Path and label of the chip of this board's pin header; None if it is not a board that is known here."""
    for number in range(MOST_CHIPS):
        path = f"/dev/gpiochip{number}"
        label = _label(path)
        if label in HEADERS:
            return path, label
    return None


def library_chip() -> str | None:
    """The chip that the installed pyrf24 was built for; None if it does not say."""
    with suppress(OSError, ImportError, ValueError):
        spec = importlib.util.find_spec("pyrf24.pyrf24")
        if spec is not None and spec.origin:
            names = set(_CHIP_NAME.findall(Path(spec.origin).read_bytes()))
            return names.pop().decode() if len(names) == 1 else None
    return None


def _label(path: str) -> str:
    """What the kernel calls a chip; "" if it is not there, or not for this user."""
    info = bytearray(_INFO_BYTES)
    with suppress(OSError):
        chip = os.open(path, os.O_RDONLY)
        try:
            portable.ask_device(chip, CHIP_INFO, info)
        finally:
            os.close(chip)
    return bytes(info[_LABEL]).split(b"\0", 1)[0].decode("ascii", "replace")

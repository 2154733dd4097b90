"""Hosts that are killed: a child process, and a disk under a record that kills it at one of its points."""

from __future__ import annotations

import os
import signal
import traceback
from collections.abc import Callable

from curveline.radio.host.journal import SystemDisk
from curveline.radio.mock.display import MockRadio

NEVER = 1 << 30
SIGKILLED = -signal.SIGKILL
POINTS = 2
"""Of each record: before it is written, and when half of it is; after it is before the next one."""


class FatalDisk(SystemDisk):
    """A disk whose process does not outlive one of the points it comes to."""

    def __init__(self, fatal: int) -> None:
        self._left = fatal

    def point(self) -> None:
        """Come to a point."""
        if self._left == 0:
            os.kill(os.getpid(), signal.SIGKILL)
        self._left -= 1

    def write(self, descriptor: int, data: bytes, offset: int) -> int:
        """See Disk."""
        self.point()
        half = super().write(descriptor, data[: len(data) // 2], offset)
        self.point()
        return half + super().write(descriptor, data[half:], offset + half)

    def sync(self, descriptor: int) -> None:
        """See Disk; a kill needs no sync, so none is waited for."""


def put_under_records(fatal: int) -> None:
    """Have all records of this process, which is a child, on such a disk."""
    disk = FatalDisk(fatal)
    MockRadio.disk = property(lambda radio: disk, lambda radio, other: None)  # type: ignore[assignment]


def in_a_child(work: Callable[[], object]) -> int:
    """Do it in a process of its own; its exit code, 1 if it raised, negative if it was killed."""
    pid = os.fork()
    if pid == 0:
        code = 1
        try:
            work()
            code = 0
        except BaseException:
            traceback.print_exc()
        finally:
            os._exit(code)
    return os.waitstatus_to_exitcode(os.waitpid(pid, 0)[1])

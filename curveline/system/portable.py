"""What Linux, macOS and Windows do differently: the only module that knows on which of them it runs.

Descriptors are never inherited by other programs: Python sees to that everywhere.
"""

from __future__ import annotations

import contextlib
import errno
import os
import signal
import sys
import time
from collections.abc import Iterator
from pathlib import Path

IS_WINDOWS = sys.platform == "win32"
HAS_SPI = sys.platform == "linux"
"""Whether the system has an SPI bus that a radio chip can be reached over."""

PLAIN = getattr(os, "O_BINARY", 0)
"""For `os.open`: bytes go to the file as they are; Windows would put a carriage return before every newline."""
NO_WAIT = getattr(os, "O_NONBLOCK", 0)
"""For `os.open`: a pipe is opened without waiting for its other end; Windows has no pipes among its files."""

STOP_SIGNALS = tuple(
    getattr(signal, name) for name in ("SIGINT", "SIGTERM", "SIGHUP", "SIGBREAK") if hasattr(signal, name)
)
"""What Ctrl-C, a closed terminal and a shutdown send."""

_OTHERS = 0o077
_CHUNK = 1 << 16
_LOCKED = frozenset({errno.EAGAIN, errno.EWOULDBLOCK, errno.EACCES, errno.EDEADLK})
"""What systems answer if another process has the lock."""
_NO_RESERVE = frozenset({errno.EOPNOTSUPP, errno.EINVAL, errno.ENOSYS})
"""What file systems answer that cannot reserve space."""
_PAUSES_S = (0.01, 0.03, 0.1, 0.3, 1.0)
_CLOCK = getattr(time, "CLOCK_BOOTTIME", getattr(time, "CLOCK_MONOTONIC", 0))
"""Linux stops its monotonic clock while the computer sleeps, but not this one; macOS names it the other way round."""


# Files


def lock(descriptor: int) -> bool:
    """Keep other processes from locking an open file; False if one has it, OSError where files cannot be locked.

    The lock ends when the descriptor is closed or its process ends, however that ends. On Windows nobody else can read
    what is locked: lock a file that holds nothing.
    """
    try:
        if sys.platform == "win32":
            import msvcrt

            os.lseek(descriptor, 0, os.SEEK_SET)
            msvcrt.locking(descriptor, msvcrt.LK_NBLCK, 1)
        else:
            import fcntl

            fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except OSError as error:
        if error.errno in _LOCKED:
            return False
        raise
    return True


def ask_device(descriptor: int, request: int, answer: bytearray) -> None:
    """Fill `answer` with what a driver says to a request; OSError if it does not know it, or systems have none."""
    if sys.platform == "win32":
        raise OSError(errno.ENOSYS, "there are no such requests here")
    import fcntl

    fcntl.ioctl(descriptor, request, answer)


def write_at(descriptor: int, data: bytes, offset: int) -> int:
    """Write at `offset` of an open file; how many bytes were taken."""
    if sys.platform == "win32":
        os.lseek(descriptor, offset, os.SEEK_SET)
        return os.write(descriptor, data)
    return os.pwrite(descriptor, data, offset)


def reserve(descriptor: int, size: int) -> None:
    """Make sure that an open file has room for `size` bytes, by zeros at its end; OSError if it has not."""
    if hasattr(os, "posix_fallocate"):
        try:
            os.posix_fallocate(descriptor, 0, size)
        except OSError as error:
            if error.errno not in _NO_RESERVE:
                raise
    # Without that call, or the file system's help: by hand.
    end = os.lseek(descriptor, 0, os.SEEK_END)
    while end < size:
        end += write_at(descriptor, bytes(min(size - end, _CHUNK)), end)


def sync(descriptor: int) -> None:
    """Force an open file to the medium; on macOS `fsync` only hands it to the drive, which may keep it for a while."""
    if sys.platform == "darwin":
        import fcntl

        with contextlib.suppress(OSError):  # not every file system there can
            fcntl.fcntl(descriptor, fcntl.F_FULLFSYNC)
            return
    os.fsync(descriptor)


def sync_folder(folder: Path) -> None:
    """Force the entries of a folder to the medium, so that a new file in it survives a loss of power.

    Windows opens no folders; its file system keeps a journal of them.
    """
    if IS_WINDOWS:
        return
    descriptor = os.open(folder, os.O_RDONLY)
    try:
        os.fsync(descriptor)
    finally:
        os.close(descriptor)


def replace(source: Path, target: Path) -> None:
    """Give a file the name of another, which is gone then, in one go.

    Windows refuses that while any program has the other one open, as a virus scanner does for a moment.
    """
    for pause_s in _PAUSES_S if IS_WINDOWS else ():
        try:
            return replace_at_once(source, target)
        except PermissionError:
            time.sleep(pause_s)
    return replace_at_once(source, target)


def replace_at_once(source: Path, target: Path) -> None:
    """As `replace`, for those who cannot wait: PermissionError on Windows while any program has the other one open."""
    os.replace(source, target)


def others_may_reach(mode: int) -> bool:
    """Whether the mode of a file lets other users read or change it; on Windows modes say nothing about that."""
    return not IS_WINDOWS and bool(mode & _OTHERS)


def is_hang_up(error: OSError) -> bool:
    """Whether a stream could not be written because its reader has left."""
    return isinstance(error, BrokenPipeError) or (IS_WINDOWS and error.errno == errno.EINVAL)


# Processes, time, terminals


@contextlib.contextmanager
def interrupts_held_back() -> Iterator[None]:
    """Keep Ctrl-C from processes that are started within this, from their first moment on.

    Windows cannot; there a process that has begun calls `ignore_interrupts`.
    """
    if sys.platform == "win32":
        yield
        return
    from multiprocessing import resource_tracker

    # Starting the tracker, which comes with the first process, would let interrupts through again.
    resource_tracker.ensure_running()
    before = signal.pthread_sigmask(signal.SIG_BLOCK, [signal.SIGINT])
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)


def ignore_interrupts() -> None:
    """Leave Ctrl-C to the parent, in a process that it started."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)


def cores() -> int:
    """Processors that this process may use."""
    if hasattr(os, "sched_getaffinity"):
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1


def steady_ns() -> int:
    """Nanoseconds since some moment in the past; they never go back, and a suspended computer does not stop them."""
    if sys.platform == "win32":
        # The monotonic clock there ticks every 16 ms, this one much faster, and both while the computer sleeps.
        return time.perf_counter_ns()
    return time.clock_gettime_ns(_CLOCK)


def takes_escapes() -> bool:
    """Whether a terminal shows escape sequences as colours; the old console of Windows prints them."""
    return not IS_WINDOWS or any(os.environ.get(name) for name in ("WT_SESSION", "TERM", "ANSICON"))

"""Makes Python on Linux look like Python on another system, to curveline.

A process with this folder on its PYTHONPATH and `win32` or `darwin` in IMITATED imitates; so do its workers. To code of
`SEEN_BY`, modules and names that the system lacks are missing (`lacking-*.txt`, from the conditions in
typeshed's stubs). Everything else, numba, rich, pyserial and the standard library, goes on seeing Linux, on which it
runs. What Windows does differently with files holds for all: an open file keeps its name, a locked one is read by
nobody else, `os.open` without O_BINARY writes a carriage return before every newline.
"""

from __future__ import annotations

import builtins
import errno
import fcntl
import io
import os
import signal
import stat
import sys
import time
from collections.abc import Callable
from pathlib import Path
from types import ModuleType
from typing import Any

SYSTEM = os.environ.get("IMITATED", "")
SEEN_BY = "curveline"
FULL_SYNC = 51
BINARY = 1 << 40
"""A flag of `os.open` that Linux does not have."""
BREAK = 21

_getframe = sys._getframe
_text: set[int] = set()
_looked_at: dict[str, int] = {}


def is_seen_by(depth: int) -> bool:
    """Whether the code that many calls up is to see the imitated system."""
    return str(_getframe(depth + 1).f_globals.get("__name__", "")).startswith(SEEN_BY)


def disguise(module: ModuleType, lacking: frozenset[str], others: dict[str, Any]) -> None:
    """Let a module have other attributes for some of those that look at it."""

    class Disguised(ModuleType):
        def __getattribute__(self, name: str) -> Any:
            if (name in lacking or name in others) and is_seen_by(1):
                if name in others:
                    return others[name]
                raise AttributeError(f"module {module.__name__!r} has no attribute {name!r} on {SYSTEM}")
            return ModuleType.__getattribute__(self, name)

    module.__class__ = Disguised


def change_imports(lacking: frozenset[str], further: dict[str, ModuleType]) -> None:
    """Let some imports fail and some succeed for those that are to see the imitated system."""
    really = builtins.__import__

    def import_or_not(name: str, globals: Any = None, *rest: Any, **more: Any) -> ModuleType:
        importer = str((globals or {}).get("__name__", ""))
        if importer.startswith(SEEN_BY) and name in further:
            return further[name]
        if importer.startswith(SEEN_BY) and name.split(".")[0] in lacking:
            raise ModuleNotFoundError(f"No module named {name!r} on {SYSTEM}", name=name)
        return really(name, globals, *rest, **more)

    builtins.__import__ = import_or_not


# macOS


def full_sync(descriptor: int, command: int, argument: Any = 0) -> Any:
    """`fcntl.fcntl` with the command by which macOS forces a file to the medium."""
    if command == FULL_SYNC:
        os.fsync(descriptor)
        return 0
    return fcntl.fcntl(descriptor, command, argument)


# Windows


def refuse(path: object, why: str = "The process cannot access the file") -> PermissionError:
    """What Windows answers."""
    return PermissionError(errno.EACCES, why, os.fspath(path))  # type: ignore[call-overload]


def is_open(path: object) -> bool:
    """Whether this process has a file open."""
    wanted = os.path.realpath(path)  # type: ignore[call-overload]
    for number in os.listdir("/proc/self/fd"):
        try:
            if os.readlink(f"/proc/self/fd/{number}") == wanted:
                return True
        except OSError:
            continue
    return False


def is_locked(path: object) -> bool:
    """Whether anybody has locked a file that holds something."""
    try:
        descriptor = open_file(path, os.O_RDONLY | os.O_NONBLOCK)
    except (OSError, TypeError, ValueError):
        return False
    try:
        facts = os.fstat(descriptor)
        if not stat.S_ISREG(facts.st_mode) or not facts.st_size:
            return False
        fcntl.flock(descriptor, fcntl.LOCK_SH | fcntl.LOCK_NB)
    except BlockingIOError:
        return True
    finally:
        os.close(descriptor)
    return False


def kept(really: Callable[..., Any]) -> Callable[..., Any]:
    """A call that takes a file its name away, which nobody may who has it open."""

    def attempt(path: Any, *rest: Any, **more: Any) -> Any:
        taken = [path, *rest[:1]] if really in (replace_file, rename_file) else [path]
        if any(is_open(each) for each in taken):
            raise refuse(path)
        return really(path, *rest, **more)

    return attempt


def replace_after_a_look(source: Any, target: Any) -> None:
    """`os.replace` as it goes with a virus scanner about: what was just written is open for a moment."""
    looks = _looked_at.setdefault(os.fspath(target), 0)
    _looked_at[os.fspath(target)] += 1
    if looks % 3 == 0:
        raise refuse(target)
    os.replace(source, target)


def open_descriptor(path: Any, flags: int, mode: int = 0o777) -> int:
    """`os.open`: no folders, and text unless asked for otherwise."""
    if os.path.isdir(path) or is_locked(path):
        raise refuse(path)
    descriptor = open_file(path, flags & ~BINARY, mode)
    (_text.discard if flags & BINARY else _text.add)(descriptor)
    return descriptor


def write_descriptor(descriptor: int, data: bytes) -> int:
    """`os.write`: text gets the line ends of Windows."""
    whole = bytes(data).replace(b"\n", b"\r\n") if descriptor in _text else data
    while whole:
        whole = whole[os.write(descriptor, whole) :]
    return len(data)


def open_stream(file: Any, *rest: Any, **more: Any) -> Any:
    """`open`: not what is locked."""
    if not isinstance(file, int) and is_locked(file):
        raise refuse(file)
    return open_io(file, *rest, **more)


def status_of(descriptor: int) -> os.stat_result:
    """`os.fstat`: everybody may do anything, as far as modes tell."""
    facts = os.fstat(descriptor)
    return os.stat_result((stat.S_IFMT(facts.st_mode) | 0o666, *facts[1:]))


def handle_signal(number: int, handler: Any) -> Any:
    """`signal.signal`: Windows knows few."""
    if number not in (signal.SIGINT, signal.SIGTERM, signal.SIGABRT, BREAK):
        raise ValueError("invalid signal value")
    return signal.signal(number, handler)


def lock_region(descriptor: int, mode: int, size: int) -> None:
    """`msvcrt.locking` for a whole file at once."""
    assert size > 0
    try:
        fcntl.flock(descriptor, fcntl.LOCK_UN if mode == 0 else fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError:
        raise refuse("", "Permission denied") from None


msvcrt = ModuleType("msvcrt")
msvcrt.__dict__.update(locking=lock_region, LK_UNLCK=0, LK_LOCK=1, LK_NBLCK=2, LK_RLCK=3, LK_NBRLCK=4)
open_file, open_io, replace_file, rename_file = os.open, io.open, os.replace, os.rename


def become_windows(lacking: dict[str, frozenset[str]]) -> None:
    """Imitate Windows."""
    for name in ("replace", "rename", "unlink", "remove"):
        setattr(os, name, kept(getattr(os, name)))
    io.open = builtins.open = open_stream  # type: ignore[assignment]
    files = {"open": open_descriptor, "write": write_descriptor, "fstat": status_of, "replace": replace_after_a_look}
    disguise(os, lacking["os"], {"name": "nt", "O_BINARY": BINARY, **files})
    disguise(sys, frozenset(), {"platform": "win32"})
    disguise(signal, lacking["signal"], {"SIGBREAK": BREAK, "signal": handle_signal})


def become_mac(lacking: dict[str, frozenset[str]]) -> None:
    """Imitate macOS."""
    disguise(os, lacking["os"], {})
    disguise(sys, frozenset(), {"platform": "darwin"})
    disguise(signal, lacking["signal"], {})
    disguise(fcntl, frozenset(), {"F_FULLFSYNC": FULL_SYNC, "fcntl": full_sync})


def become(system: str) -> None:
    """Imitate a system from now on."""
    names = Path(__file__).with_name(f"lacking-{system}.txt").read_text().split()
    lacking = {
        module: frozenset(name.partition(".")[2] for name in names if name.startswith(f"{module}."))
        for module in ("os", "signal", "time", "errno", "select")
    }
    change_imports(
        frozenset(name for name in names if "." not in name), {"msvcrt": msvcrt} if system == "win32" else {}
    )
    (become_windows if system == "win32" else become_mac)(lacking)
    disguise(time, lacking["time"], {})
    disguise(errno, lacking["errno"], {})


if SYSTEM:
    become(SYSTEM)

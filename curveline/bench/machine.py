"""What figures were measured on and with: machine, load, versions; without them no two runs can be compared."""

from __future__ import annotations

import os
import platform
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import suppress
from dataclasses import dataclass, field, fields, replace
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path

from curveline._version import __version__
from curveline.kernels.object_file import library
from curveline.kernels.wish import PYTHON, wish
from curveline.system import portable
from curveline.system.files import printable
from curveline.system.work_tree import commit_of

LOOK_S = 0.5
"""How long processors are watched before anything is measured [s]."""
BUSY = 0.1
"""Part of all processors that others may use before figures are to be distrusted."""
BUSY_AVERAGE = 0.5
"""The same where only the load average of the last minute is known: processes that wait or run, per processor."""


@dataclass(frozen=True)
class Machine:
    """The computer."""

    processor: str = ""  # model, or the architecture where nobody tells
    architecture: str = ""  # such as x86_64
    cores: int = 1  # that this process may use
    memory_MB: int | None = None  # None if unknown
    system: str = ""  # such as Linux


@dataclass(frozen=True)
class MachineLoad:
    """What else the processors did, as far as the system tells."""

    average: float | None = None  # processes that ran or waited, over the last minute before it began
    before: float | None = None  # part of all processors at work just before it began
    during: float | None = None  # part of all processors that others used while it measured

    def is_busy(self, cores: int) -> bool:
        """True if what is measured under it is to be distrusted."""
        if self.before is None:
            return (self.average or 0.0) > BUSY_AVERAGE * cores
        return max(self.before, self.during or 0.0) > BUSY


@dataclass(frozen=True)
class Versions:
    """Versions of what computes: `python`, `numpy`, `scipy`, `numba`, `llvmlite`, `pyelastica` and `mujoco`.

    None of what is not installed.
    """

    python: str | None = None
    numpy: str | None = None
    scipy: str | None = None
    numba: str | None = None
    llvmlite: str | None = None
    pyelastica: str | None = None
    mujoco: str | None = None


@dataclass(frozen=True)
class Conditions:
    """When, on what and with what something was measured."""

    at: float = 0.0  # when it began, time of day [s since 1970]
    curveline: str = __version__  # version
    commit: str | None = None  # of a clone, with a + if files were changed since; None if it runs from none
    kernels: str = ""  # what ran: "shipped" machine code, compiled by "numba", or "interpreted"
    versions: Versions = field(default_factory=Versions)  # of what computes
    machine: Machine = field(default_factory=Machine)  # the computer
    load: MachineLoad = field(default_factory=MachineLoad)  # what else it did

    @property
    def is_busy(self) -> bool:
        """True if the machine did other things besides, so that figures are to be distrusted."""
        return self.load.is_busy(self.machine.cores)


def conditions() -> Conditions:
    """Those of here and now, without the load."""
    return Conditions(
        at=time.time(),
        commit=commit_of(Path(__file__).parents[2]),
        kernels=kernels_that_run(),
        versions=Versions(
            platform.python_version(), *(_version(each.name) for each in fields(Versions) if each.name != "python")
        ),
        machine=Machine(printable(_processor()), platform.machine(), portable.cores(), _memory(), platform.system()),
    )


def kernels_that_run() -> str:
    """What kernels run as: "shipped", "numba" or "interpreted"."""
    if wish() == PYTHON:
        return "interpreted"
    return "shipped" if library() else "numba"


class Watch:
    """Watches the processors: what they did before something began, and what others do while it goes on."""

    def __init__(self) -> None:
        """Look at them for half a second."""
        average = os.getloadavg()[0] if hasattr(os, "getloadavg") else None
        begin = _ticks()
        if begin is not None:
            time.sleep(LOOK_S)
        self._begin, self._own = _ticks(), _own_ticks()
        self.before = MachineLoad(average, _share(begin, self._begin, 0.0))

    def load(self) -> MachineLoad:
        """The load so far."""
        during = _share(self._begin, _ticks(), _own_ticks() - self._own)
        return replace(self.before, during=during)


Ticks = tuple[float, float]
"""How long all processors were at work, and how long that could have been, since some moment [ticks of 1/100 s]."""


def _ticks() -> Ticks | None:
    """None where the system does not tell."""
    with suppress(OSError, ValueError):
        words = Path("/proc/stat").read_text(encoding="ascii").split("\n", 1)[0].split()[1:9]
        user, nice, kernel, idle, waiting, *others = map(float, words)
        busy = user + nice + kernel + sum(others)
        return busy, busy + idle + waiting
    return None


def _own_ticks() -> float:
    """What this process and those that it has waited for have used."""
    return sum(os.times()[:4]) * os.sysconf("SC_CLK_TCK") if hasattr(os, "sysconf") else 0.0


def _share(begin: Ticks | None, end: Ticks | None, own: float) -> float | None:
    """Part of the processors that was used between two looks, without one's own."""
    if begin is None or end is None or end[1] <= begin[1]:
        return None
    return min(1.0, max(0.0, (end[0] - begin[0] - own) / (end[1] - begin[1])))


def _processor() -> str:
    """The model of the processor."""
    if sys.platform == "darwin":
        with suppress(OSError, subprocess.SubprocessError):
            command = ["/usr/sbin/sysctl", "-n", "machdep.cpu.brand_string"]
            return subprocess.run(command, capture_output=True, check=True, timeout=5.0).stdout.decode().strip()
    return next(_models(), platform.processor() or platform.machine())


def _models() -> Iterator[str]:
    """What Linux says of processors by name; on some there is nothing."""
    with suppress(OSError):
        for line in Path("/proc/cpuinfo").read_text(encoding="utf-8", errors="replace").split("\n"):
            key, _, value = line.partition(":")
            if key.strip().lower() in ("model name", "model", "hardware") and not value.strip().isdecimal():
                yield value.strip()


def _memory() -> int | None:
    if sys.platform == "win32":
        return None
    with suppress(OSError, ValueError):
        return os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES") // 1_000_000
    return None


def _version(package: str) -> str | None:
    """Of an installed package."""
    try:
        return version(package)
    except PackageNotFoundError:
        return None

"""Where kernels that had to be compiled are kept: a folder named by all that the machine code depends on.

numba keys a cached function on its own file only, so a kernel that calls into another module would go on running the
old code after that module changed (numba issue 1833). Here the folder itself is named by a hash over all kernel
sources, the numba and Python versions and the processor's name, which also serves read-only installs.
"""

from __future__ import annotations

import atexit
import hashlib
import os
import shutil
import sys
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from functools import cache
from importlib.metadata import version
from pathlib import Path

PACKAGE = Path(__file__).parents[1]
"""The folder of curveline."""
SOURCES = ("kernels", "rod")
"""The rooms whose sources machine code depends on."""


@cache
def source_digest() -> str:
    """Digest of all sources that machine code is made from."""
    digest = hashlib.sha256()
    for room in SOURCES:
        for path in sorted((PACKAGE / room).rglob("*.py")):
            digest.update(path.relative_to(PACKAGE).as_posix().encode())
            digest.update(path.read_bytes())
    return digest.hexdigest()


def home() -> Path:
    """The user's cache folder for curveline."""
    if os.environ.get("CURVELINE_CACHE"):
        return Path(os.environ["CURVELINE_CACHE"])
    base = os.environ.get("XDG_CACHE_HOME") or os.path.expanduser("~/.cache")
    return Path(base) / "curveline"


@cache
def wanted() -> Path:
    """The folder in which compiled kernels are to be kept."""
    from llvmlite.binding import get_host_cpu_name

    key = f"{source_digest()} {version('numba')} {sys.version} {get_host_cpu_name()}"
    return home() / hashlib.sha256(key.encode()).hexdigest()[:16]


def has_kernels(folder: Path) -> bool:
    """Whether any kernel was compiled into a folder."""
    return next(folder.glob("*/*.nbi"), None) is not None


def usable(folder: Path) -> Path:
    """`folder`; where it is empty and can't be written a temporary one, for this process alone, if there is any.

    A shared temporary folder would let other users of the machine plant code in it.
    """
    with suppress(OSError):
        folder.mkdir(parents=True, exist_ok=True)
        if os.access(folder, os.W_OK) or has_kernels(folder):
            return folder
    try:
        private = tempfile.mkdtemp(prefix="curveline-")
    except OSError:
        return folder
    atexit.register(shutil.rmtree, private, ignore_errors=True)
    inner = Path(private) / folder.name
    inner.mkdir()
    return inner


@cache
def folder() -> Path:
    """The folder of compiled kernels: the wanted one if that can be used."""
    return usable(wanted())


def keeps() -> bool:
    """Whether the next run will find what this one compiles."""
    return folder() == wanted() and os.access(folder(), os.W_OK)


@contextmanager
def shared() -> Iterator[None]:
    """Let processes that are started meanwhile use this one's kernels, also where the user's folder is closed."""
    before = os.environ.get("CURVELINE_CACHE")
    os.environ["CURVELINE_CACHE"] = str(folder().parent)
    try:
        yield
    finally:
        if before is None:
            del os.environ["CURVELINE_CACHE"]
        else:
            os.environ["CURVELINE_CACHE"] = before

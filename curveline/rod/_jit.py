"""The one way kernels are compiled: cached on disk under a key that changes with any kernel source.

numba keys a cached function on its own file only, so a kernel that calls into another module would go on running the
old code after that module changed (numba issue 1833). Here the cache folder itself is named by a hash over all files
of `curveline/rod`, the numba and Python versions and the processor's name, which also serves read-only installs.
numba also takes no kernel from a folder that it cannot write to; here what is there is used, and what cannot be added
is compiled again next time. What is compiled is counted and timed, so that people can be told, and no answer is said to
have taken as long as its kernels did.
"""

from __future__ import annotations

import atexit
import hashlib
import os
import shutil
import sys
import tempfile
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any, TypeVar, cast

import numba
from llvmlite.binding import get_host_cpu_name
from numba.core import caching, event

F = TypeVar("F", bound=Callable[..., Any])

_config: Any = numba.config


def _cache_home() -> Path:
    """The user's cache folder for curveline."""
    if os.environ.get("CURVELINE_CACHE"):
        return Path(os.environ["CURVELINE_CACHE"])
    base = os.environ.get("XDG_CACHE_HOME") or os.path.expanduser("~/.cache")
    return Path(base) / "curveline"


def _source_key() -> str:
    """Digest of everything the compiled code depends on."""
    digest = hashlib.sha256(f"{numba.__version__} {sys.version} {get_host_cpu_name()}".encode())
    for path in sorted(Path(__file__).parent.rglob("*.py")):
        digest.update(str(path.relative_to(Path(__file__).parent)).encode())
        digest.update(path.read_bytes())
    return digest.hexdigest()[:16]


def _has_kernels(folder: Path) -> bool:
    return next(folder.glob("*/*.nbi"), None) is not None


def _usable(folder: Path) -> Path:
    """`folder`; where it is empty and can't be written a temporary one, for this process alone, if there is any.

    A shared temporary folder would let other users of the machine plant code in it.
    """
    with suppress(OSError):
        folder.mkdir(parents=True, exist_ok=True)
        if os.access(folder, os.W_OK) or _has_kernels(folder):
            return folder
    try:
        private = tempfile.mkdtemp(prefix="curveline-")
    except OSError:
        return folder
    atexit.register(shutil.rmtree, private, ignore_errors=True)
    inner = Path(private) / folder.name
    inner.mkdir()
    return inner


WANTED = _cache_home() / _source_key()
"""Folder in which the compiled kernels are to be kept."""

FIRST_RUN = not _has_kernels(WANTED)
"""True if nothing was compiled yet for these sources when this process started."""

CACHE = _usable(WANTED)
"""Folder of the compiled kernels, `WANTED` if that can be used."""

KEEPS = CACHE == WANTED and os.access(CACHE, os.W_OK)
"""Whether the next run will find what this one compiles."""

_config.CACHE_DIR = str(CACHE)


@contextmanager
def shared_cache() -> Iterator[None]:
    """Let processes that are started meanwhile use this one's kernels, also where the user's folder is closed."""
    before = os.environ.get("CURVELINE_CACHE")
    os.environ["CURVELINE_CACHE"] = str(CACHE.parent)
    try:
        yield
    finally:
        if before is None:
            del os.environ["CURVELINE_CACHE"]
        else:
            os.environ["CURVELINE_CACHE"] = before


class _Compilation(event.Listener):
    """What this process had to compile: kernels that are done, and wall seconds.

    A kernel that calls others compiles them on its way, which takes time once. `tell` hears of every beginning and end.
    """

    def __init__(self) -> None:
        self.kernels = 0
        self.tell: Callable[[], object] = lambda: None
        self._depth = 0
        self._begin = self._spent = 0.0

    @property
    def is_busy(self) -> bool:
        """Whether a kernel is being compiled now."""
        return self._depth > 0

    @property
    def seconds(self) -> float:
        """Time spent so far."""
        return self._spent + (time.perf_counter() - self._begin if self.is_busy else 0.0)

    def on_start(self, event: Any) -> None:
        """See numba."""
        if not self.is_busy:
            self._begin = time.perf_counter()
        self._depth += 1
        self.tell()

    def on_end(self, event: Any) -> None:
        """See numba; also called for what could not be compiled."""
        self._spent = self.seconds if self._depth == 1 else self._spent
        self._depth -= 1
        self.kernels += 1
        self.tell()


COMPILATION = _Compilation()
event.register("numba:compile", COMPILATION)


def clock() -> float:
    """Seconds that only grow, and that stand still while kernels are compiled."""
    return time.perf_counter() - COMPILATION.seconds


class _Locator(caching.UserProvidedCacheLocator):
    """Where kernels are looked for: in `CACHE`, whether it can be written or not."""

    def ensure_cache_path(self) -> None:
        """See numba."""
        with suppress(OSError):
            os.makedirs(self.get_cache_path(), exist_ok=True)


class _Kernels(caching.CompileResultCacheImpl):
    _locator_classes: list[type[object]] = [_Locator]  # noqa: RUF012 - it is numba's


class _Cache(caching.FunctionCache):
    """The compiled forms of one function; a disk that takes no more of them is no reason to stop computing."""

    _impl_class = _Kernels

    def save_overload(self, sig: Any, data: Any) -> None:
        """See numba."""
        with suppress(OSError):
            super().save_overload(sig, data)


def njit(function: F) -> F:
    """Compile `function` when first called, or load it from the cache.

    Without the wrapper for callers in C, which nobody needs, the first run takes a fifth less time.
    """
    options: dict[str, Any] = {"error_model": "numpy", "nogil": True, "no_cfunc_wrapper": True}
    kernel = numba.njit(**options)(function)
    kernel._cache = _Cache(function)
    return cast(F, kernel)

"""The one way kernels are compiled: cached on disk under a key that changes with any kernel source.

numba keys a cached function on its own file only, so a kernel that calls into another module would go on running the
old code after that module changed (numba issue 1833). Here the cache folder itself is named by a hash over all files
of `curveline/rod`, the numba and Python versions and the processor's name, which also serves read-only installs.
numba also takes no kernel from a folder that it cannot write to; here what is there is used, and what cannot be added
is compiled again next time.
"""

from __future__ import annotations

import atexit
import hashlib
import os
import shutil
import sys
import tempfile
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any, TypeVar, cast

import numba
from llvmlite.binding import get_host_cpu_name
from numba.core import caching

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


_tells: list[Callable[[], object]] = []


def before_compiling(tell: Callable[[], object]) -> None:
    """Have `tell` called once, as soon as a kernel is wanted that must be compiled."""
    _tells[:] = [tell]


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

    def load_overload(self, sig: Any, target_context: Any) -> Any:
        """See numba."""
        found = super().load_overload(sig, target_context)
        while found is None and _tells:
            _tells.pop()()
        return found

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

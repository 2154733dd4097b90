"""The one way kernels are compiled: cached on disk under a key that changes with any kernel source.

numba keys a cached function on its own file only, so a kernel that calls into another module would go on running the
old code after that module changed (numba issue 1833). Here the cache folder itself is named by a hash over all files
of `curveline/rod`, the numba and Python versions and the processor's name, which also serves read-only installs.
"""

from __future__ import annotations

import atexit
import hashlib
import os
import shutil
import sys
import tempfile
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any, TypeVar, cast

import numba
from llvmlite.binding import get_host_cpu_name

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


def _usable(folder: Path) -> Path:
    """`folder`, or where it can't be written to a temporary one, for this process alone.

    A shared temporary folder would let other users of the machine plant code in it.
    """
    try:
        folder.mkdir(parents=True, exist_ok=True)
        if os.access(folder, os.W_OK):
            return folder
    except OSError:
        pass
    private = tempfile.mkdtemp(prefix="curveline-")
    atexit.register(shutil.rmtree, private, ignore_errors=True)
    inner = Path(private) / folder.name
    inner.mkdir()
    return inner


_WANTED = _cache_home() / _source_key()

FIRST_RUN = not _WANTED.exists()
"""True if nothing was compiled yet for these sources when this process started."""

CACHE = _usable(_WANTED)
"""Folder of the compiled kernels."""

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


def njit(function: F) -> F:
    """Compile `function` when first called, or load it from the cache.

    Without the wrapper for callers in C, which nobody needs, the first run takes a fifth less time.
    """
    options: dict[str, Any] = {"cache": True, "error_model": "numpy", "nogil": True, "no_cfunc_wrapper": True}
    return cast(F, numba.njit(**options)(function))

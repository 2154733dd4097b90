"""The one way kernels are compiled: cached on disk under a key that changes with any kernel source.

numba keys a cached function on its own file only, so a kernel that calls into another module would go on running the
old code after that module changed (numba issue 1833). Here the cache folder itself is named by a hash over all files
of `curveline/rod`, the numba and Python versions and the processor's name, which also serves read-only installs.
"""

from __future__ import annotations

import hashlib
import os
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any, TypeVar, cast

import numba

F = TypeVar("F", bound=Callable[..., Any])

_config: Any = numba.config


def _cache_home() -> Path:
    """The user's cache folder for curveline."""
    if os.environ.get("CURVELINE_CACHE"):
        return Path(os.environ["CURVELINE_CACHE"])
    base = os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache"
    return Path(base) / "curveline"


def _source_key() -> str:
    """Digest of everything the compiled code depends on."""
    digest = hashlib.sha256(f"{numba.__version__} {sys.version} {_config.CPU_NAME}".encode())
    for path in sorted(Path(__file__).parent.glob("*.py")):
        digest.update(path.name.encode())
        digest.update(path.read_bytes())
    return digest.hexdigest()[:16]


CACHE = _cache_home() / _source_key()
"""Folder of the compiled kernels."""

FIRST_RUN = not CACHE.exists()
"""True if nothing was compiled yet for these sources when this process started."""

_config.CACHE_DIR = str(CACHE)


def njit(function: F) -> F:
    """Compile `function` when first called, or load it from the cache."""
    compiled: Any = numba.njit(cache=True, error_model="numpy", nogil=True)
    return cast(F, compiled(function))

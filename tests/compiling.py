"""Several processes, one cache of kernels: what one of them is compiling the others wait for, and then load."""

from __future__ import annotations

import hashlib
import os
from contextlib import suppress
from typing import Any

from curveline.kernels import cache
from curveline.kernels.numba_kernels import KernelCache

BYTES = 1 << 40


def take_turns() -> None:
    """From now on this process waits for kernels that others are compiling; where files have no locks it does not."""
    try:
        import fcntl
    except ImportError:
        return
    file = os.open(cache.folder() / "turns", os.O_RDWR | os.O_CREAT, 0o600)
    load, save = KernelCache.load_overload, KernelCache.save_overload

    def turn(kernel: KernelCache) -> int:
        """The byte of the file that stands for a kernel: also for two kinds of arguments, numba keeps one index."""
        return int.from_bytes(hashlib.sha256(kernel._cache_file._index_path.encode()).digest()) % BYTES

    def load_or_begin(kernel: KernelCache, sig: Any, context: Any) -> Any:
        found = load(kernel, sig, context)
        if found is None:
            with suppress(OSError):  # the system lets no two processes wait for each other
                fcntl.lockf(file, fcntl.LOCK_EX, 1, turn(kernel))
            found = load(kernel, sig, context)
            if found is not None:
                fcntl.lockf(file, fcntl.LOCK_UN, 1, turn(kernel))
        return found

    def save_and_end(kernel: KernelCache, sig: Any, data: Any) -> None:
        try:
            save(kernel, sig, data)
        finally:
            fcntl.lockf(file, fcntl.LOCK_UN, 1, turn(kernel))

    KernelCache.load_overload, KernelCache.save_overload = load_or_begin, save_and_end  # type: ignore[method-assign]

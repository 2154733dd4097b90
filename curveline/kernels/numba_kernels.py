"""Kernels that numba compiles when they are called, and keeps on disk.

numba takes no kernel from a folder that it cannot write to; here what is there is used, and what cannot be added is
compiled again next time. What is compiled is counted and timed.
"""

from __future__ import annotations

import os
from collections.abc import Callable
from contextlib import suppress
from functools import cache
from typing import Any

import numba
from numba.core import caching, event, types
from numba.extending import typeof_impl

from curveline.kernels.cache import folder
from curveline.kernels.compile_time import COMPILATION

_config: Any = numba.config
_config.CACHE_DIR = str(folder())


class _Listener(event.Listener):
    """Tells the count of compilations of numba's."""

    def on_start(self, event: Any) -> None:
        """See numba."""
        COMPILATION.begin()

    def on_end(self, event: Any) -> None:
        """See numba; also called for what could not be compiled."""
        COMPILATION.end()


event.register("numba:compile", _Listener())


class _Locator(caching.UserProvidedCacheLocator):
    """Where kernels are looked for: in the cache's folder, whether it can be written or not."""

    def ensure_cache_path(self) -> None:
        """See numba."""
        with suppress(OSError):
            os.makedirs(self.get_cache_path(), exist_ok=True)


class _KeptKernels(caching.CompileResultCacheImpl):
    _locator_classes: list[type[object]] = [_Locator]  # noqa: RUF012 - it is numba's


class KernelCache(caching.FunctionCache):
    """The compiled forms of one function; a disk that takes no more of them is no reason to stop computing."""

    _impl_class = _KeptKernels

    def save_overload(self, sig: Any, data: Any) -> None:
        """See numba."""
        with suppress(OSError):
            super().save_overload(sig, data)


@cache
def _teach(kind: type) -> None:
    """To kernels that call it, a kernel, an object of this `kind`, is what numba compiles of it."""
    typeof_impl.register(kind)(lambda kernel, context: types.Dispatcher(kernel.dispatcher))


def dispatcher_of(function: Callable[..., Any], kind: type, *, makes_arrays: bool) -> Any:
    """`function` as numba compiles it when first called, or loads it from the cache; kernels are objects of `kind`.

    Without the wrapper for callers in C, which nobody needs, the first run takes a fifth less time. A kernel that
    makes no arrays need not count who holds those it is given.
    """
    _teach(kind)
    options: dict[str, Any] = {"error_model": "numpy", "nogil": True, "no_cfunc_wrapper": True, "_nrt": makes_arrays}
    made = numba.njit(**options)(function)
    made._cache = KernelCache(function)
    return made

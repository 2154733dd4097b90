"""The one way kernels are written: a plain function under `njit`, or `shipped` with the types that Python gives it.

A kernel that is called from Python runs as the machine code that came with the package, if there is such for these
very sources and this machine; else numba compiles it on its first call, and keeps it in the user's cache. Kernels that
only other kernels call need no code of their own: they are compiled into their callers.

`CURVELINE_KERNELS=numba` has numba compile all of them, `CURVELINE_KERNELS=python` runs them as they are written, some
hundred times slower, for a debugger.
"""

from __future__ import annotations

import functools
from collections.abc import Callable
from typing import Any, TypeVar, cast

from curveline.kernels.object_file import library
from curveline.kernels.wish import PYTHON, wish

F = TypeVar("F", bound=Callable[..., Any])

SHIPPED: list[Kernel] = []
"""All kernels that are shipped as machine code, of the modules that were imported."""
LEAVES: list[Kernel] = []
"""All kernels that make no arrays and give none, of these modules."""


class Kernel:
    """A function that runs as machine code: `py_func` is it as written, `kinds` are the types of what it takes."""

    def __init__(self, function: Callable[..., Any], *, makes_arrays: bool = True) -> None:
        functools.update_wrapper(self, function)
        self.py_func = function
        self.kinds: tuple[Any, ...] = ()
        self._makes_arrays = makes_arrays
        self._run: Callable[..., Any] = self._decided

    def __call__(self, *arguments: Any, **named: Any) -> Any:
        return self._run(*arguments, **named)

    @property
    def path(self) -> str:
        """Where the kernel stands, "module:name"."""
        return f"{self.py_func.__module__}:{self.py_func.__qualname__}"

    @functools.cached_property
    def dispatcher(self) -> Any:
        """The function as numba compiles it, which takes arguments of any type."""
        from curveline.kernels.numba_kernels import dispatcher_of

        return dispatcher_of(self.py_func, Kernel, makes_arrays=self._makes_arrays)

    def compiled(self, *arguments: Any) -> Any:
        """Call what numba makes of the function."""
        return self.dispatcher(*arguments)

    def _decided(self, *arguments: Any, **named: Any) -> Any:
        """The first call: from now on the kernel runs as what there is of it."""
        if wish() == PYTHON:
            self._run = self.py_func
        else:
            self._run = (self._native() if self.kinds else None) or self.dispatcher
        return self._run(*arguments, **named)

    def _native(self) -> Callable[..., Any] | None:
        found = library()
        return found.caller(self.path, self.py_func, self.compiled) if found else None


def njit(function: F) -> F:
    """A kernel for other kernels; where Python calls it, numba compiles it first."""
    return cast(F, Kernel(function))


def leaf(function: F) -> F:
    """As `njit`, for one that makes no arrays and gives none."""
    kernel = Kernel(function, makes_arrays=False)
    LEAVES.append(kernel)
    return cast(F, kernel)


def shipped(*kinds: Any) -> Callable[[F], F]:
    """A kernel that Python calls with arguments of these types, see `forms`, and that is shipped as machine code."""

    def make(function: F) -> F:
        kernel = function if isinstance(function, Kernel) else Kernel(function)
        kernel.kinds = kinds
        SHIPPED.append(kernel)
        return cast(F, kernel)

    return make

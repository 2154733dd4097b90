"""What a kernel takes and gives, in words that need no compiler: numbers, arrays with their dimensions, tuples of both.

A form is "f8" (float), "i8" (int), "b1" (bool), "none"; an array as "f8[2]", C-contiguous; or for a tuple the list of
its forms, headed by the path of its class, "module:name", which is empty for a plain one.
"""

from __future__ import annotations

from collections.abc import Iterator
from importlib import import_module
from typing import Annotated, Any, TypeAlias, get_args, get_type_hints

import numpy as np
from numpy.typing import NDArray

Vector: TypeAlias = Annotated[NDArray[np.float64], "f8[1]"]
"""An array (n,) of floats."""
Matrix: TypeAlias = Annotated[NDArray[np.float64], "f8[2]"]
"""An array (n, m) of floats."""
Stack: TypeAlias = Annotated[NDArray[np.float64], "f8[3]"]
"""An array (k, n, m) of floats."""
Counts: TypeAlias = Annotated[NDArray[np.int64], "i8[1]"]
"""An array (n,) of whole numbers."""

Form: TypeAlias = "str | list[Any]"

_NUMBERS = {float: "f8", int: "i8", bool: "b1"}


def form_of(kind: Any) -> Form:
    """The form of what is annotated as `kind`: a number, one of the arrays above, a named tuple, `tuple[...]` of such.

    Raises `TypeError` for anything else.
    """
    if kind in _NUMBERS:
        return _NUMBERS[kind]
    if hasattr(kind, "__metadata__"):
        form: str = kind.__metadata__[0]
        return form
    if isinstance(kind, type) and hasattr(kind, "_fields"):
        hints = get_type_hints(kind, include_extras=True)
        return [f"{kind.__module__}:{kind.__qualname__}", *(form_of(hints[name]) for name in kind._fields)]
    if getattr(kind, "__origin__", None) is tuple:
        return ["", *map(form_of, get_args(kind))]
    raise TypeError(f"{kind!r} is nothing that a kernel takes")


def class_at(path: str) -> Any:
    """The class that stands at `path`, "module:name"."""
    module, name = path.split(":")
    return getattr(import_module(module), name)


def leaves(form: Form) -> Iterator[str]:
    """The numbers and arrays of a form, in order."""
    if isinstance(form, str):
        yield form
    else:
        for part in form[1:]:
            yield from leaves(part)


def dimensions(leaf: str) -> int:
    """How many dimensions an array has; 0 for a number."""
    return int(leaf[3:-1]) if leaf.endswith("]") else 0

"""Whether kernels are there, before one of them is called."""

from __future__ import annotations

from functools import cache

from curveline.kernels.cache import folder, has_kernels
from curveline.kernels.object_file import library
from curveline.kernels.wish import PYTHON, wish


@cache
def is_first_run() -> bool:
    """True if no machine code fits, and none was compiled for these sources before this was first asked."""
    return wish() != PYTHON and library() is None and not has_kernels(folder())

"""What the user wants kernels to run as."""

from __future__ import annotations

import os

SHIPPED = "shipped"
NUMBA = "numba"
PYTHON = "python"


def wish() -> str:
    """`SHIPPED`, unless `CURVELINE_KERNELS` says `NUMBA` or `PYTHON`."""
    return os.environ.get("CURVELINE_KERNELS") or SHIPPED

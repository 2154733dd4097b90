"""What the user wants kernels to run as."""

from __future__ import annotations

import os

from curveline.errors import InvalidInput

SHIPPED = "shipped"
NUMBA = "numba"
PYTHON = "python"

VARIABLE = "CURVELINE_KERNELS"


def wish() -> str:
    """`SHIPPED`, unless `CURVELINE_KERNELS` says `NUMBA` or `PYTHON`. Raises InvalidInput if it says anything else."""
    said = os.environ.get(VARIABLE) or SHIPPED
    if said not in (SHIPPED, NUMBA, PYTHON):
        hint = f"set it to {NUMBA} or {PYTHON}, or unset it: unset {VARIABLE}"
        raise InvalidInput(f"{VARIABLE} is {said!r}, which kernels do not run as", hint)
    return said

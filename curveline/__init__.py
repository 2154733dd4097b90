"""curveline: simulate, plan and drive shape displays made of flexible rods.

Importing this package is cheap; the names below load what they need when first used.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

__version__ = "0.1.0"

if TYPE_CHECKING:
    from curveline.shapes.files import read_shape as read_shape
    from curveline.simulation.simulate import simulate as simulate

_HOMES = {"read_shape": "curveline.shapes.files", "simulate": "curveline.simulation.simulate"}

__all__ = ["__version__", "read_shape", "simulate"]


def __getattr__(name: str) -> Any:
    if name not in _HOMES:
        raise AttributeError(f"module 'curveline' has no attribute {name!r}")
    from importlib import import_module

    return getattr(import_module(_HOMES[name]), name)

"""What a run of the benchmark leaves: one JSON document for trends, or a picture."""

from __future__ import annotations

import json
import os
import platform
from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict
from importlib.metadata import PackageNotFoundError, version
from typing import Any

import curveline
from curveline.bench.trade import Point
from curveline.errors import InvalidInput
from curveline.files import AnyPath, refuse_file
from curveline.measured import Row

PACKAGES = ("numpy", "scipy", "numba", "pyelastica", "mujoco")


def document(rows: Sequence[Row], points: Sequence[Point]) -> dict[str, Any]:
    """The rows against goals, the points of the trade, and what they were measured on; plain Python types only."""
    return {
        "curveline": curveline.__version__,
        "versions": {"python": platform.python_version(), **{name: _version(name) for name in PACKAGES}},
        "machine": {"cores": os.cpu_count(), "processor": platform.machine(), "system": platform.system()},
        "rows": [asdict(row) for row in rows],
        "trade": [asdict(point) for point in points],
    }


def _version(package: str) -> str | None:
    """Of an installed package."""
    try:
        return version(package)
    except PackageNotFoundError:
        return None


def _json(rows: Sequence[Row], points: Sequence[Point]) -> bytes:
    return (json.dumps(document(rows, points), allow_nan=False) + "\n").encode()


def _picture(kind: str) -> Callable[[Sequence[Row], Sequence[Point]], bytes]:
    def draw_it(_: Sequence[Row], points: Sequence[Point]) -> bytes:
        from curveline.bench.figure import draw

        return draw(points, kind)

    return draw_it


ENCODERS: Mapping[str, Callable[[Sequence[Row], Sequence[Point]], bytes]] = {
    ".json": _json,
    ".svg": _picture("svg"),
    ".png": _picture("png"),
}
"""Suffix of a file -> what makes its content."""


def encoder_of(path: AnyPath, *, force: bool = False) -> Callable[[Sequence[Row], Sequence[Point]], bytes]:
    """What makes the content of a file that may be written; InvalidInput or MissingExtra if none may."""
    name = os.fspath(path)
    suffix = os.path.splitext(name)[1].lower()
    if suffix not in ENCODERS:
        known = ", ".join(ENCODERS)
        raise InvalidInput(f"{name}: cannot tell the format from the suffix {suffix!r}", f"name a file in {known}")
    if suffix != ".json":
        from curveline.figures.common import require_matplotlib

        require_matplotlib()
    if os.path.exists(name) and not force:
        refuse_file(name, "exists", "the file exists already", "choose another name, or overwrite it with --force")
    return ENCODERS[suffix]

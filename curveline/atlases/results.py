"""An atlas as JSON and NPZ: mm, degrees, N, N mm and mJ, with what it was made from."""

from __future__ import annotations

import io
import json
from collections.abc import Callable
from typing import Any

import numpy as np

from curveline._version import __version__
from curveline.atlases.atlas import Atlas
from curveline.atlases.entries import level_scene
from curveline.simulation.npz import write_npz
from curveline.simulation.results import Document, provenance
from curveline.units import to_mj, to_mm, to_nmm


def document(found: Atlas, argv: tuple[str, ...] = ()) -> Document:
    """What `curveline atlas --json` prints; plain Python types only."""
    table = {name: values.tolist() for name, values in columns(found).items()}
    folds = found.folds
    ends = zip(folds.places.tolist(), folds.errors.tolist(), folds.kinds.tolist(), _ends(found).tolist(), strict=True)
    return {
        **_head(found),
        "kinds": found.kinds.tolist(),
        "tally": [{"states": each.kinds, "points": each.points} for each in found.tallies()],
        "states": [dict(zip(table, row, strict=True)) for row in zip(*table.values(), strict=True)],
        "folds": [{"at": place, "error": error, "kind": kind, "states": states} for place, error, kind, states in ends],
        "lines": folds.lines.tolist(),
        "seconds": found.seconds,
        "provenance": _provenance(found, argv),
    }


def _head(found: Atlas) -> Document:
    return {
        "curveline": __version__,
        "display": found.display.name,
        "axes": [{"key": axis.key, "start": axis.start, "stop": axis.stop, "count": axis.count} for axis in found.axes],
        "at": found.fixed,
    }


def _provenance(found: Atlas, argv: tuple[str, ...]) -> Document:
    made = provenance(level_scene(found.display), {"tolerance_mm": to_mm(found.request.tolerance)}, argv)
    return {key: value for key, value in made.items() if key != "shape"}


def columns(found: Atlas) -> dict[str, Any]:
    """Arrays with a value per state, by the names that JSON and NPZ have for them; curves left out."""
    entries = found.entries
    loads = entries["loads"].reshape(-1, 2, 3)
    return {
        "point": np.column_stack(np.unravel_index(entries["pose"], found.shape)),
        "state": entries["name"],
        "simple": entries["simple"],
        "energy_mJ": _in(to_mj, entries["energy"]),
        "mean_height_mm": _in(to_mm, entries["mean_height"]),
        "error_mm": _in(to_mm, entries["error"]),
        "lowest_eigenvalue": entries["lowest_eigenvalue"],
        "max_curvature_per_m": entries["max_curvature"],
        "node_force_N": loads[:, :, :2],
        "node_moment_Nmm": _in(to_nmm, loads[:, :, 2]),
        "force_N": found.force,
        "moment_Nmm": _in(to_nmm, found.moment),
        "share": found.share,
    }


def _in(unit: Callable[[Any], Any], values: Any) -> Any:
    """An array in another unit."""
    return unit(values)


def _ends(found: Atlas) -> Any:
    """How many states there are before and after every fold, (f, 2)."""
    return np.column_stack([found.folds.before, found.folds.after])


def to_json(found: Atlas, argv: tuple[str, ...] = ()) -> bytes:
    """The document as one line."""
    return (json.dumps(document(found, argv), allow_nan=False) + "\n").encode()


def to_npz(found: Atlas, argv: tuple[str, ...] = ()) -> bytes:
    """Arrays: those of `columns` and curve_mm (states, 33, 2), a row per state; first and second, the values of both
    axes; kinds (n, m); fold_at (folds, 2), fold_error, fold_kind, fold_states (folds, 2) and fold_lines (l, 2); and
    document, the JSON without what is in these.
    """
    folds = found.folds
    arrays = {
        "first": found.axes[0].values(),
        "second": found.axes[1].values(),
        "kinds": found.kinds,
        **columns(found),
        "curve_mm": np.ascontiguousarray(_in(to_mm, found.entries["curve"])),
        "fold_at": folds.places,
        "fold_error": folds.errors,
        "fold_kind": folds.kinds,
        "fold_states": _ends(found),
        "fold_lines": folds.lines,
        "document": json.dumps({**_head(found), "provenance": _provenance(found, argv)}, allow_nan=False),
    }
    stream = io.BytesIO()
    write_npz(stream, arrays)
    return stream.getvalue()

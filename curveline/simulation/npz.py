"""Arrays as one NPZ file, as `numpy.savez_compressed` writes it, but for what does not get smaller."""

from __future__ import annotations

import zipfile
from collections.abc import Collection, Mapping
from typing import IO, Any

import numpy as np

CURVES = ("curve_mm",)
"""Positions on curves: compressing them is most of the time of a long sweep, and makes them hardly smaller."""
LEVEL = 1
"""Of zlib for the others: higher levels take longer, and save next to nothing."""


def write_npz(stream: IO[bytes], arrays: Mapping[str, Any], stored: Collection[str] = CURVES) -> None:
    """Write `arrays` by their names; those named in `stored` as they are, all others compressed."""
    with zipfile.ZipFile(stream, "w", zipfile.ZIP_DEFLATED, compresslevel=LEVEL) as archive:
        for name, values in arrays.items():
            entry = zipfile.ZipInfo(f"{name}.npy")
            entry.compress_type = zipfile.ZIP_STORED if name in stored else zipfile.ZIP_DEFLATED
            with archive.open(entry, "w", force_zip64=True) as file:
                np.lib.format.write_array(file, np.asanyarray(values), allow_pickle=False)

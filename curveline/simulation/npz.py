"""Arrays as one NPZ file, as `numpy.savez_compressed` writes it, but for what does not get smaller."""

from __future__ import annotations

import zipfile
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass
from typing import IO, Any

import numpy as np
import numpy.typing as npt

CURVES = ("curve_mm",)
"""Positions on curves: compressing them is most of the time of a long sweep, and makes them hardly smaller."""
LEVEL = 1
"""Of zlib for the others: higher levels take longer, and save next to nothing."""


@dataclass(frozen=True)
class Pieces:
    """An array as C-contiguous pieces, one after the other, that need not be put together to be written."""

    pieces: Sequence[npt.NDArray[Any]]  # at least one, alike but in length

    def write(self, file: IO[bytes]) -> None:
        """Write the whole array as `numpy.save` does."""
        first = self.pieces[0]
        header = {
            "descr": np.lib.format.dtype_to_descr(first.dtype),
            "fortran_order": False,
            "shape": (sum(map(len, self.pieces)), *first.shape[1:]),
        }
        np.lib.format.write_array_header_1_0(file, header)
        for piece in self.pieces:
            if piece.size:
                file.write(piece.data.cast("B"))


def write_npz(stream: IO[bytes], arrays: Mapping[str, Any], stored: Collection[str] = CURVES) -> None:
    """Write `arrays` by their names, also in `Pieces`; those named in `stored` as they are, all others compressed."""
    with zipfile.ZipFile(stream, "w", zipfile.ZIP_DEFLATED, compresslevel=LEVEL) as archive:
        for name, values in arrays.items():
            entry = zipfile.ZipInfo(f"{name}.npy")
            entry.compress_type = zipfile.ZIP_STORED if name in stored else zipfile.ZIP_DEFLATED
            with archive.open(entry, "w", force_zip64=True) as file:
                if isinstance(values, Pieces):
                    values.write(file)
                else:
                    np.lib.format.write_array(file, np.asanyarray(values), allow_pickle=False)

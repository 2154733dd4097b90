"""NPZ files are what numpy writes and reads; what does not get smaller is not compressed."""

from __future__ import annotations

import io
import zipfile

import numpy as np
import pytest

from curveline.simulation.npz import Pieces, write_npz

ARRAYS = {
    "curve_mm": np.random.default_rng(1).normal(0.0, 1.0, (50, 201, 2)),
    "depth_mm": np.zeros((50, 201)),
    "state": np.array(["peak", "valley-1"]),
    "wanted": [True, False],
    "none": np.empty((0, 3)),
    "text": "one",
}


@pytest.fixture
def written() -> io.BytesIO:
    stream = io.BytesIO()
    write_npz(stream, ARRAYS)
    stream.seek(0)
    return stream


def test_numpy_reads_what_was_written(written: io.BytesIO) -> None:
    with np.load(written, allow_pickle=False) as found:
        assert set(found.files) == set(ARRAYS)
        for name, values in ARRAYS.items():
            np.testing.assert_array_equal(found[name], np.asarray(values))
            assert found[name].dtype == np.asarray(values).dtype


def test_only_curves_are_stored_as_they_are(written: io.BytesIO) -> None:
    with zipfile.ZipFile(written) as archive:
        packed = {each.filename: each.compress_type == zipfile.ZIP_DEFLATED for each in archive.infolist()}
        sizes = {each.filename: each.compress_size / each.file_size for each in archive.infolist()}
    assert packed == {f"{name}.npy": name != "curve_mm" for name in ARRAYS}
    assert sizes["depth_mm.npy"] < 0.02


def test_objects_are_not_pickled() -> None:
    with pytest.raises(ValueError, match="pickle"):
        write_npz(io.BytesIO(), {"odd": np.array([object()])})


def test_the_same_arrays_give_the_same_bytes(written: io.BytesIO) -> None:
    again = io.BytesIO()
    write_npz(again, ARRAYS)
    assert again.getvalue() == written.getvalue()


@pytest.mark.parametrize("parts", [[0, 20, 0, 1], [50], [0, 0], [0]])
def test_an_array_in_pieces_is_the_array(parts: list[int]) -> None:
    curves = ARRAYS["curve_mm"][: sum(parts)]
    pieces = np.split(curves, np.cumsum(parts)[:-1])
    one, other = io.BytesIO(), io.BytesIO()
    write_npz(one, {"curve_mm": Pieces(pieces), "depth_mm": Pieces([np.abs(each) for each in pieces])})
    write_npz(other, {"curve_mm": curves, "depth_mm": np.abs(curves)})
    assert one.getvalue() == other.getvalue()

"""Shipped kernels are what is called, give what the functions give as written, and leave alone what is odd."""

from __future__ import annotations

import copy
import json
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from rehearsal import Call, recorded, rehearse

from curveline.errors import InvalidInput
from curveline.kernels import build, object_file
from curveline.kernels.compile_time import COMPILATION
from curveline.kernels.kernel import SHIPPED, Kernel
from curveline.kernels.wish import wish
from curveline.rod.planar.response import response
from curveline.rod.problem import Bearing, Pose, ScaledRod, halved, mesh, scale_rod
from curveline.rod.spatial.bands import times

BUILD = "python -m curveline.kernels.build"
ROUNDING = 1e-9
"""Sines of numpy and of the system differ in the last bit, which conditions of up to some 1e6 amplify."""


@pytest.fixture(scope="module")
def calls() -> dict[str, Call]:
    """The first call of each shipped kernel, made by machine code alone."""
    assert object_file.library(), f"there is no machine code for these sources: {BUILD}"
    before = COMPILATION.kernels
    found: dict[str, Call] = {}
    with recorded(found):
        rehearse()
    assert COMPILATION.kernels == before, "a kernel was called with other arguments than it is shipped for"
    return found


def test_commands_call_every_shipped_kernel(calls: dict[str, Call]) -> None:
    assert {kernel.path for kernel in SHIPPED} - set(calls) == set()


def numbers_of(value: Any) -> Iterator[Any]:
    """All numbers and arrays in what a kernel takes or gives."""
    if isinstance(value, tuple):
        for part in value:
            yield from numbers_of(part)
    elif value is not None:
        yield value


def same(one: Any, other: Any, within: float) -> bool:
    """Whether two values are the same tree of numbers, up to `within` of the largest of each array."""
    for left, right in zip(numbers_of(one), numbers_of(other), strict=True):
        if np.shape(left) != np.shape(right):
            return False
        size = np.max(np.abs(left), initial=1.0, where=np.isfinite(left))
        if not np.allclose(left, right, rtol=0.0, atol=within * size, equal_nan=True):
            return False
    return True


def poisoned(shape: Any, dtype: Any = np.float64, **options: Any) -> Any:
    """An array that holds what no memory may: whoever reads before writing gives nonsense."""
    return np.full(shape, np.nan if np.issubdtype(dtype, np.floating) else -(2**40), dtype, **options)


def test_machine_code_gives_what_the_functions_give_as_written(
    calls: dict[str, Call], monkeypatch: pytest.MonkeyPatch
) -> None:
    """And these read nothing that they have not written."""
    monkeypatch.setattr(np, "empty", poisoned)
    everywhere = [kernel for kernel in _kernels() if isinstance(kernel, Kernel)]
    for kernel in everywhere:
        monkeypatch.setattr(kernel, "_run", kernel.py_func)
    wrong = []
    with np.errstate(all="ignore"):
        for path, call in sorted(calls.items()):
            arguments = copy.deepcopy(call.before)
            result = call.kernel.py_func(*arguments)
            if not (same(result, call.result, ROUNDING) and same(arguments, call.after, ROUNDING)):
                wrong.append(path)
    assert wrong == []


def _kernels() -> list[Any]:
    """All kernels of all modules, also those that only other kernels call."""
    return [
        value
        for name, module in sys.modules.items()
        if name.startswith("curveline.rod")
        for value in vars(module).values()
    ]


@pytest.mark.campaign
def test_machine_code_gives_the_bits_that_numba_gives(calls: dict[str, Call]) -> None:
    wrong = []
    for path, call in sorted(calls.items()):
        arguments = copy.deepcopy(call.before)
        result = call.kernel.dispatcher(*arguments)
        if not (same(result, call.result, 0.0) and same(arguments, call.after, 0.0)):
            wrong.append(path)
    assert wrong == []


def test_a_result_is_of_its_class_and_may_be_written_to() -> None:
    rod = scale_rod(Pose(0.5, 0.0, 0.5, -0.5, 0.66), Bearing(0.02, 1.0, 1.0), np.zeros(0), np.zeros((0, 2)))
    assert type(rod) is ScaledRod
    edges = mesh(np.array([0.5]), 24)
    edges[0] = 7.0
    assert edges[0] == 7.0


def called(kernel: Any) -> Any:
    """What calls the machine code of a kernel."""
    library = object_file.library()
    assert library
    return library.caller(kernel.path, kernel.py_func, kernel.dispatcher)


@pytest.mark.parametrize(
    "edges",
    [np.ones((3, 2))[:, 0], np.ones(3, dtype=np.float32), np.ones(3, dtype=np.int64), np.ones(3, dtype=">f8")],
    ids=["strided", "short", "whole", "reversed"],
)
def test_other_arguments_than_it_was_made_for_are_left_to_numba(edges: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    seen = []
    monkeypatch.setattr(halved, "_run", called(halved))
    monkeypatch.setitem(halved._run.__globals__, "_other", lambda *arguments: seen.append(arguments))
    halved(edges)
    assert len(seen) == 1


def test_one_dimension_too_many_is_left_to_numba(monkeypatch: pytest.MonkeyPatch) -> None:
    seen = []
    monkeypatch.setattr(times, "_run", called(times))
    monkeypatch.setitem(times._run.__globals__, "_other", lambda *arguments: seen.append(arguments))
    times(np.ones(3), np.ones(3))
    times(np.ones((3, 1)), 3.0)
    assert len(seen) == 2


def test_a_parameter_is_none_of_the_names_that_its_caller_uses(monkeypatch: pytest.MonkeyPatch) -> None:
    seen = []
    monkeypatch.setattr(response, "_run", called(response))
    monkeypatch.setitem(response._run.__globals__, "_other", lambda *arguments: seen.append(arguments))
    response(None, None, np.ones(2), np.ones(2), np.ones(2))  # its first one is called `other`
    assert len(seen) == 1


def test_a_missing_argument_is_told_with_the_name_of_the_kernel() -> None:
    with pytest.raises(TypeError, match=r"mesh\(\) missing 1 required positional argument"):
        called(mesh)(np.ones(1))


CHECK = """
import json, sys
from pathlib import Path
from curveline.errors import InvalidInput
from curveline.kernels import build, object_file
object_file.FOLDER = Path(sys.argv[1])
{}
print(object_file.library() is not None)
"""


def fits(folder: Path, preparation: str = "") -> bool:
    """Whether a fresh process takes the machine code in a folder."""
    command = [sys.executable, "-c", CHECK.format(preparation), str(folder)]
    return subprocess.run(command, capture_output=True, text=True, check=True).stdout == "True\n"


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """A copy of the machine code."""
    for file in object_file.files():
        (tmp_path / file.name).write_bytes(file.read_bytes())
    return tmp_path


def changed_index(folder: Path, **changes: Any) -> None:
    index = json.loads((folder / object_file.INDEX).read_text())
    (folder / object_file.INDEX).write_text(json.dumps({**index, **changes}))


def test_machine_code_is_taken_as_it_was_made(folder: Path) -> None:
    assert fits(folder)


@pytest.mark.parametrize("change", [{"sources": "0"}, {"platform": "other"}, {"object": "0"}, {"kernels": None}])
def test_machine_code_of_something_else_is_not_taken(folder: Path, change: dict[str, Any]) -> None:
    changed_index(folder, **change)
    if change == {"kernels": None}:
        (folder / object_file.INDEX).write_text("[")
    assert not fits(folder)


@pytest.mark.parametrize("index", ["[]", "3", "null", '"sources"', "{}"])
def test_an_index_that_is_none_is_not_taken(folder: Path, index: str) -> None:
    (folder / object_file.INDEX).write_text(index)
    assert not fits(folder)


@pytest.mark.parametrize("kernels", [[], None, "trace"])
def test_an_index_without_kernels_is_not_taken(folder: Path, kernels: Any) -> None:
    changed_index(folder, kernels=kernels)
    assert not fits(folder)


def test_what_is_built_takes_the_place_of_what_was_there_only_as_a_whole(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    old, new = {"a": b"old", "b": b"old"}, {"a": b"new", "b": b"new"}
    build._keep(tmp_path, old)
    with monkeypatch.context() as patch:
        patch.setattr(Path, "write_bytes", full_after(1))
        with pytest.raises(OSError, match="full"):
            build._keep(tmp_path, new)
    assert {path.name: path.read_bytes() for path in tmp_path.iterdir()} == old
    build._keep(tmp_path, new)
    assert {path.name: path.read_bytes() for path in tmp_path.iterdir()} == new


def test_machine_code_of_before_is_taken_away(tmp_path: Path) -> None:
    build._keep(tmp_path, {"one.o": b"old", object_file.INDEX: b"old"})
    build._keep(tmp_path, {"other.o": b"new", object_file.INDEX: b"new"})
    assert sorted(path.name for path in tmp_path.iterdir()) == [object_file.INDEX, "other.o"]


def full_after(files: int) -> Any:
    """What writes some files, and then finds the disk full."""
    write, done = Path.write_bytes, []

    def writing(path: Path, data: bytes) -> int:
        done.append(path)
        if len(done) > files:
            raise OSError("full")
        return write(path, data)

    return writing


def test_machine_code_that_was_cut_short_is_not_taken(folder: Path) -> None:
    (machine_code,) = folder.glob("*.o")
    machine_code.write_bytes(machine_code.read_bytes()[:-1])
    assert not fits(folder)


def test_no_machine_code_is_taken_where_the_system_lacks_what_it_calls(folder: Path) -> None:
    assert not fits(folder, 'object_file.NEEDED = (*object_file.NEEDED, "no_such_function")')


def test_no_machine_code_is_taken_where_arrays_are_kept_otherwise(folder: Path) -> None:
    assert not fits(folder, "object_file.Library.reads_arrays = lambda self: False")
    assert not fits(folder, 'import sys; sys.implementation.name = "other"')


@pytest.mark.parametrize("wished", ["numba", "python"])
def test_the_user_may_wish_for_no_machine_code(folder: Path, wished: str) -> None:
    assert not fits(folder, f'import os; os.environ["CURVELINE_KERNELS"] = "{wished}"')


def test_a_wish_for_kernels_that_there_are_not_is_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("CURVELINE_KERNELS", "pyton")
    with pytest.raises(InvalidInput, match="CURVELINE_KERNELS is 'pyton'") as caught:
        wish()
    assert "numba or python" in caught.value.hint

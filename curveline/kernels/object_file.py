"""Kernels that were shipped as machine code: one object file per platform, loaded without a compiler.

`build` makes it. Each kernel in it is a function `(words in, words out) -> status` in C: numbers go as they are, an
array as the address of its object, whose data, shape and strides the machine code reads where numpy's C interface has
them. Results that are arrays come back in memory of their own, are copied, and freed.
"""

from __future__ import annotations

import ctypes
import hashlib
import inspect
import json
import struct
import sys
import sysconfig
from collections.abc import Callable, Iterator
from contextlib import suppress
from functools import cache
from pathlib import Path
from typing import Any, TypeAlias, cast

import numpy as np

from curveline.kernels.cache import source_digest
from curveline.kernels.forms import Form, class_at, dimensions, leaves
from curveline.kernels.wish import SHIPPED, wish

Function: TypeAlias = Callable[..., Any]

FOLDER = Path(__file__).parent / "machine_code"
"""Where the object file and its index are."""
INDEX = "kernels.json"
"""What tells whose machine code it is, and for which system."""
NEEDED = (
    *("malloc", "realloc", "free", "memcpy", "memmove", "memset"),
    *("atan2", "ceil", "cos", "exp", "expm1", "floor", "hypot", "log", "log10", "log1p", "rint", "sin"),
)
"""What machine code takes from the libraries of the system."""
WELCOME = ("sincos",)
"""What it takes on some systems."""
SYSTEM = ("ucrtbase", "vcruntime140") if sysconfig.get_platform().startswith("win") else (None,)
"""Where these are; None is what the interpreter itself has loaded."""
FINE = (0, -2)
"""The status of a kernel that gave a value, and of one that gave None."""

_ARRAYS = {"f8": np.dtype(np.float64), "i8": np.dtype(np.int64), "b1": np.dtype(np.bool_)}
_CODES = {"f8": "d", "i8": "q", "b1": "q"}


class Library:
    """The machine code of one object file; `index` tells what is in it, see `build`."""

    def __init__(self, index: dict[str, Any], machine_code: bytes) -> None:
        self._index = index
        self._engine = _loaded(machine_code)
        self.release = ctypes.CFUNCTYPE(None, ctypes.c_void_p)(self._address("curveline_release"))

    def _address(self, symbol: str) -> int:
        address: int = self._engine.get_function_address(symbol)
        return address

    def entry(self, symbol: str) -> Callable[..., int]:
        """The function behind a symbol: it takes words, and a place for those of the result."""
        prototype = ctypes.CFUNCTYPE(ctypes.c_longlong, ctypes.c_char_p, ctypes.c_void_p)
        return prototype(self._address(symbol))

    def reads_arrays(self) -> bool:
        """Whether this interpreter and numpy keep arrays the way the machine code reads them."""
        array = np.empty((2, 3))
        words = (ctypes.c_longlong * 5)()
        self.entry("curveline_array")(struct.pack("=q", id(array)), words)
        return list(words) == [array.__array_interface__["data"][0], *array.shape, *array.strides]

    def caller(self, path: str, written: Function, other: Function) -> Function | None:
        """A function that calls the machine code of the kernel at `path`, None if there is none.

        `written` is the kernel as written, whose parameters it has. Arguments of types that the machine code was not
        made for go to `other`.
        """
        found = self._index["kernels"].get(path)
        return _caller(self, path, found, written, other) if found else None


def object_name(digest: str) -> str:
    """The name of an object file, by the digest of what is in it: an index that is replaced never has another's."""
    return f"{digest[:16]}.o"


def files() -> tuple[Path, Path]:
    """The index, and the object file that it names. Raises `OSError`, `ValueError` or `KeyError` for none."""
    return FOLDER / INDEX, _object_of(_index())


def _index() -> Any:
    return json.loads((FOLDER / INDEX).read_text())


def _object_of(index: Any) -> Path:
    return FOLDER / object_name(index["object"])


@cache
def library() -> Library | None:
    """The machine code that fits these sources, this machine and this interpreter; None where there is none."""
    if wish() != SHIPPED:
        return None
    if sys.implementation.name != "cpython" or sysconfig.get_config_var("Py_GIL_DISABLED"):
        return None
    with suppress(OSError, ValueError, KeyError, TypeError):  # TypeError: of JSON that is no index
        index = _index()
        if index["sources"] == source_digest() and index["platform"] == sysconfig.get_platform():
            return _checked(index, _object_of(index).read_bytes())
    return None


def _checked(index: dict[str, Any], machine_code: bytes) -> Library | None:
    if hashlib.sha256(machine_code).hexdigest() != index["object"] or not isinstance(index["kernels"], dict):
        return None
    found = Library(index, machine_code)
    return found if found.reads_arrays() else None


def _loaded(machine_code: bytes) -> Any:
    """An engine that holds the machine code. Raises `OSError` where this system lacks what it needs."""
    from llvmlite import binding as llvm

    for name, address in _addresses():
        llvm.add_symbol(name, address)
    llvm.initialize_native_target()
    llvm.initialize_native_asmprinter()
    machine = llvm.Target.from_default_triple().create_target_machine(jit=True)
    engine = llvm.create_mcjit_compiler(llvm.parse_assembly(""), machine)
    engine.add_object_file(llvm.ObjectFileRef.from_data(machine_code))
    engine.finalize_object()
    return engine


def _addresses() -> Iterator[tuple[str, int]]:
    """Where in memory everything is that is `NEEDED`; LLVM would end the process for what it does not find."""
    libraries = [ctypes.CDLL(name) for name in SYSTEM]
    for name in (*NEEDED, *WELCOME):
        found = next((getattr(library, name) for library in libraries if hasattr(library, name)), None)
        if found is not None:
            yield name, ctypes.cast(found, ctypes.c_void_p).value or 0
        elif name in NEEDED:
            raise OSError(f"this system has no {name}")


def _caller(library: Library, path: str, found: dict[str, Any], written: Function, other: Function) -> Function:
    """Python that checks the arguments, packs them into words, calls, and makes the result of the words."""
    arguments, result = found["arguments"], found["result"]
    words = _result_words(result)
    names: dict[str, Any] = {
        "_other": other,
        "_run": library.entry(found["symbol"]),
        "_pack": struct.Struct(
            "=" + "".join(_CODES.get(leaf, "q") for form in arguments for leaf in leaves(form))
        ).pack,
        "_unpack": struct.Struct("=" + words).unpack,
        "_Words": ctypes.c_longlong * max(1, len(words)),
        "_fail": lambda status: _fail(path, status),
        "_taken": lambda dtype, shape, memory, data: _taken(library.release, dtype, shape, memory, data),
        "_error": struct.error,
        "_ndarray": np.ndarray,
        **{f"_{kind}": dtype for kind, dtype in _ARRAYS.items()},
    }
    source = _Source(list(inspect.signature(written).parameters), names)
    exec(source.text(arguments, result), names)
    call: Any = names["call"]
    call.__defaults__ = written.__defaults__
    call.__name__ = call.__qualname__ = written.__name__  # what Python calls it where arguments are missing
    return cast(Function, call)


def _result_words(form: Form) -> str:
    """How the words of a result are read: of an array its memory, its data and its shape."""
    codes = []
    for leaf in leaves(form):
        if n := dimensions(leaf):
            codes.append("q" * (2 + n))
        elif leaf != "none":
            codes.append(_CODES[leaf])
    return "".join(codes)


def _fail(path: str, status: int) -> None:
    raise RuntimeError(f"kernel {path} failed with status {status}")


def _taken(release: Callable[[int], None], dtype: np.dtype[Any], shape: tuple[int, ...], memory: int, data: int) -> Any:
    """An array of this `shape` that holds a copy of what a kernel left at `data`; its memory is given back."""
    size = dtype.itemsize
    for n in shape:
        size *= n
    array: Any = np.ndarray(shape, dtype, bytearray(ctypes.string_at(data, size)))
    if memory:
        release(memory)
    return array


class _Source:
    """Writes the Python of a caller whose `names` it extends by the classes it needs.

    All names but the parameters begin with _, so that no parameter is taken for one of them.
    """

    def __init__(self, parameters: list[str], names: dict[str, Any]) -> None:
        self._parameters = ", ".join(parameters)
        self._each = parameters
        self._names = names
        self._count = 0

    def text(self, arguments: list[Form], result: Form) -> str:
        """All of it."""
        words: list[str] = []
        lines = [
            line for name, form in zip(self._each, arguments, strict=True) for line in self._read(name, form, words)
        ]
        given = [f"_r{i}" for i in range(len(_result_words(result)))]
        answer = self._made(result, iter(given))
        return "\n    ".join(
            [
                f"def call({self._parameters}):",
                *lines,
                "try:",
                f"    _words = _pack({', '.join(words)})",
                "except _error:",
                f"    return _other({self._parameters})",
                "_out = _Words()",
                "_status = _run(_words, _out)",
                f"if _status not in {FINE}:",
                "    _fail(_status)",
                *([f"{', '.join(given)}, = _unpack(_out)"] if given else []),
                f"return {answer}",
            ]
        )

    def _new_name(self) -> str:
        self._count += 1
        return f"_v{self._count}"

    def _class(self, path: str) -> str:
        name = f"_C{abs(hash(path))}" if path else "tuple"
        if path:
            self._names[name] = class_at(path)
        return name

    def _read(self, name: str, form: Form, words: list[str]) -> Iterator[str]:
        """Lines that take apart what is called `name`, and leave for numba what has not this form; its `words`."""
        if isinstance(form, list):
            parts = [self._new_name() for _ in form[1:]]
            yield f"if type({name}) is not {self._class(form[0])} or len({name}) != {len(parts)}:"
            yield f"    return _other({self._parameters})"
            yield f"{', '.join(parts)}, = {name}"
            for part, inner in zip(parts, form[1:], strict=True):
                yield from self._read(part, inner, words)
        elif n := dimensions(form):
            kind = f"_{form[:2]}"
            fits = f"type({name}) is _ndarray and {name}.ndim == {n} and {name}.flags.c_contiguous"
            yield f"if not ({fits} and ({name}.dtype is {kind} or {name}.dtype == {kind})):"
            yield f"    return _other({self._parameters})"
            words.append(f"id({name})")
        else:
            words.append(name)

    def _made(self, form: Form, words: Iterator[str]) -> str:
        """An expression that makes a result of its words."""
        if isinstance(form, list):
            parts = "".join(f"{self._made(part, words)}, " for part in form[1:])
            return f"{self._class(form[0])}({parts})" if form[0] else f"({parts})"
        if n := dimensions(form):
            memory, data, *shape = (next(words) for _ in range(2 + n))
            return f"_taken(_{form[:2]}, ({''.join(f'{one}, ' for one in shape)}), {memory}, {data})"
        if form == "none":
            return "None"
        word = next(words)
        return f"{word} != 0" if form == "b1" else word

"""The entries of an object file: functions in C that take apart words, call a compiled kernel, and give words."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from importlib import import_module
from typing import Any

from llvmlite import ir

types: Any = import_module("numba.core.types")
"""What numba knows of the arguments of a kernel."""

ARRAY = "curveline_array"
"""The entry that tells how the others read an array."""


def symbol(place: int) -> str:
    """The name of the entry of the kernel at `place`."""
    return f"curveline_{place}"


def entries(compiled: Sequence[Any]) -> str:
    """A module in LLVM's language with an entry for each kernel that numba has compiled."""
    module = ir.Module("entries")
    EntryWriter(module, ARRAY).write_array()
    for place, one in enumerate(compiled):
        EntryWriter(module, symbol(place)).write_call(one)
    return str(module)


class EntryWriter:
    """Writes a function `(words in, words out) -> status`."""

    def __init__(self, module: Any, symbol: str) -> None:
        self._module = module
        self._word, self._byte, self._pointer = ir.IntType(64), ir.IntType(8), ir.PointerType()
        kind = ir.FunctionType(self._word, [self._pointer, self._pointer])
        self._function = ir.Function(module, kind, symbol)
        self._builder = ir.IRBuilder(self._function.append_basic_block())
        self._read = self._written = 0

    def write_array(self) -> None:
        """An entry that gives data, shape and strides of an array of two dimensions."""
        _, data, shape, strides = self._array(self._next(), 2)
        for word in (data, *shape, *strides):
            self._give(word)
        self._builder.ret(self._constant(0))

    def write_call(self, compiled: Any) -> None:
        """An entry that calls a compiled kernel."""
        described, convention = compiled.fndesc, compiled.target_context.call_conv
        kind = convention.get_function_type(described.restype, described.argtypes)
        callee = self._module.globals.get(described.mangled_name) or ir.Function(
            self._module, kind, described.mangled_name
        )
        words = [word for argument in described.argtypes for word in self._unpacked(argument)]
        result = compiled.target_context.data_model_manager[described.restype].get_return_type()
        place, error = self._builder.alloca(result), self._builder.alloca(self._pointer)
        self._builder.store(ir.Constant(result, None), place)
        values = [self._from_word(kind, word) for kind, word in zip(kind.args[2:], words, strict=True)]
        status = self._builder.call(callee, [place, error, *values])
        self._give_result(described.restype, self._builder.load(place, typ=result))
        self._builder.ret(self._builder.sext(status, self._word))

    def _constant(self, value: int) -> Any:
        return ir.Constant(self._word, value)

    def _at(self, base: Any, place: int, unit: Any) -> Any:
        """The word that stands `place` units behind `base`."""
        address = self._builder.gep(base, [self._constant(place)], source_etype=unit)
        return self._builder.load(address, typ=self._word)

    def _next(self) -> Any:
        self._read += 1
        return self._at(self._function.args[0], self._read - 1, self._word)

    def _give(self, word: Any) -> None:
        address = self._builder.gep(self._function.args[1], [self._constant(self._written)], source_etype=self._word)
        self._builder.store(word, address)
        self._written += 1

    def _array(self, word: Any, dimensions: int) -> tuple[Any, Any, list[Any], list[Any]]:
        """How many values an array has, their place, shape and strides, from the address of its Python object.

        numpy's `PyArrayObject` has data, number of dimensions, shape and strides behind the two words of any object.
        """
        array = self._builder.inttoptr(word, self._pointer)
        data = self._at(array, 16, self._byte)
        shape, strides = (self._builder.inttoptr(self._at(array, at, self._byte), self._pointer) for at in (32, 40))
        sizes = [self._at(shape, i, self._word) for i in range(dimensions)]
        count = sizes[0]
        for size in sizes[1:]:
            count = self._builder.mul(count, size)
        return count, data, sizes, [self._at(strides, i, self._word) for i in range(dimensions)]

    def _unpacked(self, kind: Any) -> Iterator[Any]:
        """What numba passes for an argument of its type `kind`, word by word."""
        if isinstance(kind, types.BaseTuple):
            for part in kind:
                yield from self._unpacked(part)
        elif isinstance(kind, types.Array):
            count, data, shape, strides = self._array(self._next(), kind.ndim)
            owner = self._constant(0)
            itemsize = self._constant(1 if kind.dtype == types.boolean else 8)
            yield from (owner, owner, count, itemsize, data, *shape, *strides)
        else:
            yield self._next()

    def _from_word(self, kind: Any, word: Any) -> Any:
        if isinstance(kind, ir.DoubleType):
            return self._builder.bitcast(word, kind)
        if isinstance(kind, ir.PointerType):
            return self._builder.inttoptr(word, kind)
        return word if kind.width == 64 else self._builder.trunc(word, kind)

    def _to_word(self, value: Any) -> Any:
        if isinstance(value.type, ir.DoubleType):
            return self._builder.bitcast(value, self._word)
        if isinstance(value.type, ir.PointerType):
            return self._builder.ptrtoint(value, self._word)
        return value if value.type.width == 64 else self._builder.zext(value, self._word)

    def _give_result(self, kind: Any, value: Any) -> None:
        """Numbers of a result as they are; of an array its memory, data and shape."""
        if isinstance(kind, types.BaseTuple):
            for i, part in enumerate(kind):
                self._give_result(part, self._builder.extract_value(value, i))
        elif isinstance(kind, types.Array):
            for i in (0, 4):
                self._give(self._to_word(self._builder.extract_value(value, i)))
            for i in range(kind.ndim):
                self._give(self._builder.extract_value(self._builder.extract_value(value, 5), i))
        elif not isinstance(kind, types.NoneType):
            self._give(self._to_word(value))

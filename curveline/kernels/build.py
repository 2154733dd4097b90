"""Compile the shipped kernels to one object file for this platform: `python -m curveline.kernels.build [FOLDER]`.

numba compiles each kernel with what it calls. The parts are linked, what nobody reaches is dropped, and each kernel
gets an entry that takes words, see `object_file`. The processor is the plainest one of its kind, so that the file runs
on all of them. Wheels hold what this makes; an installation of the sources makes it in place, and works without, too.
"""

from __future__ import annotations

import hashlib
import json
import os
import subprocess
import sys
import sysconfig
import tempfile
from collections.abc import Iterator
from importlib import import_module
from pathlib import Path
from pkgutil import walk_packages
from typing import Any

from curveline.kernels.cache import source_digest
from curveline.kernels.entries import entries, symbol
from curveline.kernels.forms import Form, class_at, dimensions, form_of
from curveline.kernels.kernel import LEAVES, SHIPPED, Kernel
from curveline.kernels.object_file import FOLDER, INDEX, NEEDED, Library, object_name
from curveline.kernels.runtime import ERRORS, MEMORY

ROOM = "curveline.rod"
"""The package that holds the kernels."""


def build(folder: Path = FOLDER) -> Path:
    """Compile all kernels that are shipped into `folder`, in a process of its own; takes a minute."""
    with tempfile.TemporaryDirectory() as cache:
        plain = {"NUMBA_CPU_NAME": "generic", "NUMBA_CPU_FEATURES": "", "CURVELINE_CACHE": cache}
        code = f"from curveline.kernels.build import compile_into; compile_into({str(folder)!r})"
        command = [sys.executable, "-c", code]
        path = os.pathsep.join([str(Path(__file__).parents[2]), os.environ.get("PYTHONPATH", "")])
        subprocess.run(command, env={**os.environ, **plain, "PYTHONPATH": path}, check=True)
    return folder


def compile_into(name: str) -> None:
    """What `build` does, in a process whose settings are those of a plain processor."""
    folder = Path(name)
    for module in walk_packages(import_module(ROOM).__path__, f"{ROOM}."):
        import_module(module.name)
    kernels = sorted(SHIPPED, key=lambda kernel: kernel.path)
    compiled = [_compiled(kernel) for kernel in kernels]
    for leaf in LEAVES:
        check_leaf(leaf)
    machine_code = _object([one.library.get_llvm_str() for one in compiled], entries(compiled))
    index = {
        "sources": source_digest(),
        "platform": sysconfig.get_platform(),
        "object": hashlib.sha256(machine_code).hexdigest(),
        "kernels": {
            kernel.path: {
                "symbol": symbol(place),
                "arguments": [form_of(kind) for kind in kernel.kinds],
                "result": _form_of_type(one.fndesc.restype),
            }
            for place, (kernel, one) in enumerate(zip(kernels, compiled, strict=True))
        },
    }
    Library(index, machine_code)  # ends here, rather than where it is used, if it can't be loaded
    _keep(folder, {object_name(str(index["object"])): machine_code, INDEX: json.dumps(index, indent=1).encode()})


def _keep(folder: Path, files: dict[str, bytes]) -> None:
    """Write files into a folder, all of them before the first takes its place, and take away what was there."""
    folder.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory(dir=folder) as apart:
        for name, data in files.items():
            (Path(apart) / name).write_bytes(data)
        for name in files:
            (Path(apart) / name).replace(folder / name)
    for old in folder.glob("*.o"):
        if old.name not in files:
            old.unlink(missing_ok=True)


def check_leaf(leaf: Kernel) -> None:
    """Raise TypeError for a compiled leaf that gives arrays: it counts no references, so that they would be freed."""
    for one in leaf.dispatcher.overloads.values():
        if "array" in str(one.signature.return_type):
            raise TypeError(f"{leaf.path} gives arrays: let it be one of njit")


def _compiled(kernel: Kernel) -> Any:
    arguments = tuple(_type_of(form_of(kind)) for kind in kernel.kinds)
    kernel.dispatcher.compile(arguments)
    return kernel.dispatcher.overloads[arguments]


def _type_of(form: Form) -> Any:
    """numba's type for a form."""
    types: Any = import_module("numba.core.types")

    numbers = {"f8": types.float64, "i8": types.int64, "b1": types.boolean}
    if isinstance(form, str):
        n = dimensions(form)
        return types.Array(numbers[form[:2]], n, "C") if n else numbers[form]
    parts = [_type_of(part) for part in form[1:]]
    if not form[0]:
        return types.Tuple(parts)
    cls = class_at(form[0])
    return types.NamedUniTuple(parts[0], len(parts), cls) if len(set(parts)) == 1 else types.NamedTuple(parts, cls)


def _form_of_type(kind: Any) -> Form:
    """The form of what numba infers that a kernel gives."""
    types: Any = import_module("numba.core.types")

    if isinstance(kind, types.BaseTuple):
        cls = getattr(kind, "instance_class", None)
        return [f"{cls.__module__}:{cls.__qualname__}" if cls else "", *map(_form_of_type, kind)]
    if isinstance(kind, types.Array) and kind.layout == "C":
        return f"{_form_of_type(kind.dtype)}[{kind.ndim}]"
    if isinstance(kind, types.NoneType):
        return "none"
    names: dict[Any, str] = {types.float64: "f8", types.int64: "i8", types.boolean: "b1"}
    return names[types.unliteral(kind)]


def _object(modules: list[str], entries: str) -> bytes:
    """Link modules in LLVM's language, drop what no entry reaches, put the counting in line, and translate the rest."""
    from llvmlite import binding as llvm

    linked = llvm.parse_assembly(MEMORY + ERRORS)
    for text in (*modules, entries):
        linked.link_in(llvm.parse_assembly(text))
    for name in (*linked.functions, *linked.global_variables):
        if not name.is_declaration and not name.name.startswith("curveline_"):
            name.linkage = "internal"
    linked.verify()
    options = {"cpu": "generic", "features": "", "opt": 3, "reloc": "static", "codemodel": "large"}
    machine = llvm.Target.from_default_triple().create_target_machine(**options)
    passes = llvm.create_new_module_pass_manager()
    passes.add_global_dead_code_eliminate_pass()
    passes.add_always_inliner_pass()
    passes.add_instruction_combine_pass()
    passes.add_dead_store_elimination_pass()
    passes.add_simplify_cfg_pass()
    passes.add_global_dead_code_eliminate_pass()
    passes.run(linked, llvm.create_pass_builder(machine, llvm.create_pipeline_tuning_options(speed_level=3)))
    if strange := sorted(_unknown(linked)):
        raise NotImplementedError(f"kernels call {', '.join(strange)}, which machine code by itself has not")
    return bytes(machine.emit_object(linked))


def _unknown(module: Any) -> Iterator[str]:
    """What a module calls that neither it nor the system has. Where it is called all the same, the process ends."""
    for function in module.functions:
        if function.is_declaration and not function.name.startswith("llvm.") and function.name not in (*NEEDED, "sqrt"):
            yield function.name


if __name__ == "__main__":
    build(Path(sys.argv[1]) if len(sys.argv) > 1 else FOLDER)

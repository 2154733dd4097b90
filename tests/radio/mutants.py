"""The real source of the link with one mistake in it: text replaced, compiled into a module of its own."""

from __future__ import annotations

import importlib
import sys
from dataclasses import dataclass
from itertools import count
from pathlib import Path
from types import ModuleType

from curveline.radio.node.machine import NodeMachine

_serial = count(1)


@dataclass(frozen=True)
class Mistake:
    """`old` becomes `new` in a module of `curveline.radio`; `caught` names the invariant that notices."""

    name: str
    module: str
    old: str
    new: str
    caught: str = ""


def with_body(module: ModuleType) -> type[NodeMachine]:
    """The node, which does without frames what the other `body` says."""
    other = {name: what for name, what in vars(module.NodeBody).items() if name not in vars(NodeMachine)}
    members = {name: what for name, what in other.items() if callable(what) or isinstance(what, property)}
    return type("Node", (NodeMachine,), members)


def mutant(mistake: Mistake) -> ModuleType:
    """The module with the mistake."""
    original = importlib.import_module(f"curveline.radio.{mistake.module}")
    path = Path(original.__file__ or "")
    source = path.read_text(encoding="utf-8")
    found = source.count(mistake.old)
    assert found == 1, f"{mistake.name}: {mistake.old!r} is {found} times in {path.name}"
    module = ModuleType(f"{original.__name__}_mutant{next(_serial)}")
    code = compile(source.replace(mistake.old, mistake.new), str(path), "exec", dont_inherit=True)
    sys.modules[module.__name__] = module  # dataclasses look themselves up by the name of their module
    try:
        exec(code, module.__dict__)
    finally:
        del sys.modules[module.__name__]
    return module

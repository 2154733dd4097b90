"""Every kernel that Python calls is shipped, and no other."""

from __future__ import annotations

import ast
from collections.abc import Iterator
from pathlib import Path

import curveline

ROOT = Path(curveline.__file__).parent
MODULES = {
    ".".join(path.relative_to(ROOT.parent).with_suffix("").parts): ast.parse(path.read_text())
    for path in sorted(ROOT.rglob("*.py"))
}
APART = ("curveline.bench",)
"""What measures kernels may compile some."""


def decorations(function: ast.stmt) -> set[str]:
    """Names of the decorators of a function."""
    found = function.decorator_list if isinstance(function, ast.FunctionDef) else []
    return {ast.unparse(decorator).split("(")[0] for decorator in found}


def kernels(decorator: str) -> set[str]:
    """Paths, module and name, of all kernels under a decorator."""
    return {
        f"{module}:{node.name}"
        for module, tree in MODULES.items()
        for node in tree.body
        if isinstance(node, ast.FunctionDef) and decorator in decorations(node)
    }


def names_in(module: str, tree: ast.Module) -> dict[str, str]:
    """What names in a module may stand for kernels: name -> path."""
    own = {node.name: f"{module}:{node.name}" for node in tree.body if isinstance(node, ast.FunctionDef)}
    given = {
        alias.asname or alias.name: f"{node.module}:{alias.name}"
        for node in ast.walk(tree)
        if isinstance(node, ast.ImportFrom)
        for alias in node.names
    }
    return {**own, **given}


def called_by_python(module: str, tree: ast.Module) -> Iterator[str]:
    """Paths of what functions that are no kernels name."""
    names = names_in(module, tree)
    for statement in tree.body:
        if not decorations(statement) & {"njit", "shipped"}:
            for node in ast.walk(statement):
                if isinstance(node, ast.Name) and isinstance(node.ctx, ast.Load) and node.id in names:
                    yield names[node.id]
                if isinstance(node, ast.Attribute) and isinstance(node.value, ast.Name) and node.value.id in names:
                    yield f"{names[node.value.id].replace(':', '.')}:{node.attr}"


def test_python_calls_shipped_kernels_and_no_others() -> None:
    called = {
        path
        for module, tree in MODULES.items()
        if not module.startswith(APART)
        for path in called_by_python(module, tree)
    }
    assert called & kernels("njit") == set(), "these are called from Python: decorate them with `shipped`"
    assert kernels("shipped") - called == set(), "these only kernels call: `njit` is enough"

"""Every kernel that Python calls is shipped: else numba compiles it, for seconds, in the middle of somebody's run."""

from __future__ import annotations

import ast
from collections.abc import Iterator
from pathlib import Path

import curveline

ROOT = Path(curveline.__file__).parent
COMPILED_IN_A_RUN = {
    "add_viscosity": "a rod with internal damping, which no command has",
}
"""Kernels that Python calls and that are not shipped, and why."""


def module_of(path: Path) -> str:
    return ".".join(path.relative_to(ROOT.parent).with_suffix("").parts)


def kind_of(node: ast.AST) -> str:
    """How a function is decorated: `njit`, `shipped`, or neither, "" then."""
    if not isinstance(node, ast.FunctionDef):
        return ""
    names = [ast.unparse(decorator).split("(")[0] for decorator in node.decorator_list]
    return next((name for name in names if name in ("njit", "shipped")), "")


def names_in_python(node: ast.AST) -> Iterator[str]:
    """Names that are read outside of kernels."""
    if kind_of(node):
        return
    if isinstance(node, ast.Name) and isinstance(node.ctx, ast.Load):
        yield node.id
    for child in ast.iter_child_nodes(node):
        yield from names_in_python(child)


def test_python_calls_no_kernel_that_is_not_shipped() -> None:
    trees = {module_of(path): ast.parse(path.read_text()) for path in sorted(ROOT.rglob("*.py"))}
    unshipped = {(name, node.name) for name, tree in trees.items() for node in tree.body if kind_of(node) == "njit"}
    called = set()
    for name, tree in trees.items():
        known = {kernel: (name, kernel) for module, kernel in unshipped if module == name}
        for node in ast.walk(tree):
            if isinstance(node, ast.ImportFrom):
                known |= {alias.asname or alias.name: (node.module or "", alias.name) for alias in node.names}
        if ".bench." not in name:  # it measures kernels one by one
            called |= {known[each][1] for each in names_in_python(tree) if known.get(each) in unshipped}
    assert called == set(COMPILED_IN_A_RUN)

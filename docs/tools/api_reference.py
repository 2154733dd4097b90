"""The reference of the public names, as Markdown, from signatures, docstrings and the comments beside fields."""

from __future__ import annotations

import ast
import enum
import importlib
import inspect
import sys
from collections.abc import Callable, Iterator
from functools import cache
from typing import Any

import curveline

INNER = "curveline.rod.problem"
"""The module whose classes are a matter of the solvers alone, although states hold some."""
LONGEST = 88
"""Characters of a signature on one line."""


def public_names() -> list[str]:
    """What the package offers by name, its version aside."""
    return [name for name in curveline.__all__ if not name.startswith("__")]


def markdown() -> str:
    """The text that stands on the page of the library."""
    offered = [getattr(curveline, name) for name in public_names()]
    lines = [line for name, each in zip(public_names(), offered, strict=True) for line in _offered(name, each)]
    types = [line for each in classes(offered) if each not in offered for line in _class(each, each.__name__)]
    return "\n".join([*lines, "## What they take and return", "", *types])


def classes(offered: list[Any]) -> list[type]:
    """The package's own classes that come in or out of what is offered, the nearest first."""
    found: list[type] = []
    pending = offered
    while pending:
        pending = list(dict.fromkeys(kind for each in pending for kind in _named_by(each) if kind not in found))
        found += pending
    return found


def _named_by(each: Any) -> Iterator[type]:
    """The package's classes in the annotations of a function, or of the fields and members of a class."""
    texts = list(_annotations(each))
    if isinstance(each, type):
        texts += [text for _, text, _ in _fields(each)]
        texts += [text for _, member in _members(each) for text in _annotations(member)]
    for text in texts:
        for node in ast.walk(ast.parse(text, mode="eval")):
            kind = _resolved(each, node.id) if isinstance(node, ast.Name) else None
            if isinstance(kind, type) and kind.__module__.startswith("curveline") and kind.__module__ != INNER:
                yield kind


def _annotations(each: Any) -> Iterator[str]:
    """How parameters and result of a function or property are annotated."""
    function = each.fget if isinstance(each, property) else each
    if not isinstance(function, type) and callable(function):
        yield from (str(text) for text in inspect.get_annotations(function).values())


def _resolved(each: Any, name: str) -> Any:
    """What a name means in the module that defines something, what only a type checker sees included."""
    module = sys.modules[each.__module__]
    if hasattr(module, name):
        return getattr(module, name)
    for node in ast.walk(_tree(module.__name__)):
        if isinstance(node, ast.ImportFrom) and any((alias.asname or alias.name) == name for alias in node.names):
            return getattr(importlib.import_module(node.module or ""), name, None)
    return None


@cache
def _tree(module: str) -> ast.Module:
    return ast.parse(inspect.getsource(sys.modules[module]))


def _offered(name: str, each: Any) -> Iterator[str]:
    if isinstance(each, type):
        yield from _class(each, name, level=2)
        return
    yield from (f"## {name}", "", *_signature(f"curveline.{name}", each), "", inspect.getdoc(each) or "", "")


def _class(kind: type, name: str, level: int = 3) -> Iterator[str]:
    """Docstring, fields and public members of a class."""
    yield from (f"{'#' * level} {name}", "", f"`{kind.__module__}.{kind.__qualname__}`", "")
    yield from (_docstring(kind), "")
    if issubclass(kind, enum.Enum):
        yield from (f"- `{each.name}`: {each.value}" for each in kind)
    elif fields := list(_fields(kind)):
        yield from ("| field | type | |", "|---|---|---|")
        yield from (f"| `{field}` | `{text}` | {_cell(comment)} |" for field, text, comment in fields)
    yield ""
    for member, value in _members(kind):
        yield from _member(member, value)
    yield ""


def _docstring(kind: type) -> str:
    """What a class says of itself; not the signature that dataclasses put there, nor what it has from its base."""
    own = kind.__dict__.get("__doc__") or ""
    return "" if own.startswith(f"{kind.__name__}(") else inspect.cleandoc(own)


def _member(name: str, value: Any) -> Iterator[str]:
    """A property or method as an item: how it is used, and what its docstring says."""
    if isinstance(value, property):
        result = inspect.get_annotations(value.fget or _member).get("return", "")
        yield f"- `{name}`: `{result}`. {_indented(inspect.getdoc(value))}"
    else:
        yield f"- `{name}{_call(value, skip=1)}`. {_indented(inspect.getdoc(value))}"


def _indented(words: str | None) -> str:
    return (words or "").replace("\n", "\n    ")


def _members(kind: type) -> Iterator[tuple[str, Any]]:
    """Public properties and methods of a class, in the order of its source."""
    if issubclass(kind, enum.Enum):
        return
    for name, value in vars(kind).items():
        is_own = isinstance(value, property) or (inspect.isfunction(value) and value.__module__ == kind.__module__)
        if is_own and not name.startswith("_") and inspect.getdoc(value):
            yield name, value


def _fields(kind: type) -> Iterator[tuple[str, str, str]]:
    """Name, annotation, and the comment beside it, of every field that is declared in the source of a class."""
    declared = next((each for each in _classes(kind.__module__) if each.name == kind.__name__), None)
    source = inspect.getsource(sys.modules[kind.__module__]).splitlines()
    for node in declared.body if declared else ():
        if isinstance(node, ast.AnnAssign) and isinstance(node.target, ast.Name) and node.target.id[0] != "_":
            beside = source[(node.end_lineno or 1) - 1][node.end_col_offset or 0 :].strip()
            yield node.target.id, ast.unparse(node.annotation), beside.removeprefix("#").strip()


def _classes(module: str) -> list[ast.ClassDef]:
    return [node for node in _tree(module).body if isinstance(node, ast.ClassDef)]


def _signature(name: str, function: Callable[..., Any]) -> Iterator[str]:
    """How a function is called, as a block of Python."""
    call = f"{name}{_call(function)}"
    if len(call) > LONGEST:
        lines = "".join(f"    {each},\n" for each in _parameters(function))
        call = f"{name}(\n{lines}){_result(function)}"
    yield from ("```python", call, "```")


def _call(function: Callable[..., Any], skip: int = 0) -> str:
    return f"({', '.join(_parameters(function)[skip:])}){_result(function)}"


def _parameters(function: Callable[..., Any]) -> list[str]:
    parts, is_bare = [], False
    for each in inspect.signature(function).parameters.values():
        if each.kind is each.KEYWORD_ONLY and not is_bare:
            parts.append("*")
        is_bare = is_bare or each.kind in (each.KEYWORD_ONLY, each.VAR_POSITIONAL)
        parts.append(str(each.replace(annotation=each.empty, default=each.empty)) + _rest(each))
    return parts


def _rest(each: inspect.Parameter) -> str:
    """Annotation and default of a parameter."""
    annotation = "" if each.annotation is each.empty else f": {each.annotation}"
    if each.default is each.empty:
        return annotation
    default = "..." if callable(each.default) else repr(each.default)
    return f"{annotation} = {default}" if annotation else f"={default}"


def _result(function: Callable[..., Any]) -> str:
    result = inspect.get_annotations(function).get("return")
    return f" -> {result}" if result else ""


def _cell(words: str) -> str:
    """Words in a table, where a bar outside of code would end a column."""
    return words.replace("|", "\\|")

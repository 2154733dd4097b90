"""The reference of the public names, as Markdown, from signatures, docstrings and the comments beside fields."""

from __future__ import annotations

import ast
import dataclasses
import enum
import importlib
import inspect
import sys
from collections.abc import Callable, Iterator
from functools import cache
from typing import Any

import curveline

INNER = (
    "curveline.driving.interrupted",
    "curveline.driving.live",
    "curveline.driving.sending.Outlet",
    "curveline.driving.tours",
    "curveline.loading.pushes.Stand",
    "curveline.radio.host.actions.Phase",
    "curveline.radio.host.journal",
    "curveline.radio.host.resume",
    "curveline.radio.interface",
    "curveline.radio.protocol",
    "curveline.rod.branches",
    "curveline.rod.models.choice",
    "curveline.rod.planar",
    "curveline.rod.problem",
    "curveline.rod.section",
    "curveline.rod.spatial",
    "curveline.simulation.batch",
    "curveline.simulation.sweep_view",
)
"""Where classes are a matter of the machinery alone, although results hold some."""
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
        texts += [text for _, text, _ in fields(each)]
        texts += [text for _, member in _members(each) for text in _annotations(member)]
    for text in texts:
        for node in ast.walk(ast.parse(text, mode="eval")):
            kind = _resolved(each, node.id) if isinstance(node, ast.Name) else None
            if isinstance(kind, type) and _is_shown(kind):
                yield kind


def _is_shown(kind: type) -> bool:
    """True for a class of the package that is no matter of the machinery alone."""
    name = f"{kind.__module__}.{kind.__qualname__}"
    return name.startswith("curveline.") and not f"{name}.".startswith(tuple(f"{inner}." for inner in INNER))


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
    source = _imported(module.__name__).get(name)
    return None if source is None else getattr(importlib.import_module(source), name, None)


@cache
def _imported(module: str) -> dict[str, str]:
    """The names that a module's source imports from others, each with the first module that it comes from."""
    found = [node for node in ast.walk(_tree(module)) if isinstance(node, ast.ImportFrom)]
    return {alias.asname or alias.name: node.module or "" for node in reversed(found) for alias in node.names}


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
    elif found := list(fields(kind)):
        yield from ("| field | type | |", "|---|---|---|")
        defaults = _defaults(kind)
        yield from (
            f"| `{field}` | `{text}{defaults.get(field, '')}` | {_cell(comment)} |" for field, text, comment in found
        )
    yield ""
    for member, value in _members(kind):
        yield from _member(member, value)
    yield ""


def _defaults(kind: type) -> dict[str, str]:
    """What fields of a dataclass or a named tuple are if nothing is given, as text that follows their type."""
    if issubclass(kind, tuple):
        return {name: f" = {_plainly(value)}" for name, value in getattr(kind, "_field_defaults", {}).items()}
    fields = dataclasses.fields(kind) if dataclasses.is_dataclass(kind) else ()
    known = {field.name: field.default for field in fields if field.default is not dataclasses.MISSING}
    return {name: f" = {_plainly(value)}" for name, value in known.items()}


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


def fields(kind: type) -> Iterator[tuple[str, str, str]]:
    """Name, annotation, and the words beside or below it, of every field that is declared in the source of a class."""
    declared = next((each for each in _classes(kind.__module__) if each.name == kind.__name__), None)
    source = inspect.getsource(sys.modules[kind.__module__]).splitlines()
    body = declared.body if declared else []
    for node, after in zip(body, [*body[1:], ast.Pass()], strict=True):
        if isinstance(node, ast.AnnAssign) and isinstance(node.target, ast.Name) and node.target.id[0] != "_":
            beside = source[(node.end_lineno or 1) - 1][node.end_col_offset or 0 :].strip()
            words = beside.removeprefix("#").strip() or _docstring_of(after)
            yield node.target.id, ast.unparse(node.annotation), words


def _docstring_of(node: ast.stmt) -> str:
    """What stands below a field as a string of its own; empty for any other statement."""
    value = node.value if isinstance(node, ast.Expr) else None
    return str(value.value) if isinstance(value, ast.Constant) and isinstance(value.value, str) else ""


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
    default = _plainly(each.default)
    return f"{annotation} = {default}" if annotation else f"={default}"


def _plainly(default: Any) -> str:
    """A default as one would write it; `...` for an object that has no such form."""
    return "..." if callable(default) or (text := repr(default)).startswith("<") else text


def _result(function: Callable[..., Any]) -> str:
    result = inspect.get_annotations(function).get("return")
    return f" -> {result}" if result else ""


def _cell(words: str) -> str:
    """Words in a table, where a bar outside of code would end a column."""
    return words.replace("|", "\\|")

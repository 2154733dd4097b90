"""How results look in a notebook: a figure, where matplotlib is there to draw it, and a table.

Results stand below the figures, so what draws them is named by module and function, and loaded when it is wanted.
"""

from __future__ import annotations

from collections.abc import Sequence
from html import escape
from importlib import import_module

from curveline.errors import MissingExtra


def svg_of(drawn_by: str, content: object) -> str | None:
    """The figure of a result as SVG, by a function MODULE:NAME; None without matplotlib."""
    module, _, name = drawn_by.partition(":")
    try:
        drawn: bytes = getattr(import_module(module), name)(content, kind="svg")
    except MissingExtra:
        return None
    return drawn.decode()


def html_of(
    title: str, rows: Sequence[Sequence[object]], svg: str | None = None, *, remarks: Sequence[str] = ()
) -> str:
    """A title, a figure if there is one, a table whose first row is its head, and sentences below it."""
    figure = "" if svg is None else f"<div>{svg[svg.index('<svg') :]}</div>"
    head, *body = rows
    lines = [_row("th", head), *(_row("td", row) for row in body)]
    below = "".join(f"<div>{escape(each)}</div>" for each in remarks)
    return f"<div><b>{escape(title)}</b>{figure}<table>{''.join(lines)}</table>{below}</div>"


def _row(tag: str, cells: Sequence[object]) -> str:
    return f"<tr>{''.join(f'<{tag}>{escape(_text(cell))}</{tag}>' for cell in cells)}</tr>"


def _text(cell: object) -> str:
    return f"{cell:.4g}" if isinstance(cell, float) else str(cell)

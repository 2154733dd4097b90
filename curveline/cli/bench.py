"""`curveline bench`: speed and accuracy, measured on this machine."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from curveline.cli import show
from curveline.errors import InvalidInput

if TYPE_CHECKING:
    from curveline.measured import Row


def bench(
    shapes: Annotated[
        list[Path] | None, typer.Argument(metavar="[SHAPE]...", help="Shape files; the project's own if none is named.")
    ] = None,
    quick: Annotated[bool, typer.Option("--quick", help="Only the figures that are held against goals.")] = False,
    link: Annotated[bool, typer.Option("--link", help="The radio link instead, on a model of the radios.")] = False,
    json: Annotated[bool, typer.Option("--json", help="One JSON document on stdout.")] = False,
) -> None:
    """Measure speed and accuracy on this machine: about half a minute, and as long again without --quick.

    Timings vary from run to run; the ratios are taken in one run and vary less. Nothing here passes or fails.

    With --link host and nodes talk through modelled air at 2 Mbit/s: how often nodes are polled, what lost packets
    cost, how soon a step is released. The times of SPI (0.6 ms a poll) and of a dongle (2 ms a request of up to 16
    frames, 0.05 ms a frame) are assumed. What a node's processor spends is measured in the source tree, by
    `python -m tests.firmware.cycles`.
    """
    if link and (shapes or quick):
        raise InvalidInput("--link measures no shapes and is always quick", "leave the other arguments out")
    rows: list[Row] = []
    for row in _link_figures() if link else _figures([str(path) for path in shapes or _own_shapes()], quick=quick):
        rows.append(row)
        if not json:
            show.result(_line(row))
    if json:
        show.emit({"rows": [vars(row) for row in rows]})


def _figures(files: list[str], *, quick: bool) -> Iterator[Row]:
    show.announce_compilation()
    from curveline import bench as figures

    yield from figures.quick(files)
    if not quick:
        yield from figures.trade(files)


def _link_figures() -> Iterator[Row]:
    from curveline import linkbench

    yield from linkbench.rows()


def _own_shapes() -> list[Path]:
    """The shape files of the source tree that this package runs from."""
    folder = Path(__file__).parents[2] / "shapes"
    found = sorted(folder.glob("*.toml"))
    if not found:
        raise InvalidInput("no shape files to measure with", "name some: curveline bench SHAPE...")
    return found


def _line(row: Row) -> str:
    """One row in 80 columns."""
    value = f"{row.value:.0f}" if row.value >= 100 or row.value == int(row.value) else f"{row.value:.3g}"
    return f"{row.name:<33}{value:>8} {row.unit:<3}{row.goal:>8}  {row.how:<25}".rstrip()

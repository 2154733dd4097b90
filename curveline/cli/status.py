"""`curveline status`: what every node says now."""

from __future__ import annotations

import sys
import time
from collections.abc import Callable, Iterator
from contextlib import closing, contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, NamedTuple

import typer

from curveline.cli import nodes, show
from curveline.cli.nodes import DisplayOption, RadioOption, RunsOption
from curveline.cli.segments import in_words, wrapped
from curveline.errors import EXIT_DONE, EXIT_LINK, InvalidInput

if TYPE_CHECKING:
    from curveline.plan import DriveTable
    from curveline.radio.link import NodeStatus

POLL_SECONDS = 1.0


def status(
    radio: RadioOption = None,
    display: DisplayOption = "single",
    watch: Annotated[bool, typer.Option("--watch", help="Ask again every second, until Ctrl-C.")] = False,
    scan: Annotated[
        bool, typer.Option("--scan", help="Who is on the air: chips, doubles, refused frames, loss. Needs no keys.")
    ] = False,
    radio_test: Annotated[
        bool, typer.Option("--radio-test", help="Test the radio chips: whole answers, repeats dropped. Needs no keys.")
    ] = False,
    json: Annotated[bool, typer.Option("--json", help="JSON on stdout, one document per poll and line.")] = False,
    runs: RunsOption = None,
) -> None:
    """Say how every node is: state, position, faults, link.

    Asking disturbs no run.
    """
    from curveline.plan import drive_table
    from curveline.shapefile import read_display

    spec = nodes.require_radio(radio)
    if watch + scan + radio_test > 1:
        raise InvalidInput("--watch, --scan and --radio-test are three different questions", hint="ask one at a time")
    asked = Asked(spec, drive_table(read_display(display)), nodes.runs_folder(runs))
    if scan or radio_test:
        from curveline.cli.survey import survey

        raise typer.Exit(survey(asked, tests=radio_test, as_json=json))
    if watch:
        _watch(asked, as_json=json)
    answer = _ask(asked)
    _show(answer, as_json=json)
    raise typer.Exit(EXIT_DONE if answer.is_well else EXIT_LINK)


class Asked(NamedTuple):
    """Whom to ask, and how."""

    spec: str
    drive: DriveTable
    runs: Path


class _Answer(NamedTuple):
    """What the nodes said, and the states of the rod where somebody knows them."""

    asked: Asked
    statuses: list[NodeStatus]
    rod: list[str] | None

    @property
    def is_well(self) -> bool:
        """True if every node answered and none has a fault."""
        return all(each.counts is not None and not each.fault for each in self.statuses)

    def document(self) -> dict[str, Any]:
        """The answer as plain data."""
        from curveline import __version__

        return {
            "curveline": __version__,
            "display": self.asked.drive.display,
            "radio": self.asked.spec,
            "nodes": [nodes.document(each, self.asked.drive) for each in self.statuses],
            "rod": self.rod,
        }

    def lines(self) -> list[str]:
        """The answer as text."""
        rod = [] if self.rod is None else wrapped(f"rod: {in_words(self.rod) or 'not known'}")
        return [
            f"display {self.asked.drive.display} over {self.asked.spec}",
            *nodes.table(self.statuses, self.asked.drive),
            *rod,
        ]


def _ask(asked: Asked) -> _Answer:
    """One round of questions; the radio is given back after it, so that a run can begin between two."""
    from curveline.radio import open_radio
    from curveline.radio.link import read_status

    with closing(open_radio(asked.spec, asked.drive, asked.runs)) as radio:
        statuses = read_status(radio, asked.drive)
        mock = nodes.mock_of(radio)
        return _Answer(asked, statuses, None if mock is None else list(mock.known_rod))


def _show(answer: _Answer, *, as_json: bool) -> None:
    if as_json:
        show.emit(answer.document())
    else:
        show.result("\n".join(answer.lines()))


def _watch(asked: Asked, *, as_json: bool) -> None:
    """Ask for ever; Ctrl-C ends it. While a run has the display to itself, say so and wait for its end."""
    from curveline.radio.store import InUse

    is_waiting = False
    with _screen(as_json=as_json) as update:
        while True:
            try:
                update(_ask(asked))
                is_waiting = False
            except InUse as error:
                if not is_waiting:
                    show.note(f"waiting: {error.message}")
                is_waiting = True
            time.sleep(POLL_SECONDS)


@contextmanager
def _screen(*, as_json: bool) -> Iterator[Callable[[_Answer], None]]:
    """Where answers go: written over each other on a terminal, one after the other elsewhere."""
    if as_json or not show.is_live(sys.stderr):
        yield lambda answer: _show(answer, as_json=as_json)
        return
    from rich.live import Live
    from rich.text import Text

    with Live(console=show.console(), auto_refresh=False) as live:
        yield lambda answer: live.update(Text("\n".join(answer.lines())), refresh=True)

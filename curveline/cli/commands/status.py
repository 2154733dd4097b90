"""`curveline status`: what every node says now."""

from __future__ import annotations

import sys
import time
from collections.abc import Callable, Iterator
from contextlib import closing, contextmanager
from typing import TYPE_CHECKING, Annotated, Any, NamedTuple

import typer

from curveline.cli.asked import Asked
from curveline.cli.printing import node_table, screen
from curveline.cli.printing.node_table import DisplayOption, RadioOption, RunsOption
from curveline.cli.printing.phrases import in_words, wrapped
from curveline.errors import EXIT_DONE, EXIT_LINK, InvalidInput

if TYPE_CHECKING:
    from curveline.driving.live import Sender
    from curveline.radio.host.node_status import NodeStatus
    from curveline.radio.interface import InUse

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

    Asking disturbs no run: while this computer sends one to the display, the sending process tells what it knows.
    """
    from curveline.plan_file import drive_settings
    from curveline.shapes.files import read_display

    spec = node_table.require_radio(radio)
    if watch + scan + radio_test > 1:
        raise InvalidInput("--watch, --scan and --radio-test are three different questions", hint="ask one at a time")
    asked = Asked(spec, display, drive_settings(read_display(display)), node_table.runs_folder(runs))
    if scan or radio_test:
        from curveline.cli.scan import survey

        raise typer.Exit(survey(asked, tests=radio_test, as_json=json))
    if watch:
        _watch(asked, as_json=json)
    answer = _ask(asked)
    _show(answer, as_json=json)
    raise typer.Exit(EXIT_DONE if answer.is_well else EXIT_LINK)


class _Answer(NamedTuple):
    """What the nodes said, and the states of the rod where somebody knows them; `sender` is who tells it instead."""

    asked: Asked
    statuses: list[NodeStatus]
    rod: list[str] | None = None
    sender: Sender | None = None

    @property
    def is_well(self) -> bool:
        """True if every node answered and can move."""
        return all(each.can_move for each in self.statuses)

    def document(self) -> dict[str, Any]:
        """The answer as plain data."""
        from curveline import __version__

        return {
            "curveline": __version__,
            "display": self.asked.drive.display,
            "radio": self.asked.spec,
            "nodes": [node_table.document(each, self.asked.drive) for each in self.statuses],
            "rod": self.rod,
            "sender": None if self.sender is None else _sender_document(self.sender),
        }

    def lines(self) -> list[str]:
        """The answer as text."""
        rod = [] if self.rod is None else wrapped(f"rod: {in_words(self.rod) or 'not known'}")
        told = [] if self.sender is None else wrapped(_sender_line(self.sender))
        return [
            f"display {self.asked.drive.display} over {self.asked.spec}",
            *told,
            *node_table.table(self.statuses, self.asked.drive),
            *rod,
        ]


def _ask(asked: Asked) -> _Answer:
    """One round of questions, to the process that is sending to these nodes, or else to them.

    The radio is given back after it, so that a run can begin between two.
    """
    from curveline.driving.live import news_of
    from curveline.radio.interface import InUse

    if (sender := news_of(asked.drive, asked.spec, asked.runs)) is not None:
        return _Answer(asked, sender.live.statuses, sender=sender)
    try:
        return _ask_nodes(asked)
    except InUse as error:
        if (sender := news_of(asked.drive, asked.spec, asked.runs)) is not None:
            return _Answer(asked, sender.live.statuses, sender=sender)
        raise _by_whom(error, asked) from None


def _ask_nodes(asked: Asked) -> _Answer:
    from curveline.radio.host.link import read_status
    from curveline.radio.interface import open_radio

    with closing(open_radio(asked.spec, asked.drive, asked.runs)) as radio:
        statuses = read_status(radio, asked.drive, asked.display)
        mock = node_table.mock_of(radio)
        return _Answer(asked, statuses, None if mock is None else list(mock.known_rod))


def _by_whom(error: InUse, asked: Asked) -> InUse:
    """Why the radio is in use, with who sends to another display over it, if that is known."""
    from curveline.driving.live import same_radio, senders

    others = [each for each in senders(asked.runs) if same_radio(each.live.radio, asked.spec)]
    who = f": {others[0].name}" if others and not asked.spec.startswith("mock") else ""
    return type(error)(error.message + who, error.hint)


def _sender_document(sender: Sender) -> dict[str, Any]:
    live = sender.live
    facts = {key: getattr(live, key) for key in ("process", "plan", "phase", "step", "steps", "seconds")}
    return {**facts, "run": str(sender.run), "age_s": round(live.age, 3)}


def _sender_line(sender: Sender) -> str:
    live = sender.live
    return f"told {live.age:.1f} s ago by {sender.name}: step {live.step} of {live.steps}, {live.phase}"


def _show(answer: _Answer, *, as_json: bool) -> None:
    if as_json:
        screen.emit(answer.document())
    else:
        screen.result("\n".join(answer.lines()))


def _watch(asked: Asked, *, as_json: bool) -> None:
    """Ask for ever; Ctrl-C ends it. While somebody who tells nothing has the display, say so and wait."""
    from curveline.radio.interface import InUse

    is_waiting = False
    with _screen(as_json=as_json) as update:
        while True:
            try:
                update(_ask(asked))
                is_waiting = False
            except InUse as error:
                if not is_waiting:
                    screen.note(f"waiting: {error.message}")
                is_waiting = True
            time.sleep(POLL_SECONDS)


@contextmanager
def _screen(*, as_json: bool) -> Iterator[Callable[[_Answer], None]]:
    """Where answers go: written over each other on a terminal, one after the other elsewhere."""
    if as_json or not screen.is_live(sys.stderr):
        yield lambda answer: _show(answer, as_json=as_json)
        return
    from rich.live import Live
    from rich.text import Text

    with Live(console=screen.console(), auto_refresh=False) as live:
        yield lambda answer: live.update(Text("\n".join(answer.lines())), refresh=True)

"""`curveline status`: what every node says now."""

from __future__ import annotations

import time
from typing import TYPE_CHECKING, Annotated

import typer

from curveline.cli.options import (
    RESULTS,
    BriefOption,
    DisplayOption,
    RadioOption,
    RunsOption,
    require_radio,
    runs_folder,
)
from curveline.cli.printing import screen
from curveline.cli.printing.progress.watching import watching
from curveline.cli.terminal import TERMINAL
from curveline.errors import EXIT_DONE, EXIT_LINK, InvalidInput

if TYPE_CHECKING:
    from curveline.driving.session import Session
    from curveline.driving.status import DisplayStatus

POLL_SECONDS = 1.0


def status(
    radio: RadioOption = None,
    display: DisplayOption = "single",
    watch: Annotated[bool, typer.Option("-w", "--watch", help="Ask again every second, until Ctrl-C.")] = False,
    scan: Annotated[
        bool, typer.Option("--scan", help="Who is on the air: chips, doubles, refused frames, loss. Needs no keys.")
    ] = False,
    radio_test: Annotated[
        bool, typer.Option("--radio-test", help="Test the radio chips: whole answers, repeats dropped. Needs no keys.")
    ] = False,
    json: Annotated[
        bool, typer.Option("--json", rich_help_panel=RESULTS, help="JSON on stdout, one document per poll and line.")
    ] = False,
    brief: BriefOption = False,
    runs: RunsOption = None,
) -> None:
    """Say how every node is: state, position, faults, link.

    Asking disturbs no run: while this computer sends one to the display, the sending process tells what it knows.
    """
    if watch + scan + radio_test > 1:
        raise InvalidInput("--watch, --scan and --radio-test are three different questions", hint="ask one at a time")
    from curveline.driving.session import connect

    with connect(require_radio(radio), display, runs=runs_folder(runs), listener=TERMINAL) as session:
        if scan or radio_test:
            raise typer.Exit(_scan(session, tests_chips=radio_test, as_json=json))
        if watch:
            _watch(session, as_json=json)
        found = session.status()
    _show(found, as_json=json)
    raise typer.Exit(EXIT_DONE if found.is_well else EXIT_LINK)


def _scan(session: Session, *, tests_chips: bool, as_json: bool) -> int:
    """Ask every address, show the answers, and return the exit code."""
    from curveline.cli.printing.reports.status_text import UNTESTED, describe_radio_test, describe_scan

    scan = session.scan(tests_chips=tests_chips)
    if as_json:
        screen.emit(scan.document())
    else:
        screen.result("\n".join((describe_radio_test if tests_chips else describe_scan)(scan)))
        if tests_chips:
            screen.note(UNTESTED)
    return EXIT_DONE if scan.is_well else EXIT_LINK


def _show(status: DisplayStatus, *, as_json: bool) -> None:
    from curveline.cli.printing.reports.status_text import describe

    if as_json:
        screen.emit(status.document())
    else:
        screen.result("\n".join(describe(status)))


def _watch(session: Session, *, as_json: bool) -> None:
    """Ask for ever; Ctrl-C ends it. While somebody who tells nothing has the display, say so and wait."""
    from curveline.cli.printing.reports.status_text import describe
    from curveline.radio.interface import InUse

    is_waiting = False
    with watching() as show:
        while True:
            try:
                status = session.status()
                screen.emit(status.document()) if as_json else show(list(describe(status)))
                is_waiting = False
            except InUse as error:
                if not is_waiting:
                    screen.note(f"waiting: {error.message}")
                is_waiting = True
            # So that a run can begin between two.
            session.close()
            time.sleep(POLL_SECONDS)

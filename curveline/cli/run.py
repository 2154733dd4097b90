"""What `curveline send` does with what was named on the command line: asks, sends, and says how it ended."""

from __future__ import annotations

import os
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING

from curveline.cli import consent
from curveline.cli.printing import screen
from curveline.cli.printing.reports import plan_text, run_text
from curveline.cli.terminal import TERMINAL
from curveline.drive_settings import DEFAULT_DISPLAY
from curveline.driving.dry_run import DrySite, dry_run_of
from curveline.driving.interrupted import find_interrupted_run
from curveline.driving.runs import LAST
from curveline.driving.sending import PreparedRun, advise_resuming
from curveline.driving.session import connect
from curveline.driving.tours import Tour
from curveline.driving.wishes import Wish, named_to_resume, wish_of
from curveline.errors import EXIT_DONE, EXIT_INTERRUPTED, EXIT_NO, InvalidInput, LinkError
from curveline.plan_file import Plan
from curveline.radio.host.actions import Policy
from curveline.radio.host.link import Control, OperatorRequest
from curveline.shapes.radians import tell_of_radians

if TYPE_CHECKING:
    from curveline.driving.run_result import RunResult
    from curveline.scene import Display


@dataclass(frozen=True)
class Named:
    """What was named on the command line."""

    files: tuple[str, ...]
    resume: str | None
    display: str | None
    home: bool

    @property
    def folder(self) -> str:
        """The folder of lines among the files, "" if there is none."""
        return next((each for each in self.files if os.path.isdir(each)), "")

    def checked(self) -> Named:
        """The same; InvalidInput unless it is one thing."""
        if bool(self.files or self.home) is (self.resume is not None):
            raise InvalidInput(
                "name a plan, shapes, a folder of lines, --home, or a run to --resume, and only one of them"
            )
        if self.display is not None and (self.files or not (self.home or self.resume == LAST)):
            hint = "a plan, a shape or a run names its own display"
            raise InvalidInput("--display is for --home alone and for --resume last", hint)
        if self.folder and len(self.files) > 1:
            hint = "send the shapes of each line by themselves"
            raise InvalidInput(f"{self.folder}: a folder of lines is taken by itself", hint)
        return self


@dataclass(frozen=True)
class Means:
    """How to send: through which radio, "" if none was named, with the records where, and what the operator allows."""

    spec: str
    runs: Path
    touched: bool = False
    takeover: bool = False
    asks: bool = True


def wish_of_named(named: Named, runs: Path, *, touched: bool = False) -> Wish:
    """What is to be sent; InvalidInput unless it can be read."""
    if named.resume is not None:
        wish: Wish = find_interrupted_run(named.resume, runs)
    else:
        wish = wish_of(named.files, home=named.home, display=named.display or DEFAULT_DISPLAY)
    if touched and not isinstance(wish, Tour):
        raise InvalidInput(
            "--touched is for shapes and for --home: this plan is made already", "send the shape instead"
        )
    if isinstance(wish, Tour):
        tell_of_radians(wish.scenes, TERMINAL)
    return wish


def with_run(named: Named, runs: Path) -> Named:
    """The same, with the run itself where the last one was asked for; InvalidInput if there is none that can go on."""
    if named.resume != LAST:
        return named
    return replace(named, resume=named_to_resume(LAST, _name_of(named.display), runs, TERMINAL))


def _name_of(display: str | None) -> str:
    """The name of a display, "" for any."""
    if display is None:
        return ""
    from curveline.shapes.files import given_display

    return given_display(display).name


def rehearse(wish: Wish, means: Means, *, as_json: bool) -> None:
    """Print what would be staged."""
    from curveline.cli.printing.reports import frame_table

    dry = dry_run_of(wish, DrySite(means.spec, means.runs, means.touched, TERMINAL))
    if as_json:
        screen.emit(dry.document())
    else:
        screen.result("\n".join([*plan_text.describe(dry.plan), *frame_table.table(dry.frames)]))
    screen.note("dry run: nothing was sent")


def send_wish(wish: Wish, means: Means, *, as_json: bool) -> int:
    """Plan from where the display stands, ask, send, and say how it ended; the exit code."""
    if means.asks:
        consent.require_terminal("sending moves the display, and ", "add --yes to agree")
    with (
        connect(means.spec, _display_of(wish), runs=means.runs, listener=TERMINAL) as session,
        session.prepared(wish, touched=means.touched) as run,
    ):
        if means.asks and not consent.agrees("Move the display?"):
            screen.note("nothing was sent")
            return EXIT_NO
        result = _sent(run, Control(Policy(takeover=means.takeover), tell=screen.note))
    return EXIT_INTERRUPTED if result is None else _conclude(result, as_json=as_json)


def _display_of(wish: Wish) -> Display | Plan:
    """The display that is to be driven."""
    if isinstance(wish, Tour):
        return wish.display
    return wish if isinstance(wish, Plan) else wish.plan


def _sent(run: PreparedRun, control: Control) -> RunResult | None:
    """Send; None after an emergency stop, which ends a run as a fault of all nodes, but is what somebody asked for."""
    try:
        return run.send(control)
    except LinkError as error:
        if control.request is OperatorRequest.NONE:
            raise
        screen.complain(error)
        return None


def _conclude(result: RunResult, *, as_json: bool) -> int:
    """Say how the run ended; the exit code for it."""
    if as_json:
        screen.emit(result.document())
    else:
        screen.result("\n".join(run_text.describe(result)))
    if not result.is_interrupted:
        return EXIT_DONE if result.is_wanted else EXIT_NO
    advise_resuming(result.plan, result.folder, TERMINAL)
    screen.note("or send the shape again: that plans from where the display stands")
    return EXIT_INTERRUPTED

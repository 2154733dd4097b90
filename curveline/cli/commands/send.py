"""`curveline send`: take the nodes of a display through a plan, or into a shape from where they stand."""

from __future__ import annotations

import os
from collections.abc import Sequence
from contextlib import closing
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, NoReturn

import typer

from curveline.cli import consent
from curveline.cli.goal import Tour, home_of, plan_goal, read_goal
from curveline.cli.printing import node_table, screen
from curveline.cli.printing.node_table import RadioOption, RunsOption
from curveline.errors import EXIT_DONE, EXIT_INTERRUPTED, EXIT_NO, InvalidInput, LinkError

if TYPE_CHECKING:
    from curveline.cli.run import RunResult
    from curveline.driving.interrupted import InterruptedRun
    from curveline.plan_file import DriveSettings, Plan
    from curveline.radio.host.node_status import NodeStatus
    from curveline.radio.interface import Radio


def send(
    what: Annotated[
        list[str] | None,
        typer.Argument(metavar="PLAN|SHAPE...", help="Plan (.json), or shapes (.toml) to plan and send in a row."),
    ] = None,
    home: Annotated[
        bool,
        typer.Option(
            "--home", help="Bring the display home, after the shapes if any: level, upright, the rod straight."
        ),
    ] = False,
    display: Annotated[
        str | None,
        typer.Option(
            "--display",
            metavar="NAME|FILE",
            help="The display to bring home, single if not given; or whose last run is meant.",
        ),
    ] = None,
    resume: Annotated[
        str | None,
        typer.Option(
            "--resume", metavar="RUN", help="Go on with a run: its folder, its name, or `last`, the newest that can."
        ),
    ] = None,
    touched: Annotated[
        bool, typer.Option("--touched", help="Somebody touched the rod: which curve it is in is not known.")
    ] = False,
    radio: RadioOption = None,
    yes: Annotated[bool, typer.Option("--yes", "-y", help="Do not ask before moving.")] = False,
    takeover: Annotated[
        bool, typer.Option("--takeover", help="Take nodes over from another host, if all stand still.")
    ] = False,
    dry_run: Annotated[
        bool, typer.Option("--dry-run", help="Print what would be sent, decoded; nothing moves.")
    ] = False,
    json: Annotated[bool, typer.Option("--json", help="JSON on stdout, one document.")] = False,
    runs: RunsOption = None,
) -> None:
    """Take a display through a plan, to a shape or several in a row, or home, or go on with a run that was broken off.

    Shapes are planned from where the display stands and what it shows. Ctrl-C pauses once all nodes have done their
    step; again, it holds at once; again, it is an emergency stop.
    """
    folder = node_table.runs_folder(runs)
    wanted = _wanted(_SendRequest(tuple(what or ()), resume, display, home), folder)
    if touched and not isinstance(wanted, Tour):
        raise InvalidInput(
            "--touched is for shapes and for --home: this plan is made already", "send the shape instead"
        )
    if dry_run:
        from curveline.cli.dry_run import rehearse

        rehearse(wanted, radio, folder, touched=touched, as_json=json)
        return
    way = _SendingMeans(node_table.require_radio(radio), folder, asks=not yes, takeover=takeover, touched=touched)
    if way.asks:
        consent.require_terminal("sending moves the display, and ", "add --yes to agree")
    ending = _send(wanted, way)
    if ending is None:
        raise typer.Exit(EXIT_NO)
    _conclude(ending, way.spec, as_json=json)


def _conclude(ending: RunResult, spec: str, *, as_json: bool) -> NoReturn:
    """Say how the run ended, and leave with the exit code for it."""
    if as_json:
        screen.emit(ending.document(spec))
    else:
        screen.result("\n".join(ending.lines()))
    if ending.is_interrupted:
        from curveline.cli.run import advise_resuming

        advise_resuming(ending.plan, ending.folder)
        screen.note("or send the shape again: that plans from where the display stands")
        raise typer.Exit(EXIT_INTERRUPTED)
    raise typer.Exit(EXIT_DONE if ending.is_wanted else EXIT_NO)


@dataclass(frozen=True)
class _SendRequest:
    """What was named on the command line."""

    files: tuple[str, ...]
    resume: str | None
    display: str | None
    home: bool


@dataclass(frozen=True)
class _SendingMeans:
    """How to send: through which radio, with the records where, and what the operator allows."""

    spec: str
    runs: Path
    asks: bool
    takeover: bool
    touched: bool


def _wanted(asked: _SendRequest, runs: Path) -> Plan | Tour | InterruptedRun:
    """What is to be sent; InvalidInput unless it is one thing, and can be read."""
    if bool(asked.files or asked.home) is (asked.resume is not None):
        raise InvalidInput("name a plan, shapes, --home, or a run to --resume, and only one of them")
    from curveline.driving.runs import LAST

    if asked.display is not None and (asked.files or not (asked.home or asked.resume == LAST)):
        hint = "a plan, a shape or a run names its own display"
        raise InvalidInput("--display is for --home alone and for --resume last", hint)
    if asked.resume is not None:
        return _broken_off(asked.resume, asked.display, runs)
    return _read(asked.files, ends_home=asked.home) if asked.files else home_of(asked.display or "single")


def _read(paths: Sequence[str], *, ends_home: bool) -> Plan | Tour:
    """The plan in a file, or the shapes in some; the suffix says which."""
    suffixes = {path: os.path.splitext(path)[1].lower() for path in paths}
    for path, suffix in suffixes.items():
        if suffix not in (".json", ".toml"):
            raise InvalidInput(f"{path}: neither a plan (.json) nor a shape (.toml)", "the suffix says what a file is")
        if suffix == ".json" and (len(paths) > 1 or ends_home):
            hint = "`curveline plan SHAPE...` makes one plan of several shapes, `curveline send --home` goes home"
            raise InvalidInput(f"{path}: a plan is sent by itself", hint)
    if ".json" in suffixes.values():
        from curveline.plan_file import read_plan

        return read_plan(paths[0])
    return read_goal(paths, ends_home=ends_home)


def _broken_off(name: str, display: str | None, runs: Path) -> InterruptedRun:
    """The run that is to go on."""
    from curveline.driving.interrupted import find_interrupted_run
    from curveline.driving.runs import LAST, unfinished

    if name != LAST:
        return find_interrupted_run(name, runs)
    newest = unfinished(runs, _display_name(display))
    for each in newest.broken:
        screen.note(f"passed over: {each.name} {each.ended}")
    run = newest.run
    screen.note(f"the newest that can go on: {run.name} of display {run.display}, which {run.ended}")
    if newest.since:
        screen.note(f"sent to that display since, after which its nodes may refuse: {newest.since[0].name}")
    return find_interrupted_run(run.folder.name, run.folder.parent)


def _display_name(display: str | None) -> str:
    from curveline.shapes.files import read_display

    return read_display(display).name if display is not None else ""


def _send(wanted: Plan | Tour | InterruptedRun, way: _SendingMeans) -> RunResult | None:
    """Plan from where the display stands, ask, and send; None if the answer was no."""
    from curveline.cli.printing.plan_text import summary
    from curveline.cli.run import Place, conduct, go_on
    from curveline.driving.interrupted import InterruptedRun
    from curveline.driving.readiness import check_ready
    from curveline.plan_file import drive_settings
    from curveline.radio.host.actions import Policy
    from curveline.radio.host.link import Control
    from curveline.radio.host.preflight import check_targets
    from curveline.radio.interface import open_radio

    control = Control(Policy(takeover=way.takeover), tell=screen.note)
    place = Place(way.spec, way.runs)
    if isinstance(wanted, InterruptedRun):
        with wanted.opened() as journal, closing(open_radio(way.spec, wanted.plan.drive, way.runs)) as radio:
            screen.note(wanted.summary())
            if not wanted.point.released:
                _check_granted(wanted.plan, radio, _statuses(wanted.plan, radio), way)
            return go_on(wanted, radio, journal, control, place) if _agrees(way) else None
    drive = drive_settings(wanted.display) if isinstance(wanted, Tour) else wanted.drive
    with closing(open_radio(way.spec, drive, way.runs)) as radio:
        if isinstance(wanted, Tour):
            plan = _plan_from_here(wanted, radio, drive, way)
        else:
            plan = wanted
            check_ready(plan, statuses := _statuses(plan, radio))
            _check_granted(plan, radio, statuses, way)
        check_targets(plan)
        screen.note(f"{plan.name}: {summary(plan)}")
        return conduct(plan, radio, control, place) if _agrees(way) else None


def _statuses(plan: Plan, radio: Radio) -> list[NodeStatus]:
    """What the nodes of a plan say now."""
    from curveline.radio.host.link import read_status
    from curveline.radio.host.stop_causes import named_display

    return read_status(radio, plan.drive, named_display(plan))


def _check_granted(plan: Plan, radio: Radio, statuses: list[NodeStatus], way: _SendingMeans) -> None:
    """Say what is known of the states that a plan begins in; Infeasible if the display shows others."""
    from curveline.cli.known_states import check_granted

    if known := check_granted(plan, radio, statuses, way.runs):
        screen.note(known)


def _agrees(way: _SendingMeans) -> bool:
    """Ask before anything moves."""
    agreed = not way.asks or consent.agrees("Move the display?")
    if not agreed:
        screen.note("nothing was sent")
    return agreed


def _plan_from_here(goal: Tour, radio: Radio, drive: DriveSettings, way: _SendingMeans) -> Plan:
    """A plan from where the nodes say that they stand; LinkError if one of them cannot say."""
    from curveline.cli.known_states import Shown, shown_states
    from curveline.driving.readiness import check_movable
    from curveline.radio.host.link import read_status
    from curveline.radio.host.stop_causes import display_option

    named = goal.display.path or goal.display.name
    statuses = read_status(radio, drive, named)
    check_movable(statuses)
    counts = []
    for status in statuses:
        if status.counts is None:
            hint = f"see `curveline status{display_option(named)}`"
            raise LinkError(f"node {status.node} does not answer", hint, status.node)
        counts.append(status.counts)
    shown = Shown() if way.touched else shown_states(radio, drive, statuses, way.runs)
    if shown.states or any(any(each) for each in counts):
        screen.note(shown.line())
    return plan_goal(goal, tuple(counts), shown.states)

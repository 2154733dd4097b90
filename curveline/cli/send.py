"""`curveline send`: take the nodes of a display through a plan, or into a shape from where they stand."""

from __future__ import annotations

import os
import sys
from contextlib import closing
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from curveline.cli import nodes, show
from curveline.cli.nodes import RadioOption, RunsOption
from curveline.errors import EXIT_DONE, EXIT_INTERRUPTED, EXIT_NO, InvalidInput, LinkError

if TYPE_CHECKING:
    from curveline.cli.broken import BrokenRun
    from curveline.cli.run import Ending
    from curveline.plan import DriveTable, Plan
    from curveline.radio import Radio
    from curveline.radio.frames import Counts
    from curveline.scene import Scene

NOWHERE = ("boot", "unhomed", "homing", "position-lost")
"""States of a node in which its position means nothing."""


def send(
    what: Annotated[
        str | None, typer.Argument(metavar="PLAN|SHAPE", help="Plan (.json), or shape (.toml) to plan and send.")
    ] = None,
    resume: Annotated[
        str | None,
        typer.Option("--resume", metavar="RUN", help="Go on with a run: its folder, its name, or `last`."),
    ] = None,
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
    """Take a display through a plan, or to a shape, or go on with a run that was broken off.

    A shape is planned from where the display stands. Ctrl-C pauses once all nodes have done their step; again, it holds
    at once; again, it is an emergency stop.
    """
    folder = nodes.runs_folder(runs)
    if (what is None) is (resume is None):
        raise InvalidInput("name a plan, a shape, or a run to --resume, and only one of them")
    wanted = _broken_off(resume, folder) if resume is not None else _read(str(what))
    if dry_run:
        from curveline.cli.rehearsal import rehearse

        rehearse(wanted, radio, folder, as_json=json)
        return
    spec = nodes.require_radio(radio)
    if not yes and not (sys.stdin.isatty() and sys.stderr.isatty()):
        raise InvalidInput("sending moves the display, and there is no terminal to ask on", hint="add --yes to agree")
    ending = _send(wanted, _Way(spec, folder, asks=not yes, takeover=takeover))
    if ending is None:
        raise typer.Exit(EXIT_NO)
    if json:
        show.emit(ending.document(spec))
    else:
        show.result("\n".join(ending.lines()))
    if ending.is_interrupted:
        from curveline.cli.run import advise_resuming

        advise_resuming(ending.plan, ending.folder)
        show.note("or send the shape again: that plans from where the display stands")
        raise typer.Exit(EXIT_INTERRUPTED)
    raise typer.Exit(EXIT_DONE if ending.is_wanted else EXIT_NO)


@dataclass(frozen=True)
class _Way:
    """How to send: through which radio, with the records where, and what the operator allows."""

    spec: str
    runs: Path
    asks: bool
    takeover: bool


def _read(path: str) -> Plan | Scene:
    """The plan or the shape in a file; its suffix says which."""
    suffix = os.path.splitext(path)[1].lower()
    if suffix == ".json":
        from curveline.plan import read_plan

        return read_plan(path)
    if suffix == ".toml":
        from curveline.shapefile import read_shape

        return read_shape(path)
    raise InvalidInput(f"{path}: neither a plan (.json) nor a shape (.toml)", hint="the suffix says what a file is")


def _broken_off(name: str, runs: Path) -> BrokenRun:
    """The run that is to go on."""
    from curveline.cli.broken import find_broken_run

    return find_broken_run(name, runs)


def _send(wanted: Plan | Scene | BrokenRun, way: _Way) -> Ending | None:
    """Plan from where the display stands, ask, and send; None if the answer was no."""
    from curveline.cli.broken import BrokenRun
    from curveline.cli.run import conduct, go_on
    from curveline.cli.steps import summary
    from curveline.plan import Plan, drive_table
    from curveline.radio import open_radio
    from curveline.radio.actions import Policy
    from curveline.radio.link import Control

    control = Control(Policy(takeover=way.takeover), tell=show.note)
    if isinstance(wanted, BrokenRun):
        with wanted.opened() as journal, closing(open_radio(way.spec, wanted.plan.drive, way.runs)) as radio:
            show.note(wanted.summary())
            return go_on(wanted, radio, journal, control) if _agrees(way) else None
    drive = wanted.drive if isinstance(wanted, Plan) else drive_table(wanted.display)
    with closing(open_radio(way.spec, drive, way.runs)) as radio:
        plan = wanted if isinstance(wanted, Plan) else _plan_from_here(wanted, radio, drive)
        show.note(f"{plan.name}: {summary(plan)}")
        return conduct(plan, radio, way.runs, control) if _agrees(way) else None


def _agrees(way: _Way) -> bool:
    """Ask before anything moves; an interrupt is one here, too, and no mere no."""
    try:
        agreed = not way.asks or typer.confirm("Move the display?", err=True)
    except typer.Abort:
        raise KeyboardInterrupt from None
    if not agreed:
        show.note("nothing was sent")
    return agreed


def _plan_from_here(scene: Scene, radio: Radio, drive: DriveTable) -> Plan:
    """A plan to `scene` from where the nodes say that they stand; LinkError if one of them cannot say."""
    from curveline.radio.link import read_status

    counts = []
    for status in read_status(radio, drive):
        if status.counts is None or status.state in NOWHERE:
            said = "does not answer" if status.counts is None else f"does not know where it stands: {status.state}"
            hint = "see `curveline status`" if status.counts is None else "home the node, then send again"
            raise LinkError(f"node {status.node} {said}", hint, status.node)
        counts.append(status.counts)
    return plan_shape(scene, tuple(counts))


def plan_shape(scene: Scene, start: tuple[Counts, ...] | None) -> Plan:
    """A plan to `scene` from encoder counts, or from home."""
    from curveline.planning import make_plan

    show.announce_compilation()
    return make_plan(scene, start)

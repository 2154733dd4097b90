"""What somebody wishes to be sent: a plan, shapes in a row, home, or a run that was broken off."""

from __future__ import annotations

import os
from collections.abc import Sequence
from pathlib import Path

from curveline.driving.interrupted import InterruptedRun, find_interrupted_run
from curveline.driving.runs import LAST, unfinished
from curveline.driving.tours import Tour, home_of, tour_of
from curveline.errors import InvalidInput
from curveline.listening import SILENT, Listener
from curveline.plan_file import Plan
from curveline.scene import Scene
from curveline.shapes.inputs import read_input

Wish = Plan | Tour | InterruptedRun


BY_ITSELF = "`curveline plan SHAPE...` makes one plan of several shapes, `curveline send --home` goes home"


def wish_of(what: Sequence[object], *, home: bool = False, display: str = "single") -> Plan | Tour:
    """A plan, or a tour of shapes: files, which say by what is in them what they are, scenes, or one plan.

    With nothing but `home` it is the way home of `display`. Raises InvalidInput unless it is one thing, and sound.
    """
    if not what:
        if not home:
            raise InvalidInput("there is nothing to send", "name a plan, or shapes, or home")
        return home_of(display)
    given = [_read(each) for each in what]
    for each in given:
        if isinstance(each, Plan) and (len(given) > 1 or home):
            raise InvalidInput(f"{each.name}: a plan is taken by itself", BY_ITSELF)
    first = given[0]
    return (
        first
        if isinstance(first, Plan)
        else tour_of([each for each in given if isinstance(each, Scene)], ends_home=home)
    )


def _read(each: object) -> Plan | Scene:
    """A plan or a scene, read if it is in a file."""
    if isinstance(each, Plan | Scene):
        return each
    if not isinstance(each, str | os.PathLike):
        raise InvalidInput(
            f"neither a plan nor a shape: {type(each).__name__}", "name a file, or pass a plan or scenes"
        )
    return read_input(each)


def run_to_resume(name: str, display: str, runs: Path, listener: Listener = SILENT) -> InterruptedRun:
    """The run that is to go on: by its folder or name, or `last`, the newest that can, of a display or of any."""
    return find_interrupted_run(named_to_resume(name, display, runs, listener), runs)


def named_to_resume(name: str, display: str, runs: Path, listener: Listener = SILENT) -> str:
    """As `run_to_resume`, the name or folder of the run, which may be one of several lines."""
    if name != LAST:
        return name
    newest = unfinished(runs, display)
    for each in newest.broken:
        listener.note(f"passed over: {each.name} {each.ended}")
    run = newest.run
    listener.note(f"the newest that can go on: {run.name} of {run.of}, which {run.ended}")
    if newest.since:
        listener.note(f"sent to that display since, after which its nodes may refuse: {newest.since[0].name}")
    return os.path.abspath(run.folder)

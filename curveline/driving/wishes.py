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
from curveline.plan_file import Plan, read_plan
from curveline.scene import Scene

Wish = Plan | Tour | InterruptedRun


def wish_of(what: Sequence[object], *, home: bool = False, display: str = "single") -> Plan | Tour:
    """A plan, or a tour of shapes: paths of files, whose suffix says what they are, scenes, or one plan.

    With nothing but `home` it is the way home of `display`. Raises InvalidInput unless it is one thing, and sound.
    """
    if not what:
        if not home:
            raise InvalidInput("there is nothing to send", "name a plan, or shapes, or home")
        return home_of(display)
    plans = [each for each in what if _is_plan(each)]
    if plans and (len(what) > 1 or home):
        name = plans[0].name if isinstance(plans[0], Plan) else plans[0]
        hint = "`curveline plan SHAPE...` makes one plan of several shapes, `curveline send --home` goes home"
        raise InvalidInput(f"{name}: a plan is sent by itself", hint)
    if plans:
        return plans[0] if isinstance(plans[0], Plan) else read_plan(str(plans[0]))
    return tour_of([_scene(each) for each in what], ends_home=home)


def _is_plan(each: object) -> bool:
    """Whether something is a plan, or the path of one; InvalidInput if it is no path of a shape either."""
    if isinstance(each, Plan | Scene):
        return isinstance(each, Plan)
    if not isinstance(each, str | os.PathLike):
        raise InvalidInput(
            f"neither a plan nor a shape: {type(each).__name__}", "name a file, or pass a plan or scenes"
        )
    suffix = Path(each).suffix.lower()
    if suffix not in (".json", ".toml"):
        raise InvalidInput(f"{each}: neither a plan (.json) nor a shape (.toml)", "the suffix says what a file is")
    return suffix == ".json"


def _scene(each: object) -> Scene:
    if isinstance(each, Scene):
        return each
    from curveline.shapes.files import read_shape

    return read_shape(str(each))


def run_to_resume(name: str, display: str, runs: Path, listener: Listener = SILENT) -> InterruptedRun:
    """The run that is to go on: by its folder or name, or `last`, the newest that can, of a display or of any."""
    if name != LAST:
        return find_interrupted_run(name, runs)
    newest = unfinished(runs, display)
    for each in newest.broken:
        listener.note(f"passed over: {each.name} {each.ended}")
    run = newest.run
    listener.note(f"the newest that can go on: {run.name} of display {run.display}, which {run.ended}")
    if newest.since:
        listener.note(f"sent to that display since, after which its nodes may refuse: {newest.since[0].name}")
    return find_interrupted_run(run.folder.name, run.folder.parent)

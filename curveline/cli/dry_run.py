"""A dry run: the real encoder and decoder, and nothing that moves, locks or remembers."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

from curveline import __version__
from curveline.cli.goal import Tour, plan_goal
from curveline.cli.known_states import Shown, remembered_states
from curveline.cli.printing import screen
from curveline.cli.printing.plan_text import describe
from curveline.driving.interrupted import InterruptedRun
from curveline.plan_file import Plan, drive_settings
from curveline.radio.host.frame_listing import FrameRecord, describe_plan_frames
from curveline.radio.host.preflight import check_targets
from curveline.radio.mock.spec import parse_spec
from curveline.radio.mock.store import Store

HEAD = ("step", "action", "node", "address", "release", "extrude", "bias", "translate", "ms")


def rehearse(
    wanted: Plan | Tour | InterruptedRun, spec: str | None, runs: Path, *, touched: bool = False, as_json: bool = False
) -> None:
    """Print what a send would stage, decoded as the nodes would decode it; InvalidInput if no node would take it."""
    begin = 0
    if isinstance(wanted, Tour):
        plan = _planned(wanted, spec, runs, touched=touched)
    elif isinstance(wanted, InterruptedRun):
        plan, begin = wanted.plan, wanted.point.barrier
        screen.note(wanted.summary())
    else:
        plan = wanted
    check_targets(plan)
    frames = [frame for frame in describe_plan_frames(plan) if frame.step > begin]
    if as_json:
        screen.emit(_document(plan, frames))
    else:
        screen.result("\n".join([*describe(plan), *_lines(frames)]))
    screen.note("dry run: nothing was sent")


def _planned(goal: Tour, spec: str | None, runs: Path, *, touched: bool) -> Plan:
    """A plan from where the mock display stands, read without opening it; from home for any radio, left alone here."""
    drive = drive_settings(goal.display)
    name, _, settings = (spec or "").partition(":")
    if name != "mock" or parse_spec(settings).fresh:
        screen.note("planned from home")
        return plan_goal(goal, None)
    state = Store(runs, drive).load()
    shown = Shown() if touched else remembered_states(state.known_rod)
    screen.note(f"planned from where the mock display stands; {shown.line()}")
    return plan_goal(goal, tuple(node.counts for node in state.nodes), shown.states)


def _lines(frames: Sequence[FrameRecord]) -> list[str]:
    rows = [
        (
            str(each.step),
            each.action,
            str(each.node),
            each.address,
            str(each.release),
            *map(str, each.target),
            str(each.move_ms),
        )
        for each in frames
    ]
    return [
        "frames that stage each step, decoded",
        *screen.table([HEAD, *rows], frozenset({1, 3})),
    ]


def _document(plan: Plan, frames: Sequence[FrameRecord]) -> dict[str, Any]:
    return {
        "curveline": __version__,
        "plan": plan.name,
        "display": plan.drive.display,
        "shows": plan.shows,
        "seconds": plan.seconds,
        "frames": [
            {
                "step": each.step,
                "action": each.action,
                "node": each.node,
                "address": each.address,
                "release": each.release,
                "target_counts": list(each.target),
                "move_ms": each.move_ms,
                "payload": each.payload.hex(),
            }
            for each in frames
        ],
    }

"""A dry run: the real encoder and decoder, and nothing that moves, locks or remembers."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

from curveline import __version__
from curveline.cli import show
from curveline.cli.broken import BrokenRun
from curveline.cli.send import plan_shape
from curveline.cli.steps import describe
from curveline.plan import DriveTable, Plan, drive_table
from curveline.radio.frames import Counts
from curveline.radio.link import FrameRecord, describe_plan_frames
from curveline.radio.mockspec import parse_spec
from curveline.radio.store import Store
from curveline.scene import Scene

HEAD = ("step", "action", "node", "address", "release", "extrude", "bias", "translate", "ms")


def rehearse(wanted: Plan | Scene | BrokenRun, spec: str | None, runs: Path, *, as_json: bool) -> None:
    """Print what a send would stage, decoded as the nodes would decode it."""
    if isinstance(wanted, Scene):
        start = _remembered(spec, drive_table(wanted.display), runs)
        show.note(f"planned from {'home' if start is None else 'where the mock display stands'}")
        plan, begin = plan_shape(wanted, start), 0
    elif isinstance(wanted, BrokenRun):
        plan, begin = wanted.plan, wanted.point.barrier
        show.note(wanted.summary())
    else:
        plan, begin = wanted, 0
    frames = [frame for frame in describe_plan_frames(plan) if frame.step > begin]
    if as_json:
        show.emit(_document(plan, frames))
    else:
        show.result("\n".join([*describe(plan), *_lines(frames)]))
    show.note("dry run: nothing was sent")


def _remembered(spec: str | None, drive: DriveTable, runs: Path) -> tuple[Counts, ...] | None:
    """Where the mock display stands, read without opening it; None for any other radio, which is left alone."""
    name, _, settings = (spec or "").partition(":")
    if name != "mock" or parse_spec(settings).fresh:
        return None
    return tuple(node.counts for node in Store(runs, drive).load().nodes)


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
        *show.table([HEAD, *rows], frozenset({1, 3})),
    ]


def _document(plan: Plan, frames: Sequence[FrameRecord]) -> dict[str, Any]:
    return {
        "curveline": __version__,
        "plan": plan.name,
        "display": plan.drive.display,
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

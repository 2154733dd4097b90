"""A dry run: the real encoder and decoder, and nothing that moves, locks or remembers."""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from curveline._version import __version__
from curveline.drive_settings import AXES, drive_settings
from curveline.driving.interrupted import InterruptedRun
from curveline.driving.known_states import Shown, remembered_states
from curveline.driving.rod_plans import check_for_rod, with_rod_now
from curveline.driving.rod_record import RodRecord, is_fresh
from curveline.driving.tours import Tour, Whereabouts, plan_tour
from curveline.driving.wishes import Wish
from curveline.listening import SILENT, Listener
from curveline.notebook import html_of
from curveline.plan_file import Plan
from curveline.radio.host.frame_listing import FrameRecord, describe_plan_frames
from curveline.radio.host.preflight import check_targets
from curveline.radio.mock.board import KeyRing
from curveline.radio.mock.spec import parse_spec
from curveline.radio.mock.store import Store
from curveline.radio.protocol.keys import ZERO_MASTER


@dataclass(frozen=True)
class DryRun:
    """A plan and the frames that would stage its steps, as the nodes would decode them."""

    plan: Plan  # what would be sent
    frames: Sequence[FrameRecord]  # in order

    def _repr_html_(self) -> str:
        rows = [
            (each.step, each.action, each.node, *each.target, each.move_ms, each.payload.hex()) for each in self.frames
        ]
        head = ("step", "action", "node", *(f"{axis} counts" for axis in AXES), "ms", "payload")
        return html_of(f"{self.plan.name}: {len(rows)} frames that would stage it", [head, *rows])

    def document(self) -> dict[str, Any]:
        """The same as plain data."""
        plan = self.plan
        return {
            "curveline": __version__,
            "plan": plan.name,
            "display": plan.drive.display,
            "shows": plan.shows,
            "seconds": plan.seconds,
            "frames": [_frame_document(each) for each in self.frames],
        }


def _frame_document(frame: FrameRecord) -> dict[str, Any]:
    return {
        "step": frame.step,
        "action": frame.action,
        "node": frame.node,
        "address": frame.address,
        "release": frame.release,
        "target_counts": list(frame.target),
        "move_ms": frame.move_ms,
        "payload": frame.payload.hex(),
    }


@dataclass(frozen=True)
class DrySite:
    """Where a send would go: the radio as it is named, None if it is not, the folder of runs, who hears of it.

    `touched` takes for granted that somebody touched the rod.
    """

    spec: str | None
    runs: Path
    touched: bool = False
    listener: Listener = SILENT


def dry_run_of(wish: Wish, site: DrySite) -> DryRun:
    """What sending would stage; InvalidInput if no node would take it, and as planning."""
    begin = 0
    if isinstance(wish, Tour):
        plan = _planned(wish, site)
    elif isinstance(wish, InterruptedRun):
        plan, begin = wish.plan, wish.point.barrier
        site.listener.note(wish.summary())
    else:
        plan = wish
        if site.spec is not None:
            check_for_rod(plan, RodRecord(site.spec, site.runs, is_kept=False), site.listener)
    check_targets(plan)
    return DryRun(plan, [frame for frame in describe_plan_frames(plan) if frame.step > begin])


def _planned(tour: Tour, site: DrySite) -> Plan:
    """A plan from where the mock display stands, read without opening it; from home for any radio, left alone here.

    Its rod is as the runs on record left it.
    """
    name, _, settings = (site.spec or "").partition(":")
    if site.spec is not None:
        since = time.time() if is_fresh(site.spec) else 0.0
        tour = with_rod_now(tour, RodRecord(site.spec, site.runs, since, is_kept=False), site.listener)
    if name != "mock" or parse_spec(settings).fresh:
        site.listener.note("planned from home")
        return plan_tour(tour, Whereabouts(), site.listener)
    state = Store(site.runs, drive_settings(tour.display)).load(KeyRing(ZERO_MASTER))
    shown = Shown() if site.touched else remembered_states(state.known_rod)
    site.listener.note(f"planned from where the mock display stands; {shown.line()}")
    return plan_tour(tour, Whereabouts(tuple(node.counts for node in state.nodes), shown.states), site.listener)

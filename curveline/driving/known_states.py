"""Which curves a display shows before a plan begins: what a mock display remembers, or what the nodes' last run led to.

A run is believed because all nodes say that it is the last one they moved in, that all of them have finished the same
step of it, and stand where that step ends. What another host, a restart or a person with a motor switch does to them
ends that; only a hand on the rod itself goes unnoticed.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass
from itertools import zip_longest
from pathlib import Path
from typing import Any

from curveline.drive_settings import DriveSettings
from curveline.driving.interrupted import PLAN_NAME
from curveline.driving.last_look import seen_last
from curveline.driving.modelled import known_rod
from curveline.driving.tours import granted
from curveline.errors import Infeasible, InvalidInput
from curveline.phrases import in_words
from curveline.plan_file import MAX_BYTES, NodeTarget, Plan, from_json
from curveline.radio.host.journal import FILE_NAME, read_journal
from curveline.radio.host.line_records import parts_of, run_of
from curveline.radio.host.node_status import NodeStatus
from curveline.radio.host.preflight import START_TOLERANCE, run_tag
from curveline.radio.host.queries import was_last_run
from curveline.radio.host.run_folder import run_names
from curveline.radio.interface import Radio
from curveline.scene import UNNAMED
from curveline.system.files import read_file

RUNS_SEEN = 50
BYTES_READ = MAX_BYTES
RUNS_ASKED = 4
"""How many runs, the newest first, are looked at and, if the nodes stand where they led, asked about."""


@dataclass(frozen=True)
class Shown:
    """The state of every segment, "" where it is not known, and how it is known; no states if nothing is."""

    states: tuple[str, ...] = ()
    source: str = ""

    def line(self) -> str:
        """What a plan takes for granted, as text."""
        if not any(self.states):
            return "which curve the display shows is not known"
        return f"the display shows: {in_words([name or 'not known' for name in self.states])} ({self.source})"


def shown_states(radio: Radio, drive: DriveSettings, nodes: Sequence[NodeStatus], runs: Path) -> Shown:
    """What the display shows where its nodes stand now; LinkError if the radio fails."""
    remembered = remembered_states(known_rod(radio) or ())
    return remembered if remembered.states else _last_run(radio, drive, nodes, runs)


def remembered_states(rod: Sequence[str]) -> Shown:
    """What a mock display remembers of its rod."""
    return Shown(tuple("" if name in UNNAMED else name for name in rod), "the mock display remembers")


def check_granted(plan: Plan, radio: Radio, nodes: Sequence[NodeStatus], runs: Path) -> str:
    """What is known of the states that a plan takes for granted, as text; Infeasible if the display shows others.

    Nodes that stand elsewhere than where the plan starts are the business of its preflight.
    """
    if not any(plan.shows) or not _stand_at(plan.start, nodes):
        return ""
    shown = shown_states(radio, plan.drive, nodes, runs)
    is_known = True
    for segment, (wanted, state) in enumerate(zip_longest(plan.shows, shown.states, fillvalue=""), start=1):
        if wanted and state and wanted != state:
            message = f"segment {segment} shows {state}, but the plan takes {wanted} for granted ({shown.source})"
            raise Infeasible(message, "send the shape: that is planned from what the display shows; or plan again")
        is_known = is_known and bool(state or not wanted)
    if is_known:
        return shown.line()
    return f"the plan takes for granted what is not known: the display shows {granted(plan)}"


def _last_run(radio: Radio, drive: DriveSettings, nodes: Sequence[NodeStatus], runs: Path) -> Shown:
    """What the run on record led to that all nodes name as their last."""
    asked: set[int] = set()
    done = {count for node in nodes for count in (node.started, node.finished)}
    step = done.pop()
    if done or not step:
        return Shown()
    for name, plan in _plans(runs, drive):
        if (
            len(plan.steps) < step
            or not _stand_at(plan.steps[step - 1].targets, nodes)
            or (tag := run_tag(plan)) in asked
        ):
            continue
        if was_last_run(radio, drive, tag):
            return _after_run(runs, name, plan, step)
        asked.add(tag)
        if len(asked) == RUNS_ASKED:
            break
    return Shown()


def _after_run(runs: Path, name: str, plan: Plan, step: int) -> Shown:
    """What the display shows after a run: what a camera saw then, or else what the plan proves."""
    records: list[Mapping[str, Any]] = []
    with suppress(InvalidInput):
        records = read_journal(runs / name / FILE_NAME)
    seen = seen_last(records, plan.drive.node_count - 1)
    if seen is None or step < len(plan.steps):
        return Shown(states_after(plan, step), f"run {name}")
    return Shown(tuple("" if each in UNNAMED else each for each in seen), f"a picture after run {name}")


def _plans(runs: Path, drive: DriveSettings) -> Iterator[tuple[str, Plan]]:
    """Names and plans of this display's runs, the newest first; what is no run, or is damaged, is passed over."""
    left = BYTES_READ
    for part in (part for name in run_names(runs)[:RUNS_SEEN] for part in parts_of(runs / name)):
        path = part / PLAN_NAME
        try:
            data = read_file(path, MAX_BYTES)
            left -= len(data)
            if left < 0:
                return
            # Most runs are of other plans: what does not even name the display's file is not worth decoding.
            if drive.digest.encode() in data:
                plan = from_json(data.decode("utf-8"), str(path))
                if plan.drive == drive:
                    yield run_of(part).name, plan
        except (InvalidInput, UnicodeDecodeError):
            continue


def _stand_at(places: Sequence[NodeTarget], nodes: Sequence[NodeStatus]) -> bool:
    """Whether every node stands where it is to be."""
    return all(
        node.counts is not None
        and max(abs(a - b) for a, b in zip(node.counts, place.counts, strict=True)) <= START_TOLERANCE
        for node, place in zip(nodes, places, strict=True)
    )


def states_after(plan: Plan, step: int) -> tuple[str, ...]:
    """The states that the plan proves after a step; "" where it leaves several possible."""
    if step == len(plan.steps):
        return plan.wanted
    return tuple("" if "|" in name or name == "none" else name for name in plan.steps[step - 1].states)

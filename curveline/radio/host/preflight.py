"""Checks before anything moves: the plan against the limits, and every node against the plan."""

from __future__ import annotations

import json
from collections.abc import Sequence
from hashlib import blake2s

from curveline.drive_settings import AXES
from curveline.errors import InvalidInput
from curveline.plan_file import Plan
from curveline.radio.host.actions import Record
from curveline.radio.host.peer import STRANGE, Peer
from curveline.radio.host.stop_causes import Cause, Halt, fault_halt
from curveline.radio.protocol.codes import MOVE_MS_LIMIT, VERSION, Counts, Fault, NodeState
from curveline.radio.protocol.frames import IdentFrame, ReportFrame, StatusFrame
from curveline.radio.protocol.motion import axes_of, outside
from curveline.units import beyond, told_apart

START_TOLERANCE = 32
"""How far [counts] a node may stand from the start of a plan: a servo rests within 22, and STATUS rounds to 8."""

NOWHERE = frozenset({NodeState.BOOT, NodeState.UNHOMED, NodeState.HOMING, NodeState.POSITION_LOST})
"""States in which a node does not know where it is."""


def move_ms(seconds: float) -> int:
    """A step's time as a DRIVE frame carries it: a lower bound, so what exceeds the field is cut to it."""
    return min(MOVE_MS_LIMIT, max(0, round(seconds * 1000.0)))


def loads_of(plan: Plan) -> tuple[tuple[tuple[int, Counts, int], ...], ...]:
    """For every step and node (number of the step, target counts, move time [ms])."""
    return tuple(
        tuple((number, target.counts, move_ms(step.seconds)) for target in step.targets)
        for number, step in enumerate(plan.steps, start=1)
    )


def run_tag(plan: Plan) -> int:
    """64 bits that stand for what a plan makes the nodes do, and for the curves that it says the rod is in then."""
    states = [plan.wanted, [step.states for step in plan.steps]]
    content = [plan.drive.digest, [target.counts for target in plan.start], loads_of(plan), states]
    return int.from_bytes(blake2s(json.dumps(content).encode(), digest_size=8).digest(), "little")


def check_targets(plan: Plan) -> None:
    """Refuse a plan that leaves the limits or whose steps are not for all nodes, before the radio speaks."""
    axes, count = axes_of(plan.drive), plan.drive.node_count
    if len(plan.start) != count or any(len(step.targets) != count for step in plan.steps):
        raise InvalidInput(f"the plan does not give every one of the {count} nodes a start and a target in each step")
    for number, step in enumerate(plan.steps, start=1):
        for node, target in enumerate(step.targets, start=1):
            if axis := outside(axes, target.counts):
                raise _beyond(plan, number, node, axis)


def _beyond(plan: Plan, number: int, node: int, axis: int) -> InvalidInput:
    """A step takes an axis (from 1) of a node to where the display, or what a node can tell of itself, ends."""
    drive = plan.drive.axes[axis - 1]
    counts, ends = plan.steps[number - 1].targets[node - 1].counts[axis - 1], axes_of(plan.drive)[axis - 1]
    hint = "make the plan again for this display"
    if drive.counts(drive.low) <= counts <= drive.counts(drive.high):
        hint = "further out a node cannot tell where it is: ask for less rod, or share it between more nodes"
    there, low, high = beyond(drive.value(counts), drive.value(ends.low), drive.value(ends.high))
    place = f"{AXES[axis - 1]} {there}, allowed {low} to {high}"
    return InvalidInput(f"step {number} takes node {node} out of its limits: {place}", hint)


def check_ident(ident: IdentFrame, peer: Peer, config: int) -> Halt | None:
    """Whether a node, which has proven by its key which device it is, has the right firmware and settings."""
    if ident.version != VERSION:
        return Halt(Cause.VERSION, peer.number, detail=f"it has {ident.version}, this release needs {VERSION}")
    if ident.state is NodeState.BOOT:
        return Halt(Cause.IN_LOADER, peer.number)
    if ident.config_hash != config:
        detail = f"fingerprint {ident.config_hash:04x} instead of {config:04x}"
        return Halt(Cause.CONFIG, peer.number, detail=detail)
    return Halt(Cause.TRIAL, peer.number) if ident.on_trial else None


def check_start(plan: Plan, peers: Sequence[Peer]) -> Halt | None:
    """Whether every node is fit to move and stands where the plan starts; call it once all have a status."""
    for peer in peers:
        assert peer.status is not None
        if (halt := check_fit(peer.status, 0)) is not None:
            return halt
        if (halt := check_place(plan, peer.number, peer.status.position)) is not None:
            return halt
    return None


def check_place(plan: Plan, node: int, counts: Counts) -> Halt | None:
    """Whether a node that is at `counts` stands where the plan starts."""
    for axis, (wanted, found) in enumerate(zip(plan.start[node - 1].counts, counts, strict=True)):
        if abs(found - wanted) > START_TOLERANCE:
            drive = plan.drive.axes[axis]
            here, there = told_apart(drive.value(found), drive.value(wanted), 2, "f")
            detail = f"{AXES[axis]} {here} instead of {there}"
            return Halt(Cause.ELSEWHERE, node, detail=detail)
    return None


def check_fit(status: StatusFrame | ReportFrame, step: int) -> Halt | None:
    """Why the node that says this cannot move; None if it can. `step` is the one to name, 0 for none."""
    if status.state is NodeState.ESTOP:
        return Halt(Cause.LATCHED, status.node, step)
    if status.fault is not Fault.NONE:
        return fault_halt(status.fault, status.fault_axis, status.node, step)
    if status.state is NodeState.BOOT:
        return Halt(Cause.IN_LOADER, status.node, step)
    if status.state in NOWHERE:
        return Halt(Cause.NOT_HOMED, status.node, step)
    return None


def why_missing(missing: Sequence[Peer], count: int) -> Halt:
    """The best explanation of why some of `count` nodes could not be taken over, for the first of them."""
    peer = missing[0]
    busy = [each.number for each in missing if each.busy or each.status is not None]
    if busy:
        others = ", ".join(map(str, busy[1:]))
        return Halt(Cause.BUSY, busy[0], detail=f"; so does node {others}" if others else "")
    if len(missing) == count and not any(each.tally.answered for each in missing):
        return Halt(Cause.DEAF)
    if not peer.tally.answered:
        return Halt(Cause.SILENT, peer.number)
    return Halt(Cause.UNTRUSTED if peer.ident is None else Cause.TAKEN, peer.number)


def why_silent(peer: Peer, now_ms: int, step: int, *, are_all: bool) -> Halt:
    """The halt for a node that is not heard any more, if it is the only one, or for all that there are."""
    detail = f" any more, for {(now_ms - peer.heard_ms) / 1000:.1f} s"
    return Halt(Cause.DEAF, step=step, detail=detail) if are_all else Halt(Cause.SILENT, peer.number, step, detail)


def why_late(plan: Plan, step: int, peer: Peer) -> Halt:
    """The halt for a node that is not done in time: it still has a way to go, or it obeys somebody else by now."""
    if peer.strange > STRANGE:
        return Halt(Cause.TAKEN, peer.number, step)
    return Halt(Cause.DEADLINE, peer.number, step, _what_is_left(plan, step, peer))


def _what_is_left(plan: Plan, step: int, peer: Peer) -> str:
    """Which axis of a late node is how far from its target."""
    if peer.status is None or peer.started < step:
        return "it has not set off"
    goal = plan.steps[step - 1].targets[peer.number - 1].counts
    gaps = (want - found for want, found in zip(goal, peer.status.position, strict=True))
    left = [drive.value(gap) for drive, gap in zip(plan.drive.axes, gaps, strict=True)]
    far = max(range(len(AXES)), key=lambda axis: abs(left[axis]))
    return f"its {AXES[far]} has {abs(left[far]):.1f} {'deg' if AXES[far] == 'bias' else 'mm'} to go"


def check_running(peer: Peer, step: int, released: int) -> Halt | None:
    """Whether a node's newest status is one that a run in `step` allows."""
    status = peer.status
    assert status is not None
    halt = check_fit(status, step)
    if peer.started > released:
        return Halt(Cause.AHEAD, peer.number, step, str(peer.started))
    if halt is None and status.state is NodeState.HOLD_LINK:
        return Halt(Cause.HELD, peer.number, step)
    if halt is None and status.state is NodeState.HOLD and not status.hold_low & 1:
        return Halt(Cause.STOPPED, peer.number, step)
    return halt


def start_record(plan: Plan, peers: Sequence[Peer], tag: int) -> Record:
    """The first record of a run: all that a resume needs to know of plan and nodes."""
    return {
        "type": "start",
        "run": f"{tag:016x}",
        "plan": plan.name,
        "display": plan.drive.display,
        "digest": plan.drive.digest,
        "start": [target.counts for target in plan.start],
        "steps": loads_of(plan),
        "sessions": [peer.session for peer in peers],
        **node_facts(peers),
    }


def halt_record(halt: Halt, peers: Sequence[Peer]) -> Record:
    """Why a run has ended before its end."""
    record = {"type": "halt", "cause": halt.cause.name.lower(), "node": halt.node, "step": halt.step}
    return {**record, "message": halt.message, **node_facts(peers)}


def node_facts(peers: Sequence[Peer]) -> Record:
    """What every record says of the nodes: boot numbers, steps started and finished, positions."""
    return {
        "boots": [peer.boot for peer in peers],
        "started": [peer.started for peer in peers],
        "finished": [peer.finished for peer in peers],
        "positions": [peer.status.position if peer.status else None for peer in peers],
    }


def journal_bytes(plan: Plan) -> int:
    """An upper bound on the size of a run's records: one for the start, two per step, and how it ended."""
    steps, nodes = len(plan.steps), plan.drive.node_count
    per_node = 48
    return 4096 + (steps + 4) * nodes * per_node + (steps + 4) * (512 + 2 * nodes * per_node)

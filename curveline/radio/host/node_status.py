"""What a node says, in words: of a run or of a query, with what keeps it from moving and what to do about it."""

from __future__ import annotations

from dataclasses import dataclass, field, replace

from curveline.drive_settings import AXES
from curveline.radio.host.peer import LinkTally, Peer
from curveline.radio.host.preflight import check_fit
from curveline.radio.host.stop_causes import Cause, Halt
from curveline.radio.protocol.codes import NOT_HOMED, Counts, Fault, NodeState, plain_name
from curveline.radio.protocol.frames import ReportFrame, StatusFrame

SILENT = "silent"


@dataclass(frozen=True)
class NodeStatus:
    """What one node says; `state` is "silent" and the rest unknown (zeros, None) if it did not answer.

    `boot_cause`, `unhomed` (axis: why it is not homed) and `fault_seconds` (since when) are not asked for in a run.
    `obstacle` is why it cannot move, `advice` what to do about it; empty if it can, or did not answer.
    """

    node: int  # number from 1
    address: str  # 5 bytes, hexadecimal
    state: str
    boot: int = 0
    started: int = 0  # last step that it began
    finished: int = 0  # last step that it has done
    staged: int = 0  # last step that it knows
    fault: str = ""
    counts: Counts | None = None  # encoder counts from home, extrude, bias, translate; None if silent or in its loader
    boot_cause: str = ""
    unhomed: dict[str, str] = field(default_factory=dict)
    fault_seconds: int | None = None
    link: LinkTally = field(default_factory=LinkTally)  # polls and losses
    obstacle: str = ""
    advice: str = ""

    @property
    def can_move(self) -> bool:
        """Whether the node has answered, and would obey a run."""
        return self.counts is not None and not self.obstacle


def status_of_report(report: ReportFrame, address: str, display: str) -> NodeStatus:
    """What a node said to a query, in words; advice names the display as `display`."""
    halt = _unfound(report) or check_fit(report, 0)
    if report.on_trial:
        halt = Halt(Cause.TRIAL, report.node)
    return replace(
        _node_status(report, report.boot, address, LinkTally()),
        obstacle="" if halt is None else halt.message,
        advice="" if halt is None else replace(halt, display=display).hint,
        boot_cause=plain_name(report.cause),
        unhomed={axis: _reason(code) for axis, code in zip(AXES, report.axes, strict=True) if code},
        fault_seconds=report.fault_s if report.fault is not Fault.NONE else None,
    )


def _unfound(report: ReportFrame) -> Halt | None:
    """Why axes are not homed although their zeros were sought; None if that is not what keeps the node from moving."""
    tried = {axis: code for axis, code in zip(AXES, report.axes, strict=True) if code not in (0, NOT_HOMED)}
    if report.state is not NodeState.UNHOMED or not tried:
        return None
    reasons = ", ".join(f"{axis} ({_reason(code)})" for axis, code in tried.items())
    return Halt(Cause.UNFOUND, report.node, detail=reasons)


def status_of_peer(peer: Peer) -> NodeStatus:
    """What a node said last in a run, in words."""
    assert peer.status is not None  # a run that did not end in an error has heard of every node
    return _node_status(peer.status, peer.boot, peer.address, replace(peer.tally))


def _node_status(status: StatusFrame | ReportFrame, boot: int, address: str, link: LinkTally) -> NodeStatus:
    fault = "" if status.fault is Fault.NONE else plain_name(status.fault)
    if status.fault_axis:
        fault += f" ({AXES[status.fault_axis - 1]})"
    halt = check_fit(status, 0)
    return NodeStatus(
        node=status.node,
        address=address,
        state=plain_name(status.state),
        boot=boot,
        started=status.started,
        finished=status.finished,
        staged=status.staged,
        fault=fault,
        counts=None if status.state is NodeState.BOOT else status.position,
        link=link,
        obstacle="" if halt is None else halt.message,
        advice="" if halt is None else halt.hint,
    )


def _reason(code: int) -> str:
    return "not homed" if code == NOT_HOMED else plain_name(Fault(code))

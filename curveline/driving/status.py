"""How the nodes of a display are: asked over the radio, or told by the process of this computer that sends to them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from typing import Any

from curveline._version import __version__
from curveline.drive_settings import DriveSettings
from curveline.driving.live import Sender
from curveline.notebook import html_of
from curveline.radio.host.node_status import SILENT, NodeStatus

Document = dict[str, Any]
POSITION_KEYS = ("extrude_mm", "bias_deg", "translate_mm")


@dataclass(frozen=True)
class DisplayStatus:
    """What the nodes of a display said, and the states of the rod where somebody knows them.

    `sender` is the process that told it, None where the nodes themselves did.
    """

    spec: str  # of the radio
    drive: DriveSettings  # the display as nodes see it
    nodes: Sequence[NodeStatus]  # left to right
    rod: Sequence[str] | None = None  # state of each segment, None if nobody knows
    sender: Sender | None = None

    @property
    def is_well(self) -> bool:
        """True if every node answered and can move."""
        return all(each.can_move for each in self.nodes)

    def _repr_html_(self) -> str:
        title = f"display {self.drive.display} over {self.spec}"
        return html_of(title, node_rows(self.nodes, self.drive))

    def document(self) -> Document:
        """The status as plain data."""
        return {
            "curveline": __version__,
            "display": self.drive.display,
            "radio": self.spec,
            "nodes": [node_document(each, self.drive) for each in self.nodes],
            "rod": None if self.rod is None else list(self.rod),
            "sender": None if self.sender is None else _sender_document(self.sender),
        }


def node_rows(nodes: Sequence[NodeStatus], drive: DriveSettings) -> list[tuple[object, ...]]:
    """A table of nodes: a head, and a row each."""
    silent = ("-",) * len(POSITION_KEYS)
    rows = [
        (each.node, each.state, each.finished, *(position(each, drive).values() or silent), each.fault or "")
        for each in nodes
    ]
    return [("node", "state", "step", "feed mm", "angle deg", "height mm", "fault"), *rows]


def _sender_document(sender: Sender) -> Document:
    live = sender.live
    facts = {key: getattr(live, key) for key in ("process", "plan", "phase", "step", "steps", "seconds")}
    return {**facts, "run": str(sender.run), "age_s": round(live.age, 3)}


def node_document(status: NodeStatus, drive: DriveSettings) -> Document:
    """A node's status as plain data; what a silent node did not say is null."""
    record = asdict(status)
    record["fault"] = status.fault or None
    record["obstacle"] = status.obstacle or None
    record["advice"] = status.advice or None
    record["boot_cause"] = status.boot_cause or None
    record["unhomed"] = status.unhomed if status.boot_cause else None
    record["position"] = position(status, drive) or None
    if status.counts is None:
        record.update(dict.fromkeys(("started", "finished", "staged", "fault")))
    if status.state == SILENT:
        record["boot"] = None
    return record


def position(status: NodeStatus, drive: DriveSettings) -> Mapping[str, float]:
    """Where a node stands, in mm and degrees, in the order of its axes; nothing if it does not say."""
    if status.counts is None:
        return {}
    values = [axis.value(count) for axis, count in zip(drive.axes, status.counts, strict=True)]
    return dict(zip(POSITION_KEYS, values, strict=True))

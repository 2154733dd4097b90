"""Stopping a display whoever drives it: through the process of this computer that sends to it, or else by radio.

A sender is asked by a file in the folder of its run, for which it looks several times a second, and answers by what it
publishes.
"""

from __future__ import annotations

import os
import time
from collections.abc import Callable
from contextlib import closing
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

from curveline.drive_settings import DriveSettings
from curveline.driving.live import LAST_NAME, LIVE_NAME, STOP_PREFIX, Live, Sender, read_live, sender_of
from curveline.errors import LinkError
from curveline.notebook import html_of
from curveline.radio.host.actions import Phase
from curveline.radio.host.journal import is_open
from curveline.radio.host.stopping import Stopped, stop_all
from curveline.radio.interface import InUse, open_radio
from curveline.radio.protocol.codes import NodeState
from curveline.radio.site.key_file import lenient

REACT_S = 3.0
"""A sender that is alive reacts within a fraction of this."""
HOLD_S = 15.0
"""Longer than any brake, and than a node that does not answer is waited for."""
FREE_S = 10.0
"""How long a sender that has ended, or is only about to begin, is waited for."""
POLL_S = 0.05
STANDING = frozenset(
    {NodeState.HOLD, NodeState.HOLD_LINK, NodeState.FAULT, NodeState.POSITION_LOST, NodeState.UNHOMED, NodeState.ESTOP}
)
"""States of a node whose run is paused, in all of which it stands."""
END_IT = "end that program, whose nodes then hold by themselves within 7 s, or switch off the power of the motors"


@dataclass(frozen=True)
class Halting:
    """What is known of every node, and the sender that confirmed it, None if it was the nodes themselves."""

    nodes: list[Stopped]  # left to right
    sender: Sender | None = None  # None if the nodes themselves confirmed it

    @property
    def is_sure(self) -> bool:
        """True if every node stands for certain."""
        return all(each.is_sure for each in self.nodes)

    def _repr_html_(self) -> str:
        rows = [(each.node, each.state_name or "silent", each.is_sure) for each in self.nodes]
        title = "every node stands" if self.is_sure else "not every node is known to stand"
        return html_of(title, [("node", "state", "stands for certain"), *rows])

    def document(self) -> dict[str, Any]:
        """The same as plain data."""
        found = [{**asdict(each), "state": each.state_name, "is_sure": each.is_sure} for each in self.nodes]
        sender = self.sender
        by = None if sender is None else {"process": sender.live.process, "run": str(sender.run)}
        return {"nodes": found, "sender": by}


def stop_display(spec: str, drive: DriveSettings, runs: Path) -> Halting:
    """Bring every node of a display to a hold; LinkError if the radio fails, or a sender that has it does not react."""
    end = time.monotonic() + FREE_S
    while True:
        sender = sender_of(drive, spec, runs)
        if sender is not None and (stopped := _ask(sender)) is not None:
            return Halting(stopped, sender)
        try:
            with lenient(), closing(open_radio(spec, drive, runs)) as radio:
                return Halting(stop_all(radio, drive))
        except InUse as error:
            if time.monotonic() > end and sender_of(drive, spec, runs) is None:
                raise InUse(error.message, f"{error.hint}; if that cannot wait, {END_IT}") from None
            time.sleep(POLL_S)


def _ask(sender: Sender) -> list[Stopped] | None:
    """What the sender confirms of its nodes; None if it has ended without that, so that they are to be asked."""
    _place_request(sender)
    if not _wait(sender, REACT_S, lambda live: bool(live.stop)):
        raise LinkError(
            f"{sender.name}, does not react",
            f"press Ctrl-C there twice, or end process {sender.live.process}: its nodes then hold by themselves within "
            "5 s; then stop again. If that cannot wait, switch off the power of the motors",
        )
    if not _wait(sender, HOLD_S, _all_stand):
        raise LinkError(
            f"{sender.name}, was told to hold, but not all of its nodes have confirmed that they do",
            "see `curveline status`; switch off the power of the motors if a node still moves",
        )
    live = _told(sender)
    return [_stopped(node, live) for node in range(len(live.nodes))] if live is not None and _all_stand(live) else None


def _place_request(sender: Sender) -> None:
    path = sender.run / f"{STOP_PREFIX}{sender.live.token}"
    try:
        path.write_text(f"`curveline stop` in process {os.getpid()}", encoding="utf-8")
    except OSError as error:
        hint = "press Ctrl-C twice in its terminal, or switch off the power of the motors"
        raise LinkError(f"{sender.name}, cannot be reached: {path}: {error.strerror or error}", hint) from error


def _wait(sender: Sender, seconds: float, is_met: Callable[[Live], bool]) -> bool:
    """Wait until what the sender publishes meets a condition, or it has ended; False if neither happens in time."""
    end = time.monotonic() + seconds
    while time.monotonic() < end:
        live = _told(sender)
        if (live is not None and is_met(live)) or _has_ended(sender):
            return True
        time.sleep(POLL_S)
    return False


def _has_ended(sender: Sender) -> bool:
    live = read_live(sender.run / LIVE_NAME)
    is_another = live is not None and live.token != sender.live.token
    return is_another or not (sender.run / LIVE_NAME).exists() or not is_open(sender.run)


def _told(sender: Sender) -> Live | None:
    """What this sender has published last, also if it has ended meanwhile."""
    for name in (LIVE_NAME, LAST_NAME):
        live = read_live(sender.run / name)
        if live is not None and live.token == sender.live.token:
            return live
    return None


def _all_stand(live: Live) -> bool:
    """Whether the run is paused, which it is once all nodes have confirmed the hold."""
    return live.phase == Phase.PAUSED.value and all(_stopped(node, live).is_sure for node in range(len(live.nodes)))


def _stopped(index: int, live: Live) -> Stopped:
    node = live.nodes[index]
    state = NodeState.__members__.get(node.state.upper().replace("-", "_"))
    return Stopped(node.node, node.address, state, node.link, state in STANDING)

"""What a running send publishes in the folder of its run, for other processes on this computer.

`live.json` is there while a run is being sent, and counts only while the record of the run is locked: who was killed
leaves the file, but not the lock. When the run ends it becomes `last.json`. A file `stop-TOKEN`, with the token that
the sender has published, asks it to hold at once; see `driving.halting`.
"""

from __future__ import annotations

import json
import math
import os
import re
import secrets
import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from dataclasses import asdict, dataclass, field, fields
from pathlib import Path
from typing import Any

from curveline.drive_settings import AXES, DriveSettings
from curveline.errors import InvalidInput
from curveline.plan_file import Plan
from curveline.radio.host.actions import Phase
from curveline.radio.host.journal import is_open
from curveline.radio.host.line_records import parts_of
from curveline.radio.host.link import Control, OperatorRequest, Progress, RunReport
from curveline.radio.host.node_status import SILENT, NodeStatus
from curveline.radio.host.peer import LinkTally
from curveline.radio.host.run_folder import folder_names
from curveline.radio.protocol.codes import TARGET_LIMIT, NodeState, plain_name
from curveline.system.files import printable, read_file
from curveline.system.json_records import Decoder
from curveline.system.portable import replace, replace_at_once

FORMAT = 1
LIVE_NAME = "live.json"
LAST_NAME = "last.json"
STOP_PREFIX = "stop-"
TOKEN = re.compile(r"[0-9a-f]{16}")
SIZE_LIMIT = 1_000_000
LOOK_S = 0.05
"""How often a sender looks for a request to stop."""
PUBLISH_S = 0.5
"""Every file that replaces another costs a small computer a write to its memory card."""
SILENT_S = 1.0
"""A node that has not been heard for so long is published as silent."""
STATES = frozenset({SILENT, *(plain_name(state) for state in NodeState)})
BEGINNING = frozenset({Phase.DISCOVER.value, Phase.PREFLIGHT.value})
PHASES = frozenset(phase.value for phase in Phase)


@dataclass(frozen=True)
class LiveNode:
    """A `NodeStatus` as it is published: no counts where they are not known."""

    node: int
    address: str
    state: str
    boot: int
    started: int
    finished: int
    staged: int
    fault: str
    obstacle: str
    advice: str
    counts: tuple[int, ...]
    link: LinkTally

    @property
    def status(self) -> NodeStatus:
        """The status that was published."""
        x, y, z = self.counts or (0, 0, 0)
        facts = (self.boot, self.started, self.finished, self.staged, self.fault, (x, y, z) if self.counts else None)
        plain = (self.node, self.address, self.state, *facts)
        return NodeStatus(*plain, link=self.link, obstacle=self.obstacle, advice=self.advice)


@dataclass(frozen=True)
class Live:
    """What a sender says of itself and its nodes; `at` [s] is the time of day, `stop` who asked it to hold, if any."""

    format: int
    token: str
    process: int
    plan: str
    display: str
    digest: str
    radio: str
    at: float
    seconds: float
    phase: str
    step: int
    steps: int
    nodes: tuple[LiveNode, ...]
    stop: str = ""

    @property
    def age(self) -> float:
        """How long ago it was published [s]; 0 if the clock has been set back since."""
        return max(0.0, time.time() - self.at)

    @property
    def statuses(self) -> list[NodeStatus]:
        """What every node said last."""
        return [node.status for node in self.nodes]


@dataclass(frozen=True)
class Sender:
    """A process that is sending a run now."""

    run: Path
    live: Live

    @property
    def name(self) -> str:
        """Who it is, as text."""
        return f"process {self.live.process}, which sends {self.live.plan} to display {self.live.display}"


def senders(runs: Path) -> Iterator[Sender]:
    """Who is sending runs of this folder now; what cannot be believed is passed over."""
    for folder in (part for name in folder_names(runs, LIVE_NAME) for part in parts_of(runs / name)):
        if os.path.lexists(folder / LIVE_NAME) and is_open(folder) and (live := read_live(folder / LIVE_NAME)):
            yield Sender(folder, live)


def sender_of(drive: DriveSettings, spec: str, runs: Path) -> Sender | None:
    """Who is sending to this display over this radio now."""
    return next(
        (each for each in senders(runs) if _is_of(each.live, drive) and same_radio(each.live.radio, spec)), None
    )


def news_of(drive: DriveSettings, spec: str, runs: Path) -> Sender | None:
    """As `sender_of`; one that has just begun is given time to hear of all its nodes."""
    end = time.monotonic() + SILENT_S
    while (sender := sender_of(drive, spec, runs)) is not None and sender.live.phase in BEGINNING:
        if time.monotonic() > end or all(node.counts for node in sender.live.nodes):
            break
        time.sleep(LOOK_S)
    return sender


def same_radio(one: str, other: str) -> bool:
    """Whether two radio specs mean the same device; all mocks of a display and a runs folder are one."""
    (name, _, settings), (other_name, _, other_settings) = one.partition(":"), other.partition(":")
    if name == other_name == "nrf24":  # how fast its bus runs does not make it another one
        settings, other_settings = (",".join(each.split(",")[:2]) for each in (settings, other_settings))
    same_port = os.path.realpath(settings.strip()) == os.path.realpath(other_settings.strip())
    return name == other_name and (name == "mock" or same_port)


def _is_of(live: Live, drive: DriveSettings) -> bool:
    addresses = tuple(node.address for node in live.nodes)
    return (live.display, live.digest, addresses) == (drive.display, drive.digest, drive.addresses)


def read_live(path: Path) -> Live | None:
    """What a sender has published; None if there is nothing, or nothing that can be believed."""
    decoder = Decoder()
    try:
        document = json.loads(read_file(path, SIZE_LIMIT))
        live: Live = decoder.decode(Live, document, "")
    except (InvalidInput, ValueError, RecursionError):
        return None
    return live if not decoder.problems and _is_sound(live) else None


def _is_sound(live: Live) -> bool:
    numbers = (live.process, live.step, live.steps, live.at, live.seconds)
    whole = [number for node in live.nodes for number in (node.boot, node.started, node.finished, node.staged)]
    links = [number for node in live.nodes for number in asdict(node.link).values()]
    return (
        live.format == FORMAT
        and TOKEN.fullmatch(live.token) is not None
        and live.phase in PHASES
        and [node.node for node in live.nodes] == list(range(1, len(live.nodes) + 1))
        and all(node.state in STATES and len(node.counts) in (0, len(AXES)) for node in live.nodes)
        and all((node.state == SILENT) is not bool(node.counts) for node in live.nodes)
        and all(abs(count) <= TARGET_LIMIT for node in live.nodes for count in node.counts)
        and all(0 <= number < 2**53 for number in (*numbers, *whole, *links))
    )


@contextmanager
def published(run: Path, plan: Plan, spec: str, control: Control) -> Iterator[Publisher]:
    """Publish what a send of `plan` through the radio `spec` tells, and let `control` hear requests to stop."""
    forget(run)
    publisher = Publisher(run, plan, spec, control)
    control.attend(publisher.look)
    try:
        yield publisher
    finally:
        control.attend(_nobody)
        publisher.close()


def forget(run: Path) -> None:
    """Remove what an earlier sender of this run left; call it only while the run's record is locked."""
    for path in [run / LIVE_NAME, *run.glob(f"{STOP_PREFIX}*")]:
        with suppress(OSError):
            path.unlink()


def _nobody() -> None:
    pass


@dataclass
class Publisher:
    """Observes a send and publishes it; a disk that refuses costs the news, never the run."""

    run: Path
    plan: Plan
    spec: str
    control: Control
    token: str = field(default_factory=lambda: secrets.token_hex(8))
    _phase: str = Phase.DISCOVER.value
    _step: int = 1
    _seconds: float = 0.0
    _stop: str = ""
    _nodes: dict[int, tuple[float, NodeStatus]] = field(default_factory=dict)
    _looked: float = -math.inf
    _wrote: float = -math.inf

    def __call__(self, news: Progress) -> None:
        """News of a node; a new phase is published as soon as it may be."""
        if (self._phase, self._step) != (news.phase.value, news.step) or news.status.node not in self._nodes:
            self._wrote = -math.inf
        self._phase, self._step, self._seconds = news.phase.value, news.step, news.seconds
        self._nodes[news.status.node] = (time.monotonic(), news.status)

    def look(self) -> None:
        """Look for a request, and publish, if it is time to; to be called often."""
        now = time.monotonic()
        if now - self._looked < LOOK_S:
            return
        self._looked = now
        if not self._stop and (asked := self._asked_by()):
            self._stop = asked
            self.control.ask(OperatorRequest.HOLD, asked)
            self._write(now)
        elif now - self._wrote >= PUBLISH_S:
            self._write(now)

    def end(self, report: RunReport | None) -> None:
        """Publish how the run has ended; None if it was halted."""
        if report is None:
            self._phase = Phase.HALTED.value
        else:
            self._phase, self._seconds = report.outcome, report.seconds
            self._nodes = {status.node: (math.inf, status) for status in report.nodes}
        self._write(time.monotonic())

    def close(self) -> None:
        """Nobody sends any more; what was published last is kept under another name."""
        with suppress(OSError):
            replace(self.run / LIVE_NAME, self.run / LAST_NAME)
        forget(self.run)

    def _asked_by(self) -> str:
        """Who asks for a stop, "" if nobody does; the request counts, whatever is written in it."""
        path = self.run / f"{STOP_PREFIX}{self.token}"
        if not os.path.lexists(path):
            return ""
        try:
            who = printable(read_file(path, 100).decode(errors="replace")).strip()
        except InvalidInput:
            who = ""
        return who or "another process"

    def _write(self, now: float) -> None:
        self._wrote = now
        partial = self.run / "live.part"
        with suppress(OSError):
            partial.write_text(json.dumps(self._document(now)) + "\n", encoding="utf-8")
            replace_at_once(partial, self.run / LIVE_NAME)

    def _document(self, now: float) -> dict[str, Any]:
        nodes = [self._node(number, now) for number in range(1, self.plan.drive.node_count + 1)]
        drive = self.plan.drive
        head = {"format": FORMAT, "token": self.token, "process": os.getpid(), "plan": printable(self.plan.name)}
        where = {"display": drive.display, "digest": drive.digest, "radio": printable(self.spec), "at": time.time()}
        far = {"seconds": self._seconds, "phase": self._phase, "step": self._step, "steps": len(self.plan.steps)}
        return {**head, **where, **far, "nodes": nodes, "stop": self._stop}

    def _node(self, number: int, now: float) -> dict[str, Any]:
        heard, status = self._nodes.get(number, (-math.inf, None))
        if status is None or now - heard > SILENT_S:
            link = status.link if status is not None else LinkTally()
            status = NodeStatus(number, self.plan.drive.addresses[number - 1], SILENT, link=link)
        told = {**asdict(status), "counts": status.counts or ()}
        return {each.name: told[each.name] for each in fields(LiveNode)}

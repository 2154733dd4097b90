"""What a radio sends and hears, told to whoever listens on this computer, as it passes.

A listener puts a small file into the folder `listeners` of the runs folder: a port of the loopback address, and a
secret that proves that what arrives there comes from who has read the file. The process with the radio looks for such
files four times a second, and sends a datagram per frame to each. It never waits: what the system does not take at once
is lost, and counted. If nobody listens, it costs that look. The disk is not written, and a listener that has died is
forgotten once its file is 3 s old.
"""

from __future__ import annotations

import json
import os
import re
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import suppress
from itertools import islice
from pathlib import Path
from typing import Any, NamedTuple, Protocol

from curveline.drive_settings import DriveSettings
from curveline.errors import InvalidInput
from curveline.radio.protocol.keys import Site
from curveline.radio.tag_witness import UNKNOWN, TagWitness
from curveline.system.files import read_file

LISTENERS = "listeners"
"""Folder, in that of the runs, of the files of those who listen."""
FORMAT = 1
LOOK_S = 0.25
STALE_S = 3.0
"""A listener touches its file every second."""
MOST_LISTENERS = 4
MOST_FILES = 32
TOKEN = re.compile(r"[0-9a-f]{32}")
HOST = "127.0.0.1"
FILE_LIMIT = 200

Exchanged = Sequence[tuple[str, bytes]]


class Answered(Protocol):
    """What came back for a frame; see interface.Answer."""

    @property
    def payload(self) -> bytes | None:
        """The payload."""
        ...

    @property
    def retries(self) -> int:
        """How often the packet was repeated."""
        ...


Tap = Callable[[Exchanged, Sequence[Answered]], None]


def untapped(frames: Exchanged, answers: Sequence[Answered]) -> None:
    """The tap of a radio that nobody can listen to."""


class FrameListener(NamedTuple):
    """Who listens: a port of this computer, and what each datagram begins with."""

    port: int
    token: str


class TappedNode(NamedTuple):
    """A node by its address: of which display, and its number there."""

    display: str
    number: int


class FrameTap:
    """The tap of one radio, for the displays that it reaches."""

    def __init__(
        self, spec: str, shown: Sequence[tuple[DriveSettings, Site]], runs: Path, now_us: Callable[[], int]
    ) -> None:
        """`shown` are the displays and their keys, `runs` is the runs folder, `now_us` the radio's clock."""
        self._spec = spec
        self._folder = runs / LISTENERS
        self._nodes: dict[str, TappedNode] = {}
        keys = {}
        for drive, site in shown:
            for number, address in enumerate(drive.addresses, start=1):
                self._nodes[address.upper()] = TappedNode(drive.display, number)
                keys[address.upper()] = site.node_key(number)
        self._witness = TagWitness(keys, now_us)
        self._listeners: list[FrameListener] = []
        self._look_at = 0.0
        self._count = 0

    def __call__(self, frames: Exchanged, answers: Sequence[Answered]) -> None:
        """An exchange is over; nothing that goes wrong here is anybody's concern."""
        for (address, sent), answer in zip(frames, answers, strict=True):
            self._witness.see(address.upper(), sent, answer.payload)
        now = time.monotonic()
        if now >= self._look_at:
            self._look_at = now + LOOK_S
            self._listeners = list(listeners(self._folder))
        if self._listeners and frames:
            with suppress(OSError):
                self._tell([self._news(*each) for each in zip(frames, answers, strict=True)])

    def _tell(self, news: Sequence[bytes]) -> None:
        import socket

        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as way:
            way.setblocking(False)
            for each in news:
                for listener in self._listeners:
                    with suppress(OSError):
                        way.sendto(listener.token.encode() + each, (HOST, listener.port))

    def _news(self, frame: tuple[str, bytes], answer: Answered) -> bytes:
        address, sent = frame
        node = self._nodes.get(address.upper(), TappedNode("", 0))
        self._count += 1
        document: dict[str, Any] = {
            "tap": id(self) & 0xFFFFFFFF,
            "count": self._count,
            "process": os.getpid(),
            "at": time.time(),
            "radio": self._spec[:200],
            "display": node.display[:200],
            "node": node.number,
            "address": address.upper(),
            "sent": sent.hex(),
            "answer": None if answer.payload is None else answer.payload.hex(),
            "retries": answer.retries,
            "trust": self._witness.judge(address.upper(), answer.payload) if answer.payload else UNKNOWN,
        }
        return json.dumps(document).encode()


def listeners(folder: Path) -> Iterator[FrameListener]:
    """Who listens now, by the files in a folder; what cannot be believed is passed over."""
    try:
        names = sorted(os.listdir(folder))[:MOST_FILES]
    except (OSError, ValueError):
        return
    yield from islice(filter(None, (_listener(folder / name) for name in names)), MOST_LISTENERS)


def _listener(path: Path) -> FrameListener | None:
    with suppress(OSError, InvalidInput, ValueError, RecursionError):
        if not path.name.endswith(".json") or abs(time.time() - path.stat().st_mtime) > STALE_S:
            return None
        document = json.loads(read_file(path, FILE_LIMIT))
        if not isinstance(document, dict) or document.get("format") != FORMAT:
            return None
        port, token = document.get("port"), document.get("token")
        if type(port) is int and 1024 <= port <= 65535 and isinstance(token, str) and TOKEN.fullmatch(token):
            return FrameListener(port, token)
    return None

"""Listening to what commands of this computer send and hear: frames, as they pass, whoever drives the display.

What arrives may come from anybody who has found the port: only what begins with the secret is looked at, and only what
is whole and possible is believed. Nobody waits for a listener; see `radio.frame_tap`.
"""

from __future__ import annotations

import json
import os
import re
import secrets
import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass, field
from hmac import compare_digest
from pathlib import Path
from typing import TYPE_CHECKING, Any

from curveline._version import __version__
from curveline.driving.live import same_radio
from curveline.errors import InvalidInput
from curveline.radio.frame_tap import FORMAT, HOST, LISTENERS, STALE_S
from curveline.radio.host.journal import runs_folder
from curveline.radio.protocol.air_time import RETRIES
from curveline.radio.protocol.codes import EVERY_NODE, FRAME_BYTES, FrameKind, plain_name
from curveline.radio.protocol.frame_fields import fields_of, kind_name
from curveline.radio.tag_witness import GOOD, UNKNOWN, WRONG
from curveline.system.files import AnyPath, printable
from curveline.system.json_records import Decoder

if TYPE_CHECKING:
    from socket import socket

TOUCH_S = 1.0
WAIT_S = 0.2
DATAGRAM = 4096
BUFFER = 1 << 20
"""What the system may keep for a listener that is slower than a run [bytes]."""
LONGEST = 200
KINDS = tuple(plain_name(kind) for kind in FrameKind)
"""What frames are called."""


@dataclass(frozen=True)
class FrameNews:
    """A frame and what came back for it, as the process with the radio tells it."""

    tap: int  # which radio of the process
    count: int  # of the frames that it told
    process: int  # its number
    at: float  # time of day [s since 1970]
    radio: str  # spec
    display: str  # by name, "" if the address is none of its nodes'
    node: int  # from 1, 0 if it is none
    address: str  # ten hexadecimal digits
    sent: str  # the frame, hexadecimal
    answer: str | None  # what came back, hexadecimal; None if nothing did
    retries: int  # repeats of the packet
    trust: str  # good, wrong or unknown: the tag of the answer


@dataclass(frozen=True)
class HeardFrame:
    """A frame that a command sent, and what came back for it."""

    news: FrameNews  # as it was told
    missed: int = 0  # frames of the same radio that came before it and were not told in time

    @property
    def sent(self) -> bytes:
        """The frame."""
        return bytes.fromhex(self.news.sent)

    @property
    def answer(self) -> bytes | None:
        """What came back: empty if the node had no answer loaded, None if nothing did."""
        return None if self.news.answer is None else bytes.fromhex(self.news.answer)

    @property
    def kinds(self) -> tuple[str, ...]:
        """What the frame and its answer are."""
        return (kind_name(self.sent), *([kind_name(self.answer)] if self.answer else []))

    def document(self) -> dict[str, Any]:
        """The same as plain data."""
        news = self.news
        whose = {"curveline": __version__, "at": news.at, "process": news.process, "radio": news.radio}
        where = {"display": news.display, "node": news.node, "address": news.address}
        back = {"answered": self.answer is not None, "retries": news.retries, "missed": self.missed}
        answer = None if not self.answer else {**_frame(self.answer, from_host=False), "tag": news.trust}
        return {**whose, **where, **back, "sent": _frame(self.sent, from_host=True), "answer": answer}


@dataclass(frozen=True)
class FrameWish:
    """Which frames are wanted; what is empty leaves all."""

    nodes: tuple[int, ...] = ()  # numbers, from 1
    kinds: tuple[str, ...] = ()  # such as "drive"; an exchange counts if the frame or its answer is of one
    display: str = ""  # its name
    radio: str = ""  # spec

    def __post_init__(self) -> None:
        if unknown := [each for each in self.kinds if each not in KINDS]:
            raise InvalidInput(f"there is no frame {printable(unknown[0])[:40]!r}", f"there are {', '.join(KINDS)}")

    def takes(self, heard: HeardFrame) -> bool:
        """Whether a frame is wanted."""
        news = heard.news
        return (
            (not self.nodes or news.node in self.nodes)
            and (not self.kinds or bool(set(self.kinds) & set(heard.kinds)))
            and self.display in ("", news.display)
            and (not self.radio or same_radio(self.radio, news.radio))
        )


@dataclass
class _Gaps:
    """What was not told in time, by radio."""

    last: dict[tuple[int, int], int] = field(default_factory=dict)

    def before(self, news: FrameNews) -> int:
        """How many frames are missing before this one."""
        whose = news.process, news.tap
        last = self.last.get(whose, news.count - 1)
        self.last[whose] = max(last, news.count)
        return max(0, news.count - last - 1)


def overhear(
    seconds: float | None = None, wish: FrameWish | None = None, runs: AnyPath | None = None
) -> Iterator[HeardFrame]:
    """The frames that other processes of this computer send and hear, from now on; for ever, or for some seconds.

    They are told by all that use the same `runs` folder, by default the user's; a process that is at work already is
    heard after a quarter of a second. OSError if the folder cannot be used.
    """
    folder = runs_folder() if runs is None else Path(runs)
    end = None if seconds is None else time.monotonic() + seconds
    wanted, gaps = wish or FrameWish(), _Gaps()
    skipped = 0
    with _listening(folder / LISTENERS) as (port, token, path, announcement):
        touch_at = time.monotonic() + TOUCH_S
        while end is None or time.monotonic() < end:
            if time.monotonic() >= touch_at:
                touch_at = time.monotonic() + TOUCH_S
                _touch(path, announcement)
            news = _next_news(port, token)
            if news is None:
                continue
            skipped += gaps.before(news)
            heard = HeardFrame(news, skipped)
            if wanted.takes(heard):
                skipped = 0
                yield heard


@contextmanager
def _listening(folder: Path) -> Iterator[tuple[socket, bytes, Path, str]]:
    """A port on which frames arrive, the secret that each begins with, the file that says so, and what is in it."""
    import socket

    folder.mkdir(parents=True, exist_ok=True)
    _sweep(folder)
    token = secrets.token_hex(16)
    path = folder / f"{os.getpid()}-{token[:8]}.json"
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as port:
        with suppress(OSError):
            port.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, BUFFER)
        port.bind((HOST, 0))
        port.settimeout(WAIT_S)
        announcement = json.dumps({"format": FORMAT, "port": port.getsockname()[1], "token": token})
        _announce(path, announcement)
        try:
            yield port, token.encode(), path, announcement
        finally:
            with suppress(OSError):
                path.unlink()


def _announce(path: Path, announcement: str) -> None:
    descriptor = os.open(path, os.O_CREAT | os.O_EXCL | os.O_WRONLY, 0o600)
    try:
        with os.fdopen(descriptor, "w", encoding="ascii") as file:
            file.write(announcement)
    except OSError:
        path.unlink(missing_ok=True)
        raise


def _touch(path: Path, announcement: str) -> None:
    """Say that somebody still listens; a listener that slept for long may have been swept away as dead."""
    try:
        os.utime(path)
    except FileNotFoundError:
        _announce(path, announcement)


def _sweep(folder: Path) -> None:
    """Remove the files of listeners that have died."""
    for path in folder.glob("*.json"):
        with suppress(OSError):
            if time.time() - path.stat().st_mtime > 4 * STALE_S:
                path.unlink()


def _next_news(port: socket, token: bytes) -> FrameNews | None:
    """The next frame that is told within a moment; None if there is none, or nothing that can be believed."""
    try:
        data = port.recv(DATAGRAM)
    except OSError:  # none came, or the last one was answered by nobody, which Windows tells here
        return None
    if not compare_digest(data[: len(token)], token):
        return None
    return news_in(data[len(token) :])


def news_in(data: bytes) -> FrameNews | None:
    """What a datagram says; None if it cannot be."""
    decoder = Decoder()
    try:
        news: FrameNews = decoder.decode(FrameNews, json.loads(data), "")
    except (ValueError, RecursionError):
        return None
    return news if not decoder.problems and _is_sound(news) else None


def _is_sound(news: FrameNews) -> bool:
    sizes = [_size(news.sent), _size(news.address), *([] if news.answer is None else [_size(news.answer)])]
    return (
        sizes[:2] == [FRAME_BYTES, 5]
        and all(0 <= size <= FRAME_BYTES for size in sizes)
        and 0 <= news.node < EVERY_NODE
        and 0 <= news.retries <= 4 * RETRIES
        and all(0 <= each < 2**53 for each in (news.tap, news.count, news.process, news.at))
        and news.trust in (GOOD, WRONG, UNKNOWN)
        and all(len(each) <= LONGEST and printable(each) == each for each in (news.radio, news.display))
    )


def _size(digits: str) -> int:
    """Bytes that hexadecimal digits are; -1 if they are none."""
    return len(digits) // 2 if re.fullmatch("(?:[0-9A-Fa-f]{2})*", digits) else -1


def _frame(payload: bytes, *, from_host: bool) -> dict[str, Any]:
    return {"type": kind_name(payload), "fields": fields_of(payload, from_host=from_host), "bytes": payload.hex()}

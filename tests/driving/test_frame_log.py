"""What a listener believes, and how it says it: nothing that arrives breaks it, and lines are short."""

from __future__ import annotations

import json
import os
import socket
import threading
import time
from collections.abc import Callable
from pathlib import Path
from random import Random

import pytest

from curveline.cli.printing.reports.frame_lines import describe_frame
from curveline.driving.frame_log import FrameNews, FrameWish, HeardFrame, news_in, overhear
from curveline.errors import InvalidInput
from curveline.radio.frame_tap import LISTENERS, listeners
from curveline.radio.protocol.page_frames import AskFrame, encode_ask

SENT = encode_ask(AskFrame(255, 256)).hex()
NEWS = {
    "tap": 1,
    "count": 1,
    "process": 77,
    "at": 1.7e9,
    "radio": "mock",
    "display": "single",
    "node": 1,
    "address": "C1C1C1C101",
    "sent": SENT,
    "answer": "",
    "retries": 0,
    "trust": "unknown",
}


def told(**changes: object) -> FrameNews | None:
    return news_in(json.dumps({**NEWS, **changes}).encode())


def test_what_can_be_is_believed() -> None:
    assert told() == FrameNews(**NEWS)  # type: ignore[arg-type]
    for answer in (None, "00" * 32, "ab"):
        assert told(answer=answer) is not None


@pytest.mark.parametrize(
    "changes",
    [
        *({"sent": each} for each in ("", "zz" * 32, SENT[:-2], SENT + "00", SENT[:-1] + " ", "\u0663" * 64, None, 5)),
        *({"answer": each} for each in ("0", "00" * 33, "0x", [1])),
        *({"address": each} for each in ("C1C1C1C1", "C1C1C1C1zz", "../../../x")),
        *({"node": each} for each in (-1, 255, 1.5, True, "1")),
        *({"retries": each} for each in (-1, 13, 2**80)),
        *({"at": each} for each in (-1.0, 1e300, "now", float("nan"))),
        *({"count": each} for each in (-1, 2**53, None)),
        *({"radio": each} for each in ("x" * 201, "\x1b[31m", "a\nb")),
        *({"display": each} for each in ("\x07", 5)),
        {"trust": "very"},
        {"more": 1},
    ],
)
def test_what_cannot_be_is_not(changes: dict[str, object]) -> None:
    assert told(**changes) is None


def test_no_datagram_breaks_it() -> None:
    random = Random(7)
    whole = json.dumps(NEWS).encode()
    for data in (b"", b"{", b"[]", b"null", b"[" * 3000, b"\xff" * 50, b'{"tap":' + b"9" * 4000 + b"}"):
        assert news_in(data) is None
    for _ in range(3000):
        spoilt = bytearray(whole)
        for _ in range(random.randrange(1, 4)):
            spoilt[random.randrange(len(spoilt))] = random.randrange(256)
        found = news_in(bytes(spoilt))
        if found is not None:
            heard = HeardFrame(found)
            assert heard.document()
            assert all(len(line) <= 80 for line in describe_frame(heard))


def test_lines_fit_whatever_is_in_the_frames() -> None:
    random = Random(8)
    for _ in range(3000):
        sent = bytes([0x20 | random.randrange(16)]) + random.randbytes(31)
        answer = bytes([0x20 | random.randrange(16)]) + random.randbytes(random.choice((3, 31, 31)))
        news = told(
            sent=sent.hex(), answer=answer.hex(), node=random.choice((0, 1, 128)), retries=3, trust="wrong", at=0.0
        )
        assert news is not None
        heard = HeardFrame(news, missed=random.choice((0, 5)))
        lines = list(describe_frame(heard))
        assert all(len(line) <= 80 and line.isprintable() for line in lines), lines
        assert ("WRONG TAG" in lines[-1]) == (lines[-1].split("<")[1].strip().startswith("WRONG TAG"))
        json.dumps(heard.document(), allow_nan=False)


def test_frames_that_were_not_told_in_time_are_counted(tmp_path: Path) -> None:
    counts = iter((5, 6, 9, 3, 20))
    heard = collected(tmp_path, lambda: [json.dumps({**NEWS, "count": count}).encode() for count in counts])
    assert [each.missed for each in heard] == [0, 0, 2, 0, 10]


def test_those_missed_before_an_unwanted_frame_count_for_the_next_wanted_one(tmp_path: Path) -> None:
    rows = [(1, 1), (4, 2), (5, 1)]
    news = [json.dumps({**NEWS, "count": count, "node": node}).encode() for count, node in rows]
    heard = collected(tmp_path, lambda: news, FrameWish(nodes=(1,)))
    assert [(each.news.count, each.missed) for each in heard] == [(1, 0), (5, 2)]


def test_only_who_knows_the_secret_is_heard(tmp_path: Path) -> None:
    whole = json.dumps(NEWS).encode()
    heard = collected(tmp_path, lambda: [whole], prefix=lambda token: b"0" * 32)
    assert heard == []
    heard = collected(tmp_path, lambda: [whole], prefix=lambda token: token[:-1])
    assert heard == []


def collected(
    runs: Path,
    news: Callable[[], list[bytes]],
    wish: FrameWish | None = None,
    prefix: Callable[[bytes], bytes] = lambda token: token,
) -> list[HeardFrame]:
    """What is heard of datagrams that somebody sends."""

    def send() -> None:
        deadline = time.monotonic() + 5.0
        while not (found := list(listeners(runs / LISTENERS))):
            assert time.monotonic() < deadline
            time.sleep(0.01)
        with socket.socket(type=socket.SOCK_DGRAM) as way:
            for each in news():
                way.sendto(prefix(found[0].token.encode()) + each, ("127.0.0.1", found[0].port))

    thread = threading.Thread(target=send)
    thread.start()
    heard = list(overhear(0.5, wish, runs))
    thread.join()
    return heard


def test_its_file_is_its_own_and_goes_with_it(tmp_path: Path) -> None:
    (tmp_path / LISTENERS).mkdir()
    old = tmp_path / LISTENERS / "1-old.json"
    old.write_text("{}")
    os.utime(old, (0, 0))
    heard = overhear(0.3, runs=tmp_path)
    modes = []
    thread = threading.Thread(
        target=lambda: (time.sleep(0.1), modes.extend(each.stat().st_mode & 0o777 for each in old.parent.iterdir()))
    )
    thread.start()
    assert list(heard) == []
    thread.join()
    assert modes == [0o600], "and what a dead one left is gone"
    assert list(old.parent.iterdir()) == []


def test_one_that_was_swept_away_as_dead_is_heard_again(tmp_path: Path) -> None:
    """It was suspended, as by Ctrl-Z, and another one began to listen meanwhile."""
    swept = []

    def sweep() -> None:
        time.sleep(0.2)
        for each in (tmp_path / LISTENERS).iterdir():
            swept.append(each.read_text())
            each.unlink()

    thread = threading.Thread(target=sweep)
    thread.start()
    listening = overhear(2.0, runs=tmp_path)
    told = threading.Timer(1.6, lambda: swept.extend(each.token for each in listeners(tmp_path / LISTENERS)))
    told.start()
    assert list(listening) == []
    thread.join()
    told.join()
    assert json.loads(swept[0])["token"] == swept[1]


def test_a_type_that_there_is_not(tmp_path: Path) -> None:
    with pytest.raises(InvalidInput, match="there is no frame 'drives'") as caught:
        FrameWish(kinds=("drives",))
    assert "drive, status" in caught.value.hint

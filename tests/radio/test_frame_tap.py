"""Frames told as they pass: to nobody at no cost, to listeners without waiting, and which answers are a node's own."""

from __future__ import annotations

import json
import os
import socket
import sys
import time
from collections.abc import Iterator
from contextlib import closing
from pathlib import Path
from typing import Any

import pytest

from curveline.driving.frame_log import FrameWish, HeardFrame, news_in, overhear
from curveline.radio import frame_tap
from curveline.radio.frame_tap import FORMAT, LISTENERS, FrameListener, listeners
from curveline.radio.host.journal import Journal, new_run
from curveline.radio.host.link import read_status, send_plan
from curveline.radio.host.scan import scan
from curveline.radio.interface import Radio, open_radio

from .bench import drive_table, make_plan

DRIVE = drive_table(2)
PLAN = make_plan(2, [(0.3, 1.0, 0.1), (0.5, 0.0, 0.0)], seconds=0.1)


@pytest.fixture
def ear(tmp_path: Path) -> Iterator[socket.socket]:
    """A listener's port, which nobody reads unless a test does."""
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as port:
        port.bind(("127.0.0.1", 0))
        port.settimeout(2.0)
        announce(tmp_path, port.getsockname()[1])
        yield port


def announce(runs: Path, number: int, **changes: object) -> None:
    (runs / LISTENERS).mkdir(exist_ok=True)
    path = runs / LISTENERS / f"{number}.json"
    path.write_text(json.dumps({"format": FORMAT, "port": number, "token": "ab" * 16, **changes}))


def news_from(port: socket.socket) -> list[dict[str, Any]]:
    """All that has arrived."""
    told = []
    port.setblocking(False)
    while True:
        try:
            data = port.recv(4096)
        except BlockingIOError:
            return told
        assert data.startswith(b"ab" * 16)
        told.append(json.loads(data[32:]))


def sent_run(radio: Radio, runs: Path) -> int:
    """Send a plan; how many polls it took."""
    journal = Journal(new_run(runs, "tap"))
    try:
        return sum(node.link.polls for node in send_plan(PLAN, radio, journal).nodes)
    finally:
        journal.close()


def test_every_exchange_is_told_as_it_was(tmp_path: Path, ear: socket.socket) -> None:
    with closing(open_radio("mock:fresh,seed=1", DRIVE, tmp_path)) as radio:
        read_status(radio, DRIVE)
    told = news_from(ear)
    assert [each["count"] for each in told] == list(range(1, len(told) + 1))
    assert {each["node"] for each in told} == {1, 2}
    for each in told:
        assert (each["process"], each["radio"], each["display"]) == (os.getpid(), "mock:fresh,seed=1", DRIVE.display)
        assert each["address"] == DRIVE.addresses[each["node"] - 1]
        assert abs(each["at"] - time.time()) < 60.0
        assert news_in(json.dumps(each).encode()) is not None
        assert each["sent"].startswith("23")


def test_answers_of_a_whole_run_are_known_for_the_nodes_own(tmp_path: Path, ear: socket.socket) -> None:
    with closing(open_radio("mock:fresh,seed=1,loss=0.1", DRIVE, tmp_path)) as radio:
        polls = sent_run(radio, tmp_path)
    told = news_from(ear)
    assert len(told) >= polls
    trusted = [each["trust"] for each in told if each["answer"]]
    # Until its first HELLO has been heard, a node answers with what was loaded before.
    assert set(trusted[10:]) == {"good"}
    kinds = {each["answer"][:2] for each in told if each["answer"]}
    assert {"22", "24"} <= kinds


def test_pages_are_good_and_answers_that_were_spoilt_on_the_way_are_not(tmp_path: Path, ear: socket.socket) -> None:
    with closing(open_radio("mock:fresh,key=2", DRIVE, tmp_path)) as radio:
        scan(radio, DRIVE)
    assert {each["trust"] for each in news_from(ear) if each["answer"]} == {"good"}, "a page needs no key"
    with closing(open_radio("mock:fresh,corrupt=0.2,seed=3", DRIVE, tmp_path)) as radio:
        sent_run(radio, tmp_path)
    told = [each["trust"] for each in news_from(ear) if each["answer"]]
    assert 0.05 < told.count("wrong") / len(told) < 0.4
    assert told.count("good") > 0.5 * len(told)


def test_who_begins_to_listen_in_the_midst_of_a_session_is_told_whose_answers_are(tmp_path: Path) -> None:
    with closing(open_radio("mock:fresh", DRIVE, tmp_path)) as radio, socket.socket(type=socket.SOCK_DGRAM) as port:
        exchange, polls = radio.exchange, 0

        def announces(frames: Any) -> Any:
            nonlocal polls
            polls += 1
            if polls == 12:
                port.bind(("127.0.0.1", 0))
                announce(tmp_path, port.getsockname()[1])
                radio.tap._look_at = 0.0  # type: ignore[attr-defined]
            return exchange(frames)

        radio.exchange = announces  # type: ignore[method-assign]
        sent_run(radio, tmp_path)
        told = news_from(port)
    assert len(told) > 10
    assert {each["trust"] for each in told if each["answer"]} == {"good"}


def test_nobody_listens_and_nothing_is_done(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "socket", None)
    looked = []
    monkeypatch.setattr(frame_tap, "listeners", lambda folder: looked.append(folder) or [])
    with closing(open_radio("mock:fresh", DRIVE, tmp_path)) as radio:
        begin = time.monotonic()
        sent_run(radio, tmp_path)
        assert len(looked) <= 2 + (time.monotonic() - begin) / frame_tap.LOOK_S
    assert not (tmp_path / LISTENERS).exists()


def test_a_listener_that_reads_nothing_stops_nobody(tmp_path: Path, ear: socket.socket) -> None:
    ear.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 4096)
    with closing(open_radio("mock:fresh,seed=1", DRIVE, tmp_path)) as radio:
        polls = sent_run(radio, tmp_path)
    told = news_from(ear)
    assert 0 < len(told) < polls


def test_a_listener_that_died_is_forgotten(tmp_path: Path, ear: socket.socket) -> None:
    path = tmp_path / LISTENERS / f"{ear.getsockname()[1]}.json"
    os.utime(path, (time.time() - 10, time.time() - 10))
    with closing(open_radio("mock:fresh,seed=1", DRIVE, tmp_path)) as radio:
        read_status(radio, DRIVE)
    assert news_from(ear) == []


@pytest.mark.parametrize(
    "changes",
    [
        {"format": 2},
        {"port": "80"},
        {"port": 80},
        {"port": 70000},
        {"port": True},
        {"port": None},
        {"token": "short"},
        {"token": None},
        {"token": ["ab"] * 16},
        {"token": "AB" * 16},
    ],
)
def test_files_of_listeners_that_cannot_be(tmp_path: Path, changes: dict[str, object]) -> None:
    announce(tmp_path, 5000, **changes)
    assert list(listeners(tmp_path / LISTENERS)) == []


def test_rubbish_beside_a_listener_does_not_hide_it(tmp_path: Path) -> None:
    folder = tmp_path / LISTENERS
    folder.mkdir()
    for index, content in enumerate((b"", b"[]", b"null", b"[" * 500, b"\xff\xfe", b"{" + b" " * 10_000 + b"}")):
        (folder / f"0{index}.json").write_bytes(content)
    (folder / "0x.json").mkdir()
    (folder / "0y.json").symlink_to(folder / "nowhere")
    os.mkfifo(folder / "0z.json")
    announce(tmp_path, 5000)
    assert list(listeners(folder)) == [FrameListener(5000, "ab" * 16)]
    for port in range(6000, 6010):
        announce(tmp_path, port)
    assert len(list(listeners(folder))) == frame_tap.MOST_LISTENERS


def test_what_is_overheard_is_filtered_and_the_file_is_gone_afterwards(tmp_path: Path) -> None:
    heard: list[HeardFrame] = []
    wish = FrameWish(nodes=(2,), kinds=("report",), display=DRIVE.display, radio="mock:loss=0.5")
    frames = overhear(1.0, wish, tmp_path)
    with closing(open_radio("mock:fresh,seed=1", DRIVE, tmp_path)) as radio:
        original = radio.exchange

        def exchange(batch: Any) -> Any:
            return original(batch)

        radio.exchange = exchange  # type: ignore[method-assign]
        import threading

        thread = threading.Thread(target=lambda: (time.sleep(0.3), read_status(radio, DRIVE)))
        thread.start()
        heard.extend(frames)
        thread.join()
    assert len(heard) == 1
    assert (heard[0].news.node, heard[0].kinds, heard[0].missed) == (2, ("hello", "report"), 0)
    document = heard[0].document()
    assert (document["answer"]["type"], document["answer"]["tag"]) == ("report", "good")
    assert document["sent"]["fields"]["flags"] == 4
    assert list((tmp_path / LISTENERS).iterdir()) == []

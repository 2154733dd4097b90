"""What a sender publishes, and what others believe of it."""

from __future__ import annotations

import json
import os
import time
from collections.abc import Iterator
from contextlib import closing
from pathlib import Path
from random import Random
from typing import Any

import pytest

from curveline.driving import live
from curveline.driving.live import published, read_live, same_radio, sender_of, senders
from curveline.radio.host.actions import Phase
from curveline.radio.host.journal import FILE_NAME, Journal, new_run
from curveline.radio.host.link import Control, OperatorRequest, Progress, RunReport
from curveline.radio.host.node_status import NodeStatus
from radio.bench import drive_table, short_plan

PLAN = short_plan(2, 2)


def status(node: int, state: str = "moving") -> NodeStatus:
    return NodeStatus(node, PLAN.drive.addresses[node - 1], state, boot=1, started=1, counts=(node, -1, 0))


def news(node: int, state: str = "moving") -> Progress:
    return Progress(0.5, Phase.RELEASED, 1, 2, status(node, state), 0.3)


@pytest.fixture
def run(tmp_path: Path) -> Path:
    return new_run(tmp_path, "small")


@pytest.fixture(autouse=True)
def at_once(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(live, "LOOK_S", 0.0)
    monkeypatch.setattr(live, "PUBLISH_S", 0.0)


@pytest.fixture
def journal(run: Path) -> Iterator[Journal]:
    with closing(Journal(run)) as opened:
        yield opened


def test_a_sender_says_what_it_knows(run: Path, journal: Journal) -> None:
    with published(run, PLAN, "mock:realtime", Control()) as publisher:
        publisher(news(1))
        publisher.look()
        (found,) = senders(run.parent)
        assert found.run == run
        assert found.live.process == os.getpid()
        assert (found.live.phase, found.live.step, found.live.steps) == ("released", 1, 2)
        assert found.live.statuses[0] == status(1)
        assert [each.state for each in found.live.statuses] == ["moving", "silent"]
        assert 0.0 <= found.live.age < 60.0
    assert list(senders(run.parent)) == []
    assert not (run / "live.json").exists()
    assert read_live(run / "last.json") is not None


def test_a_killed_sender_does_not_look_alive(run: Path, journal: Journal) -> None:
    """It leaves its file, and its process id may be another's by now; only the lock is gone for certain."""
    with published(run, PLAN, "mock", Control()) as publisher:
        publisher.look()
        left = (run / "live.json").read_bytes()
    (run / "live.json").write_bytes(left)
    assert len(list(senders(run.parent))) == 1
    journal.close()
    assert list(senders(run.parent)) == []


def test_a_node_that_falls_silent_is_said_to(run: Path, journal: Journal, monkeypatch: pytest.MonkeyPatch) -> None:
    with published(run, PLAN, "mock", Control()) as publisher:
        publisher(news(1))
        begin = time.monotonic()
        monkeypatch.setattr(time, "monotonic", lambda: begin + 0.9)
        publisher(news(2))
        monkeypatch.setattr(time, "monotonic", lambda: begin + 1.2)
        publisher.look()
        (found,) = senders(run.parent)
        assert [each.state for each in found.live.statuses] == ["silent", "moving"]
        publisher.end(RunReport("paused", 0, 2, 1.5, (status(1, "hold"), status(2, "hold"))))
        (found,) = senders(run.parent)
        assert found.live.phase == "paused"
        assert [each.state for each in found.live.statuses] == ["hold", "hold"]


def test_a_request_is_heard_once_and_told(run: Path, journal: Journal) -> None:
    told: list[str] = []
    control = Control(tell=told.append)
    with published(run, PLAN, "mock", control) as publisher:
        control.listen()
        assert control.request is OperatorRequest.NONE
        (run / f"stop-{'0' * 16}").write_text("of another sender")
        control.listen()
        assert control.request is OperatorRequest.NONE
        (run / f"stop-{publisher.token}").write_bytes(b"me\x1b[2J\xff\n" * 9)
        control.listen()
        control.listen()
        assert control.request is OperatorRequest.HOLD
        (found,) = senders(run.parent)
        assert found.live.stop.startswith("me")
        assert found.live.stop.isprintable()
    assert len(told) == 1
    assert told[0].isprintable()
    assert list(run.glob("stop-*")) == [], "it is not meant for the next sender"


@pytest.mark.parametrize("make", ["mkdir", "large", "link", "empty"])
def test_a_request_counts_whatever_it_holds(run: Path, journal: Journal, make: str) -> None:
    control = Control()
    with published(run, PLAN, "mock", control) as publisher:
        path = run / f"stop-{publisher.token}"
        {
            "mkdir": path.mkdir,
            "large": lambda: path.write_bytes(b"x" * 10_000),
            "link": lambda: path.symlink_to(path),
            "empty": path.touch,
        }[make]()
        control.listen()
        assert control.request is OperatorRequest.HOLD
        assert control.by == "another process"


def test_news_that_cannot_be_written_do_not_end_a_run(run: Path, journal: Journal) -> None:
    (run / "live.part").mkdir()
    with published(run, PLAN, "mock", Control()) as publisher:
        publisher(news(1))
        publisher.look()
        publisher.end(None)
    assert list(senders(run.parent)) == []


def test_senders_are_told_apart_by_display_and_radio(run: Path, journal: Journal, tmp_path: Path) -> None:
    quad = drive_table(2, "quad")
    with published(run, PLAN, "serial:/dev/ttyACM0", Control()) as publisher:
        publisher.look()
        assert sender_of(PLAN.drive, "serial:/dev/../dev/ttyACM0", run.parent) is not None
        for drive, spec in ((quad, "serial:/dev/ttyACM0"), (PLAN.drive, "serial:/dev/ttyACM1"), (PLAN.drive, "mock")):
            assert sender_of(drive, spec, run.parent) is None
    (tmp_path / "port").touch()
    (tmp_path / "by-id").symlink_to(tmp_path / "port")
    assert same_radio(f"serial:{tmp_path}/port", f"serial:{tmp_path}/by-id")
    assert same_radio("mock:realtime", "mock:loss=0.1")
    assert not same_radio("nrf24:22,0", "nrf24:22,1")
    assert same_radio("nrf24:22,0", "nrf24:22,0,spi_MHz=2")


# What is written there by others


def document(run: Path) -> dict[str, Any]:
    with published(run, PLAN, "mock", Control()) as publisher:
        publisher(news(1))
        publisher.look()
        found: dict[str, Any] = json.loads((run / "live.json").read_text())
    return found


@pytest.mark.parametrize(
    ("key", "value"),
    [
        ("format", 2),
        ("token", "../../etc"),
        ("process", -1),
        ("process", 10**400),
        ("plan", "\x1b[2J"),
        ("radio", None),
        ("at", float("nan")),
        ("at", "now"),
        ("phase", "asleep"),
        ("step", 1.5),
        ("seconds", -1.0),
        ("nodes", {}),
        ("nodes", [1]),
        ("stop", "\n"),
        ("more", 1),
    ],
)
def test_a_file_that_says_something_else_is_not_believed(run: Path, key: str, value: object) -> None:
    path = run / "live.json"
    path.write_text(json.dumps({**document(run), key: value}))
    assert read_live(path) is None


@pytest.mark.parametrize(
    ("key", "value"),
    [
        ("node", 3),
        ("state", "flying"),
        ("state", "silent"),
        ("counts", []),
        ("counts", [1, 2]),
        ("counts", [1, 2, 2**40]),
        ("boot", -1),
        ("address", "\x07"),
        ("fault", 7),
        ("link", {"polls": "1"}),
        ("link", {"polls": -1, "answered": 0, "lost": 0, "retries": 0, "bad_tags": 0}),
    ],
)
def test_a_node_that_is_none_is_not_believed(run: Path, key: str, value: object) -> None:
    content = document(run)
    content["nodes"][0][key] = value
    path = run / "live.json"
    path.write_text(json.dumps(content))
    assert read_live(path) is None


def test_no_mutant_of_the_file_raises(run: Path) -> None:
    whole = json.dumps(document(run)).encode()
    path, random = run / "live.json", Random(7)
    for _ in range(400):
        mutant = bytearray(whole)
        for _ in range(random.randrange(1, 4)):
            mutant[random.randrange(len(mutant))] = random.randrange(256)
        path.write_bytes(bytes(mutant[: random.randrange(len(mutant) + 1)] if random.random() < 0.2 else mutant))
        found = read_live(path)
        assert found is None or all(each.address.isprintable() for each in found.statuses)
    path.write_bytes(b"[" * 200_000)
    assert read_live(path) is None
    path.unlink()
    path.mkdir()
    assert read_live(path) is None


def test_folders_without_a_journal_send_nothing(run: Path) -> None:
    (run / "live.json").write_text(json.dumps(document(run)))
    assert list(senders(run.parent)) == []
    (run / FILE_NAME).mkdir()
    assert list(senders(run.parent)) == []

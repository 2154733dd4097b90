"""Disks that fail at every call a run makes: no release leaves without its record, nodes hold, and the run goes on."""

from __future__ import annotations

import errno
import os
from collections import Counter
from collections.abc import Sequence
from contextlib import closing
from pathlib import Path

import pytest

from curveline.errors import InvalidInput, LinkError
from curveline.plan_file import Plan
from curveline.radio.host.journal import FILE_NAME, Journal, ReopenedJournal, SystemDisk, read_journal
from curveline.radio.host.link import resume_plan, send_plan
from curveline.radio.host.resume import resume_point
from curveline.radio.interface import Answer
from curveline.radio.mock.display import MockRadio
from curveline.radio.mock.spec import MockSpec
from curveline.radio.mock.store import state_at_home
from curveline.radio.protocol.codes import FrameKind, NodeState
from curveline.radio.protocol.envelope import kind_of

from .bench import short_plan

PLAN = short_plan(2, 3)
CALLS = Counter(reserve=1, write=8, sync=9)
"""What an unbroken run asks of its disk."""


class FailingDisk(SystemDisk):
    """Fails at one call and all after it; `durable` is what a loss of power would leave."""

    def __init__(self, method: str = "", at: int = 0, code: int = 0) -> None:
        self.method, self.at, self.code = method, at, code
        self.calls: Counter[str] = Counter()
        self.durable = b""

    def reserve(self, descriptor: int, size: int) -> None:
        self._call("reserve")
        super().reserve(descriptor, size)

    def write(self, descriptor: int, data: bytes, offset: int) -> int:
        self._call("write")
        return super().write(descriptor, data, offset)

    def sync(self, descriptor: int) -> None:
        self._call("sync")
        self.durable = Path(f"/proc/self/fd/{descriptor}").read_bytes()

    def _call(self, method: str) -> None:
        self.calls[method] += 1
        if method == self.method and self.calls[method] >= self.at:
            raise OSError(self.code, os.strerror(self.code))


class Watch(MockRadio):
    """A mock display that looks at every frame before it leaves: a release in it must be on disk already."""

    def __init__(self, plan: Plan, disk: FailingDisk, folder: Path) -> None:
        super().__init__(MockSpec(), plan.drive, state_at_home(plan.drive.node_count))
        self.watched = disk
        self.folder = folder
        self.begun: list[list[int]] = [[] for _ in self.nodes]
        self._durable = b"-"
        self._released = 0

    def exchange(self, frames: Sequence[tuple[str, bytes]]) -> Sequence[Answer]:
        for _, payload in frames:
            if kind_of(payload) is FrameKind.DRIVE:
                assert int.from_bytes(payload[8:10], "little") <= self.released(), "released before it was on disk"
        answers = super().exchange(frames)
        for node, begun in zip(self.nodes, self.begun, strict=True):
            if node.memory.started != (begun[-1] if begun else 0):
                begun.append(node.memory.started)
        return answers

    def released(self) -> int:
        """The last step whose release would survive a loss of power now."""
        if self.watched.durable != self._durable:
            self._durable = self.watched.durable
            path = self.folder / "durable"
            path.write_bytes(self._durable)
            records = read_journal(path)
            self._released = max((record["step"] for record in records if record["type"] == "release"), default=0)
        return self._released


def send(radio: Watch) -> None:
    """Send the plan; LinkError if its disk fails."""
    with closing(Journal(radio.folder, radio.watched)) as journal:
        send_plan(PLAN, radio, journal)


def test_an_unbroken_run_makes_these_calls(tmp_path: Path) -> None:
    radio = Watch(PLAN, FailingDisk(), tmp_path)
    send(radio)
    assert radio.watched.calls == CALLS
    assert radio.released() == 3
    assert radio.begun == [[1, 2, 3]] * 2


@pytest.mark.parametrize("code", [errno.ENOSPC, errno.EIO])
@pytest.mark.parametrize(("method", "at"), [(method, 1 + at) for method in CALLS for at in range(CALLS[method])])
def test_a_disk_that_fails_at_any_call_releases_nothing_and_the_run_goes_on(
    tmp_path: Path, method: str, at: int, code: int
) -> None:
    radio = Watch(PLAN, FailingDisk(method, at, code), tmp_path)
    with pytest.raises(LinkError, match=os.strerror(code)) as caught:
        send(radio)
    assert "CURVELINE_RUNS" in caught.value.hint
    assert all(node.move is None for node in radio.nodes)
    assert {node.state for node in radio.nodes} <= {NodeState.BOOT, NodeState.READY, NodeState.HOLD}

    radio.watched = FailingDisk()
    records = read_journal(tmp_path / FILE_NAME)
    if not records:
        assert radio.begun == [[], []]
        with pytest.raises(InvalidInput, match="nothing to resume"):
            resume_point(PLAN, records)
        return
    with closing(ReopenedJournal(tmp_path, radio.watched)) as journal:
        assert resume_plan(PLAN, radio, journal).outcome == "done"
    assert radio.begun == [[1, 2, 3]] * 2
    with pytest.raises(InvalidInput, match="done to its end"):
        resume_point(PLAN, read_journal(tmp_path / FILE_NAME))


@pytest.mark.parametrize("method", ["reserve", "write", "sync"])
@pytest.mark.parametrize("at", [1, 2])
def test_a_disk_that_fails_again_while_the_run_goes_on(tmp_path: Path, method: str, at: int) -> None:
    """Reopening takes one sync, the record of it one write and one sync; each may fail, and be tried again."""
    radio = Watch(PLAN, FailingDisk("write", 5, errno.EIO), tmp_path)
    with pytest.raises(LinkError):
        send(radio)
    before = [begun.copy() for begun in radio.begun]
    radio.watched = FailingDisk(method, at, errno.ENOSPC)
    if (method, at) != ("reserve", 2):
        with pytest.raises(LinkError, match="No space left"), closing(ReopenedJournal(tmp_path, radio.watched)) as late:
            resume_plan(PLAN, radio, late)
        assert radio.begun == before or (method, at) == ("write", 2)
    radio.watched = FailingDisk()
    with closing(ReopenedJournal(tmp_path, radio.watched)) as journal:
        assert resume_plan(PLAN, radio, journal).outcome == "done"
    assert radio.begun == [[1, 2, 3]] * 2

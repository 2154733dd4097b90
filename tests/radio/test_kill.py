"""Hosts killed with SIGKILL at many points of a run, and others that go on: every node does every step once.

A child process sends a plan to a mock display whose nodes are remembered on disk, and kills itself at the n-th of the
points that matter: before and after every exchange, every write, sync and reservation of the record, half-way through
a write, and around the moment when the display's state takes effect. What the nodes did is read from the states that
took effect, over all processes together.
"""

from __future__ import annotations

import json
import os
import signal
import traceback
from collections.abc import Callable, Iterator
from contextlib import closing, contextmanager, suppress
from itertools import pairwise
from pathlib import Path
from random import Random

import pytest

from campaign import only
from curveline.errors import InvalidInput
from curveline.plan_file import Plan, sealed, write_plan
from curveline.radio.host.journal import FILE_NAME, Journal, ReopenedJournal, SystemDisk, new_run, read_journal
from curveline.radio.host.link import resume_plan, send_plan
from curveline.radio.host.resume import resume_point
from curveline.radio.host.run_folder import run_names
from curveline.radio.interface import open_radio
from curveline.radio.mock import store
from curveline.radio.mock.display import MockRadio

from .bench import short_plan

NEVER = 1 << 30
SIGKILLED = -signal.SIGKILL


class Fate:
    """Kills this process at the n-th point it comes to."""

    def __init__(self, fatal: int) -> None:
        self.fatal = fatal
        self.points = 0

    def point(self) -> None:
        self.points += 1
        if self.points == self.fatal:
            os.kill(os.getpid(), signal.SIGKILL)


class FatalDisk(SystemDisk):
    """A disk under a record that its process may not outlive; a kill needs no sync, so none is waited for."""

    def __init__(self, fate: Fate) -> None:
        self._fate = fate

    def reserve(self, descriptor: int, size: int) -> None:
        self._fate.point()
        super().reserve(descriptor, size)

    def write(self, descriptor: int, data: bytes, offset: int) -> int:
        self._fate.point()
        half = super().write(descriptor, data[: len(data) // 2], offset)
        self._fate.point()
        return half + super().write(descriptor, data[half:], offset + half)

    def sync(self, descriptor: int) -> None:
        self._fate.point()


def note(folder: Path, kind: str, state: dict[str, list[dict[str, int]]]) -> None:
    """One line on the display's state, on disk as soon as it is written."""
    progress = [(node["started"], node["finished"]) for node in state["nodes"]]
    with (folder / "log").open("a") as log:
        log.write(json.dumps([kind, progress]) + "\n")


def bind(fate: Fate, folder: Path, radio: MockRadio) -> None:
    """Put the points in place, in this process only, which is a child."""
    replace, exchange = os.replace, radio._exchange

    def fatal_replace(partial: Path, final: Path) -> None:
        fate.point()
        note(folder, "save", json.loads(Path(partial).read_text()))
        fate.point()
        replace(partial, final)
        fate.point()

    def fatal_exchange(address: str, payload: bytes) -> object:
        fate.point()
        answer = exchange(address, payload)
        fate.point()
        return answer

    store.os.replace = fatal_replace  # type: ignore[assignment]
    radio._exchange = fatal_exchange  # type: ignore[assignment, method-assign]


def last_begun(folder: Path) -> Path:
    """The newest run that came to its start record; InvalidInput if there is none."""
    for name in run_names(folder):
        with suppress(InvalidInput):
            if read_journal(folder / name / FILE_NAME)[:1]:
                return folder / name
    raise InvalidInput("no run has begun")


def host(folder: Path, plan: Plan, spec: str, fate: Fate) -> None:
    """One process: go on with the run if there is one, or begin it."""
    with closing(open_radio(spec, plan.drive, folder)) as radio:
        assert isinstance(radio, MockRadio)
        note(folder, "load", json.loads(next(folder.glob("mock-*.json")).read_text()))
        bind(fate, folder, radio)
        try:
            journal = ReopenedJournal(last_begun(folder), FatalDisk(fate))
        except InvalidInput:
            with closing(Journal(new_run(folder, plan.name), FatalDisk(fate))) as fresh:
                send_plan(plan, radio, fresh)
        else:
            with closing(journal), suppress_end():
                resume_plan(plan, radio, journal)


@contextmanager
def suppress_end() -> Iterator[None]:
    """A host that was killed after its last record has left nothing to do."""
    try:
        yield
    except InvalidInput as error:
        if "done to its end" not in error.message:
            raise


def in_a_child(work: Callable[[], None]) -> int:
    """Do it in a process of its own; its exit code, 1 if it raised, negative if it was killed."""
    pid = os.fork()
    if pid == 0:
        code = 1
        try:
            work()
            code = 0
        except BaseException:
            traceback.print_exc()
        finally:
            os._exit(code)
    return os.waitstatus_to_exitcode(os.waitpid(pid, 0)[1])


def in_effect(folder: Path) -> Iterator[list[list[int]]]:
    """The states of the display that took effect; one that was only about to is none."""
    lines = [json.loads(line) for line in (folder / "log").read_text().splitlines()]
    for (kind, progress), following in pairwise([*lines, ["end", None]]):
        if kind == "save" and following[0] == "load" and following[1] != progress:
            continue
        yield progress


def check(folder: Path, plan: Plan, told: str) -> None:
    """Every node has begun and ended every step once and in order, and the record says so."""
    states = list(in_effect(folder))
    for node in range(plan.drive.node_count):
        for which in (0, 1):
            seen = [state[node][which] for state in states]
            steps = [now for before, now in pairwise([0, *seen]) if now != before]
            assert steps == list(range(1, len(plan.steps) + 1)), (told, node, states)
    display = json.loads(next(folder.glob("mock-*.json")).read_text())
    assert [tuple(node["counts"]) for node in display["nodes"]] == [each.counts for each in plan.steps[-1].targets]
    with pytest.raises(InvalidInput, match="done to its end"):
        resume_point(plan, read_journal(last_begun(folder) / FILE_NAME))


def clean_points(folder: Path, plan: Plan, spec: str) -> int:
    """How many points an unbroken run has."""

    def work() -> None:
        fate = Fate(NEVER)
        host(folder, plan, spec, fate)
        (folder / "points").write_text(str(fate.points))

    assert in_a_child(work) == 0
    check(folder, plan, "unbroken")
    return int((folder / "points").read_text())


def kill_and_resume(folder: Path, plan: Plan, spec: str, fatal: list[int]) -> int:
    """Kill one host after the other at these points, then let the last one finish; how many were killed."""
    killed = 0
    for point in [*fatal, NEVER]:
        code = in_a_child(lambda point=point: host(folder, plan, spec, Fate(point)))  # type: ignore[misc]
        killed += code == SIGKILLED
        assert code in (0, SIGKILLED), (spec, fatal)
        if code == 0:
            break
    check(folder, plan, f"{spec}, killed at {fatal}")
    return killed


@pytest.mark.parametrize("count", [20, *only([70])])
def test_killed_at_many_points_a_run_still_does_every_step_once(tmp_path: Path, count: int) -> None:
    plan, random, killed = short_plan(2, 3), Random(5), 0
    (tmp_path / "clean").mkdir()
    spec = "mock:seed=1"
    total = clean_points(tmp_path / "clean", plan, spec)
    points = sorted({1 + number * total // count for number in range(count)})
    for point in points:
        folder = tmp_path / f"at-{point}"
        folder.mkdir()
        again = [random.randrange(1, total)] if random.random() < 0.3 else []
        killed += kill_and_resume(folder, plan, spec, [point, *again])
    print(f"{total} points, {killed} killed at {len(points)} of them")
    assert killed > 6 * count // 7


@pytest.mark.campaign
@pytest.mark.parametrize("seed", range(3))
def test_killed_at_every_point(tmp_path: Path, seed: int) -> None:
    plan, random, killed = short_plan(2, 16), Random(seed), 0
    spec = f"mock:seed={seed},loss={0.1 * seed:.1f}"
    (tmp_path / "clean").mkdir()
    total = clean_points(tmp_path / "clean", plan, spec)
    for point in range(1, total + 1):
        folder = tmp_path / f"at-{point}"
        folder.mkdir()
        fatal = [point, *(random.randrange(1, total) for _ in range(random.randrange(3)))]
        killed += kill_and_resume(folder, plan, spec, fatal)
    print(f"seed {seed}: {total} points, {killed} kills")
    assert killed >= 400


def test_a_plan_is_kept_whole_beside_its_record(tmp_path: Path) -> None:
    """What the folder of a run holds is what was sent: the run tag in its record says so."""
    plan = short_plan(2, 2)
    write_plan(sealed(plan), tmp_path / "plan.json")
    spec = "mock"
    assert in_a_child(lambda: host(tmp_path, plan, spec, Fate(40))) == SIGKILLED
    with pytest.raises(InvalidInput, match="not of the plan"):
        resume_point(short_plan(2, 3), read_journal(last_begun(tmp_path) / FILE_NAME))

"""A run broken off anywhere, its record cut at any byte: another host finishes it, or refuses and says why.

Two things can have happened to a record that ends early. If the power failed while the last line was being written,
no node can be ahead of it, because nothing is released before its line is whole: every such run must go on, and do
each step once. If the disk lost lines that had been there, nodes may be ahead: then nothing may move.
"""

from __future__ import annotations

import copy
import json
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from random import Random

import pytest

from curveline.errors import InvalidInput
from curveline.radio.host.actions import Phase, Policy, Write
from curveline.radio.host.conductor import Conductor
from curveline.radio.host.journal import FILE_NAME, ReopenedJournal, SystemDisk, encode_record
from curveline.radio.host.resume import ResumePoint, resume_point
from curveline.radio.host.stop_causes import Cause
from curveline.radio.mock.air import Weather

from .bench import Bench, make_plan, short_plan

NOTHING = "there is nothing to resume"


class Watched(Bench):
    """A bench that keeps the order in which every node began its steps."""

    def __init__(self, *arguments: object, **options: object) -> None:
        super().__init__(*arguments, **options)  # type: ignore[arg-type]
        self.begun: list[list[int]] = [[] for _ in self.nodes]
        self.hooks.append(lambda send: self.look())

    def look(self) -> None:
        """Note what has begun since the last look; a frame begins one step at most."""
        for node, begun in zip(self.nodes, self.begun, strict=True):
            if node.memory.started != (begun[-1] if begun else 0):
                begun.append(node.memory.started)

    def turn(self) -> bool:
        goes_on = super().turn()
        self.look()
        return goes_on

    def copy(self) -> Watched:
        """The same nodes in the same air at the same moment; what they did is remembered, their host is not."""
        hooks, conductor = self.hooks, self.conductor
        self.hooks, self.conductor = [], None  # type: ignore[assignment]
        twin = copy.deepcopy(self)
        self.hooks, self.conductor = hooks, conductor
        twin.hooks.append(lambda send: twin.look())
        return twin

    def resume(self, point: ResumePoint, random: Random) -> Phase:
        """Another host goes on, some time later; `records` are those that it writes."""
        self.records = []
        self.now_us += random.choice([0, 300_000, 2_000_000, 60_000_000])
        self.conductor = Conductor(self.plan, self.site, random.getrandbits(56) << 8, Policy(), point)
        return self.run(limit_ms=self.now_ms + 600_000)


@dataclass
class Moment:
    """A record is about to be written: the nodes as they are, and the record before and after."""

    bench: Watched
    before: bytes
    line: bytes


def moments(bench: Watched) -> Iterator[Moment]:
    """Every record of a run, which is carried out meanwhile."""
    record = b""
    goes_on = True
    while goes_on:
        action = bench.conductor.next(bench.now_ms)
        if isinstance(action, Write):
            line = encode_record(len(bench.records), {**action.record, "at": 1790000000.25 + len(bench.records)})
            yield Moment(bench.copy(), record, line)
            record += line
        goes_on = bench.turn()


class QuickDisk(SystemDisk):
    """A disk that is not waited for."""

    def sync(self, descriptor: int) -> None:
        """Nothing of what these tests write is to survive a loss of power."""


def reopen(folder: Path, content: bytes) -> list[dict[str, object]]:
    """The records of a journal with this content, which must end up on disk without its torn end."""
    path = folder / FILE_NAME
    path.write_bytes(content)
    journal = ReopenedJournal(folder, QuickDisk())
    journal.close()
    whole = b"".join(encode_record(number, record) for number, record in enumerate(journal.records))
    assert path.read_bytes() == whole
    assert content.startswith(whole)
    return list(journal.records)  # type: ignore[arg-type]


def finish(moment: Moment, point: ResumePoint, random: Random) -> None:
    """Go on from a record; every node must do what is left, once."""
    bench = moment.bench.copy()
    assert bench.resume(point, random) is Phase.DONE, (bench.conductor.halt, point)
    steps = len(bench.plan.steps)
    assert bench.begun == [list(range(1, steps + 1))] * len(bench.nodes), (bench.begun, point)
    assert bench.positions() == [target.counts for target in bench.plan.steps[-1].targets]
    kinds = [record["type"] for record in bench.records]
    assert kinds[0] == "resume"
    assert kinds[-1] == "end"


def cut_everywhere(bench: Watched, folder: Path, random: Random, *, every: int) -> int:
    """Cut every line of a run's record at every byte; every so many of the cuts, and where it is whole, go on."""
    cuts = 0
    for moment in moments(bench):
        for size in range(len(moment.line) + 1):
            reserved = bytes(random.choice([0, 40, 4000]))
            records = reopen(folder, moment.before + moment.line[:size] + reserved)
            cuts += 1
            if not records:
                with pytest.raises(InvalidInput, match=NOTHING):
                    resume_point(bench.plan, records)
            elif records[-1]["type"] == "end":
                with pytest.raises(InvalidInput, match=f"{NOTHING}: the run has been done"):
                    resume_point(bench.plan, records)
            elif size in (1, len(moment.line)) or random.randrange(every) == 0:
                finish(moment, resume_point(bench.plan, records), random)
    assert bench.conductor.phase is Phase.DONE
    return cuts


@pytest.mark.parametrize("loss", [0.0, 0.4])
def test_a_record_cut_at_every_byte_goes_on_and_loses_and_doubles_nothing(tmp_path: Path, loss: float) -> None:
    seed = 7
    bench = Watched(short_plan(3, 6), Weather(loss), random=Random(seed))
    cuts = cut_everywhere(bench, tmp_path, Random(seed), every=200)
    assert cuts > 1900


@pytest.mark.campaign
@pytest.mark.parametrize("seed", range(2))
def test_twenty_thousand_cuts(tmp_path: Path, seed: int) -> None:
    random = Random(seed)
    bench = Watched(short_plan(2, 90), Weather(random.choice([0.0, 0.3])), random=random)
    cuts = cut_everywhere(bench, tmp_path, random, every=10)
    print(f"seed {seed}: {cuts} cuts")
    assert cuts > 20_000


def test_a_record_that_lost_lines_goes_on_only_if_no_node_is_ahead_of_it(tmp_path: Path) -> None:
    """The nodes as they were at every record of a run, against every shorter record of it."""
    random = Random(3)
    bench = Watched(short_plan(2, 5), random=random)
    found = list(moments(bench))
    bench.look()
    found.append(Moment(bench.copy(), found[-1].before + found[-1].line, b""))
    lines = [moment.line for moment in found]
    refused, done = 0, 0
    for last, moment in enumerate(found):
        for kept in range(1, last):
            records = reopen(tmp_path, b"".join(lines[:kept]) + lines[kept][: random.randrange(len(lines[kept]))])
            point = resume_point(bench.plan, records)
            if max(node.memory.started for node in moment.bench.nodes) <= point.released:
                finish(moment, point, random)
                done += 1
                continue
            late = moment.bench.copy()
            before = copy.deepcopy(late.begun)
            assert late.resume(point, random) is Phase.HALTED
            assert late.conductor.halt is not None
            assert late.conductor.halt.cause is Cause.AHEAD
            assert late.begun == before
            assert all(node.move is None for node in late.nodes)
            assert late.records == [], "a record that was refused is left as it was"
            refused += 1
    assert refused > 40
    assert done > 5


@pytest.mark.parametrize("loss", [0.0, 0.3, 0.5])
def test_hosts_killed_at_any_moment_and_often(loss: float) -> None:
    """Not only while a record is being written; and the next host may be killed, too, while it takes over."""
    for seed in range(12):
        random = Random(seed)
        bench = Watched(make_plan(3, seconds=0.4), Weather(loss), random=random)
        for _ in range(4):
            bench.run_for(random.randrange(1, 1200))
            if not bench.records or bench.records[-1]["type"] == "end":
                continue
            bench.now_us += 1000 * random.choice([0, 10, 900, 5000])
            bench.new_host(random.getrandbits(56) << 8)
        assert bench.run() is Phase.DONE, (seed, bench.conductor.halt)
        assert bench.begun == [[1, 2, 3]] * 3, seed
        resume_ends(bench, seed)


def resume_ends(bench: Bench, seed: int) -> None:
    """What all hosts wrote together is one story, and it has ended."""
    with pytest.raises(InvalidInput, match="done to its end"):
        resume_point(bench.plan, json.loads(json.dumps(bench.records)))
    assert [record["type"] for record in bench.records].count("end") == 1, seed

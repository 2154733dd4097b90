"""What every radio must do, whichever it is: one row in RADIOS per back end."""

from __future__ import annotations

import inspect
from itertools import pairwise
from pathlib import Path

import pytest

from curveline.radio import BACK_ENDS, Radio, open_radio
from curveline.radio.frames import FRAME_BYTES
from curveline.radio.journal import Journal, new_run, read_journal
from curveline.radio.link import read_status, send_plan

from .bench import drive_table, make_plan

RADIOS = ["mock", "mock:realtime", "mock:loss=0.3,seed=5,dup=0.1,stale=0.1"]
PLAN = make_plan(2, [(1.0, 1.0, 0.5), (2.0, 0.0, 0.0)], seconds=0.4)


@pytest.fixture(params=RADIOS)
def radio(request: pytest.FixtureRequest, tmp_path: Path):
    radio = open_radio(request.param, drive_table(), tmp_path)
    yield radio
    radio.close()


def test_every_back_end_is_in_the_suite() -> None:
    assert {spec.partition(":")[0] for spec in RADIOS} <= set(BACK_ENDS)


def test_it_has_the_methods_of_a_radio(radio: Radio) -> None:
    for name, method in inspect.getmembers(Radio, inspect.isfunction):
        if not name.startswith("_"):
            assert inspect.signature(method) == inspect.signature(getattr(type(radio), name)), name
    assert len(radio.site.chips) == 2


def test_its_time_only_grows_and_sleeping_reaches_the_moment(radio: Radio) -> None:
    times = [radio.now_us()]
    for _ in range(3):
        radio.sleep_until(radio.now_us() + 2000)
        times.append(radio.now_us())
    assert all(later - sooner >= 2000 for sooner, later in pairwise(times))
    radio.sleep_until(0)
    assert radio.now_us() >= times[-1]


def test_an_exchange_takes_time_and_gives_a_frame_or_nothing(radio: Radio) -> None:
    for number in range(20):
        begin = radio.now_us()
        (answer,) = radio.exchange([(drive_table().addresses[number % 2], bytes([number]) * FRAME_BYTES)])
        assert radio.now_us() > begin
        assert answer.payload is None or len(answer.payload) in (0, FRAME_BYTES)
        assert answer.retries >= 0


def test_status_then_send_then_status(radio: Radio, tmp_path: Path) -> None:
    before = read_status(radio, drive_table())
    assert [each.counts for each in before] == [(0, 0, 0)] * 2
    journal = Journal(new_run(tmp_path, "contract"))
    report = send_plan(PLAN, radio, journal)
    journal.close()
    assert (report.outcome, report.steps_done) == ("done", 2)
    goal = PLAN.steps[-1].targets[0].counts
    for after in read_status(radio, drive_table()):
        assert after.counts == pytest.approx(goal, abs=4)
        assert after.state == "ready"
    assert read_journal(journal.path)[-1]["type"] == "end"


def test_closing_twice_is_once(radio: Radio, tmp_path: Path) -> None:
    radio.close()
    stored = {path.name: path.read_bytes() for path in tmp_path.glob("*.json")}
    radio.close()
    assert {path.name: path.read_bytes() for path in tmp_path.glob("*.json")} == stored

"""How long things take, and how far that can be trusted, on clocks that are made up."""

from __future__ import annotations

from collections.abc import Iterable

import pytest

from curveline.bench import processes
from curveline.bench.measurement import Measurement
from curveline.bench.methods import stopwatch
from curveline.bench.methods.stopwatch import ROUNDS, Timed, timed


class Clocks:
    """An action that takes given times on the wall clock, and a part of these on the processor's."""

    def __init__(self, takes: Iterable[float], part: float = 1.0) -> None:
        self.wall = self.processor = 0.0
        self.calls = 0
        self._takes, self._part = iter(takes), part

    def action(self) -> None:
        """Take the next time."""
        took = next(self._takes)
        self.calls += 1
        self.wall += took
        self.processor += self._part * took

    def timed(self, patch: pytest.MonkeyPatch, seconds: float) -> Timed:
        """The action, timed."""
        patch.setattr(stopwatch.time, "perf_counter", lambda: self.wall)
        patch.setattr(stopwatch.time, "process_time", lambda: self.processor)
        return timed(self.action, seconds)


def test_the_shortest_counts_and_the_first_does_not(monkeypatch: pytest.MonkeyPatch) -> None:
    clocks = Clocks([0.01, *(4 * [1.0, 3.0]), 2.0, 2.0])
    assert clocks.timed(monkeypatch, 10.0).best == 1.0
    assert clocks.calls > ROUNDS


def test_the_noise_is_how_far_rounds_lie_apart(monkeypatch: pytest.MonkeyPatch) -> None:
    found = Clocks([9.0, 1.0, 1.1, 1.2, 1.3, 1.4]).timed(monkeypatch, 5.0)
    assert found.best == 1.0
    assert found.spread == pytest.approx(0.2)


def test_what_is_long_is_done_once_and_its_noise_not_known(monkeypatch: pytest.MonkeyPatch) -> None:
    clocks = Clocks([9.0, 2.0, 3.0])
    assert clocks.timed(monkeypatch, 0.3) == Timed(2.0, None)
    assert clocks.calls == 2


@pytest.mark.parametrize("takes", [[9.0, 2.0], [9.0, *(5 * [2.0])]])
def test_a_time_that_waited_for_the_processor_says_so(monkeypatch: pytest.MonkeyPatch, takes: list[float]) -> None:
    found = Clocks(takes, 0.5).timed(monkeypatch, 0.3 if len(takes) == 2 else 10.0)
    assert found.best == 2.0
    assert found.spread == pytest.approx(1.0)


def test_a_clock_too_coarse_to_tell_is_no_waiting() -> None:
    assert Timed.of([0.004, 0.004], 0.0) == Timed(0.004, 0.0)


def test_several_processors_are_no_waiting(monkeypatch: pytest.MonkeyPatch) -> None:
    assert Clocks([9.0, *(5 * [2.0])], 2.0).timed(monkeypatch, 10.0).spread == pytest.approx(0.0)


def test_a_command_that_fails_is_a_figure_that_says_so() -> None:
    row = Measurement("broken", None, "s", "< 1", "wall, best of 3")
    command = [processes.sys.executable, "-c", "raise SystemExit(3)"]
    failed = processes.unless_it_fails(row, lambda: processes.shortest(command, processes.apart("/nowhere")))
    assert (failed.value, failed.how, failed.is_missed) == (None, "failed: exit code 3", True)
    fine = processes.unless_it_fails(row, lambda: processes.shortest([*command[:2], ""], processes.apart("/nowhere")))
    assert fine.value is not None
    assert fine.how == row.how
    assert fine.spread is not None


def test_commands_are_apart_from_what_the_user_has(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("CURVELINE_RADIO", "serial:/dev/ttyACM0")
    found = processes.apart("/folder", CURVELINE_CACHE="/cache")
    assert "CURVELINE_RADIO" not in found
    assert (found["CURVELINE_RUNS"], found["CURVELINE_CACHE"]) == ("/folder/runs", "/cache")


def test_processor_time_and_memory_are_those_of_a_command() -> None:
    work = "import time\nwhile time.process_time() < 0.2: pass"
    spent = processes.spent([processes.sys.executable, "-c", work], processes.apart("/nowhere"))
    assert 0.15 < spent.processor < spent.wall + 0.1
    hold = "held = bytearray(60_000_000)"
    assert 60.0 < processes.peak_memory([processes.sys.executable, "-c", hold], processes.apart("/nowhere")) < 120.0

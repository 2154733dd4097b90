"""`curveline bench` with made-up figures: what it prints, keeps, compares with, and refuses before it measures."""

from __future__ import annotations

import json
import sys
import time
from collections.abc import Iterator, Sequence
from dataclasses import replace
from pathlib import Path

import pytest

from curveline.bench import quick
from curveline.bench.history import read_bench
from curveline.bench.machine import MachineLoad, Watch
from curveline.bench.measurement import Measurement
from curveline.bench.quick import FigureGroup
from curveline.bench.report import BenchReport, to_json
from curveline.cli.app import main
from curveline.cli.printing.progress import ticker

from .conftest import Run, failure
from .terminals import Shown, here

RELAX = Measurement("relax to 0.1 mm", 41.2, "us", "< 30", "from a spline guess", 0.01, 3.49, 0.019)
HELP = Measurement("curveline --help", 0.171, "s", "< 0.3", "wall, best of 5", 0.02)


class Fakes:
    """What is measured in place of the real figures, and how often."""

    def __init__(self) -> None:
        self.rows = [RELAX, HELP]
        self.taken = 0
        self.pause = 0.0

    def groups(self, shapes: Sequence[str] = ()) -> list[FigureGroup]:
        return [FigureGroup("one rod", self._measured)]

    def _measured(self) -> Iterator[Measurement]:
        self.taken += 1
        for row in self.rows:
            time.sleep(self.pause)
            yield row


@pytest.fixture
def fakes(monkeypatch: pytest.MonkeyPatch) -> Fakes:
    made = Fakes()
    monkeypatch.setattr(quick, "quick", made.groups)
    monkeypatch.setattr(quick, "radio_link", made.groups)
    watched(monkeypatch, MachineLoad(0.1, 0.01, 0.02))
    return made


def watched(monkeypatch: pytest.MonkeyPatch, load: MachineLoad) -> None:
    """Let that be the load of the machine."""

    def begin(self: Watch) -> None:
        self.before = replace(load, during=None)

    monkeypatch.setattr(Watch, "__init__", begin)
    monkeypatch.setattr(Watch, "load", lambda self: load)


def kept_by(err: str) -> Path:
    (line,) = (line for line in err.splitlines() if line.startswith("kept as "))
    return Path(line.removeprefix("kept as "))


def test_a_run_is_shown_with_conditions_and_ratios_and_kept(run: Run, fakes: Fakes, tmp_path: Path) -> None:
    done = run("bench", "--quick")
    assert done.code == 0  # timings pass and fail nothing
    lines = done.out.splitlines()
    assert [line.split()[0] for line in lines[:5]] == ["machine", "load", "curveline", "kernels", "with"]
    assert "relax to 0.1 mm                      41.2 us     < 30" in done.out
    assert lines[-1] == "1 of 2 goals missed, marked !: relax to 0.1 mm"
    assert any(line.split()[-2:] == ["3.49", "0.019"] for line in lines)
    path = kept_by(done.err)
    assert path.parents[1] == tmp_path / "runs" / "bench"
    assert read_bench(path).rows == (RELAX, HELP)
    assert "level-up-peak" in read_bench(path).shapes
    assert "\x1b" not in done.out + done.err


def test_json_is_what_is_kept(run: Run, fakes: Fakes, tmp_path: Path) -> None:
    done = run("bench", "--quick", "--json", "--runs", tmp_path / "elsewhere")
    path = kept_by(done.err)
    assert path.parents[1] == tmp_path / "elsewhere" / "bench"
    assert json.loads(done.out) == json.loads(path.read_text())
    assert json.loads(done.out)["missed"] == ["relax to 0.1 mm"]


def test_what_became_slower_than_the_last_run_is_marked(run: Run, fakes: Fakes) -> None:
    run("bench", "--quick")
    fakes.rows = [replace(RELAX, value=60.0), HELP]
    done = run("bench", "--quick", "--compare", "last")
    (line,) = (line for line in done.out.splitlines() if line.endswith("slower"))
    assert line.split() == ["relax", "to", "0.1", "mm", "60", "us", "41.2", "1.46", "14", "%", "slower"]
    assert "of 2 figures by more than the noise: 0 faster or better, 1 slower or worse: relax to 0.1 mm" in done.out
    assert done.code == 0
    again = json.loads(run("bench", "--quick", "--json", "--compare", "last").out)
    assert again["compared"]["slower"] == []


def test_a_document_with_a_comparison_can_be_compared_with(run: Run, fakes: Fakes, tmp_path: Path) -> None:
    run("bench", "--quick")
    (tmp_path / "new.json").write_text(run("bench", "--quick", "--json", "--compare", "last").out)
    assert run("bench", "--quick", "--compare", tmp_path / "new.json").code == 0


def test_another_machine_is_told_and_ratios_compared(run: Run, fakes: Fakes, tmp_path: Path) -> None:
    other = BenchReport([replace(RELAX, value=1.0, over_bare_newton=3.5), HELP])
    conditions = replace(other.conditions, machine=replace(other.conditions.machine, processor="Abacus"))
    (tmp_path / "old.json").write_bytes(to_json(replace(other, conditions=conditions)))
    done = run("bench", "--quick", "--compare", tmp_path / "old.json")
    assert "the machines differ in processor: Abacus then" in done.out
    assert "so times are compared over those of bare Newton" in done.out
    assert any(
        line.split()[-7:] == ["3.49", "x", "bare", "3.5", "1.00", "14", "%"] for line in done.out.splitlines()
    ), done.out


def test_a_record_that_cannot_be_used_is_refused_before_anything_is_measured(
    run: Run, fakes: Fakes, tmp_path: Path
) -> None:
    for name, content, words in (
        ("gone.json", None, "no such file"),
        ("broken.json", '{"curveline_bench": 1, "rows": [', "not JSON"),
        ("foreign.json", '{"rows": []}', "no record of `curveline bench`"),
        ("newer.json", '{"curveline_bench": 99}', "newer release"),
    ):
        path = tmp_path / name
        if content is not None:
            path.write_text(content)
        done = run("bench", "--quick", "--compare", path)
        assert done.code == 2
        assert str(path) in done.err
        assert words in done.err
        assert "hint: " in done.err
        assert failure(run("bench", "--quick", "--json", "--compare", path).out, 2)["diagnostics"]
    done = run("bench", "--quick", "--compare", "last")
    assert done.code == 2
    assert "there is no run of `curveline bench` in" in done.err
    assert fakes.taken == 0


def test_rod_and_link_are_not_compared(run: Run, fakes: Fakes) -> None:
    path = kept_by(run("bench", "--quick").err)
    done = run("bench", "--link", "--compare", path)
    assert done.code == 2
    assert "measured the rod, and this the link" in done.err
    assert run("bench", "--link", "--compare", "last").code == 2  # there is none of its kind
    kept_by(run("bench", "--link").err)
    assert run("bench", "--link", "--compare", "last").code == 0


def test_what_cannot_be_kept_was_measured_all_the_same(run: Run, fakes: Fakes, tmp_path: Path) -> None:
    (tmp_path / "full").mkdir()
    (tmp_path / "full" / "bench").write_text("a file")
    done = run("bench", "--quick", "--runs", tmp_path / "full")
    assert done.code == 0
    assert "this run is not kept: " in done.err
    assert "1 of 2 goals missed" in done.out


def test_a_busy_machine_is_told_before_and_after(run: Run, fakes: Fakes, monkeypatch: pytest.MonkeyPatch) -> None:
    watched(monkeypatch, MachineLoad(3.0, 0.8, 0.5))
    done = run("bench", "--quick", "--json")
    assert "the machine is busy: distrust the figures" in done.err
    assert json.loads(done.out)["load"] == {"average": 3.0, "before": 0.8, "during": 0.5}
    assert "the machine was busy, so distrust these figures" in run("bench", "--quick").err


def test_a_terminal_shows_how_far_it_is_and_nothing_wider(
    run: Run, fakes: Fakes, monkeypatch: pytest.MonkeyPatch
) -> None:
    run("bench", "--quick")
    fakes.rows = [replace(RELAX, value=60.0), HELP]
    fakes.pause = 0.1
    monkeypatch.setattr(ticker, "QUIET_S", 0.0)
    monkeypatch.setattr(sys, "argv", ["curveline", "bench", "--quick", "--compare", "last"])
    with here(monkeypatch, 80) as text, pytest.raises(SystemExit):
        main()
    told = Shown(0, text[0], 0.0)
    assert any("measuring one rod, part 1 of 1, 1 figures done" in line for line in told.lines)
    assert "measuring one rod" not in told.left
    assert max(len(line) for line in told.lines if not line.startswith(("kept as", "/", "  /"))) <= 80

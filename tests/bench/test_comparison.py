"""Two runs of the benchmark held against each other: small made-up ones, whose answer is known."""

from __future__ import annotations

import json
from dataclasses import replace

import pytest

from curveline.bench.comparison import BARE, LEAST_NOISE, UNKNOWN_NOISE, BenchComparison, ComparedRow, compare_bench
from curveline.bench.machine import MachineLoad
from curveline.bench.measurement import Measurement
from curveline.bench.report import BenchReport
from curveline.cli.printing.reports import bench_text

from .samples import CONDITIONS

OTHER = replace(CONDITIONS, machine=replace(CONDITIONS.machine, processor="Another"))


def time_of(value: float | None, spread: float | None = 0.0, over: float | None = None) -> Measurement:
    return Measurement("relax", value, "us", "< 30", "", spread, over)


def report(*rows: Measurement, conditions: object = CONDITIONS) -> BenchReport:
    return BenchReport(rows, (), conditions)  # type: ignore[arg-type]


def compared(new: Measurement, old: Measurement) -> ComparedRow:
    (row,) = compare_bench(report(new), report(old)).rows
    return row


@pytest.mark.parametrize(
    ("new", "old", "ratio", "verdict"),
    [
        (time_of(12.0), time_of(10.0), 1.2, "slower"),
        (time_of(10.0), time_of(12.0), 10 / 12, "faster"),
        (time_of(10.9), time_of(10.0), 1.09, ""),
        (time_of(12.0, 0.05), time_of(10.0, 0.03), 1.2, ""),  # 26 % is noise
        (time_of(12.7, 0.05), time_of(10.0, 0.03), 1.27, "slower"),
        (time_of(12.0, None), time_of(10.0), 1.2, ""),
        (time_of(12.6, None), time_of(10.0), 1.26, "slower"),
        (time_of(None), time_of(10.0), None, ""),
        (time_of(10.0), time_of(None), None, ""),
        (Measurement("rate", 100.0, "/s", "", "", 0.0), Measurement("rate", 200.0, "/s", "", "", 0.0), 0.5, "slower"),
        (
            Measurement("over", 60.0, "x", "> 35", "", 0.0),
            Measurement("over", 40.0, "x", "> 35", "", 0.0),
            1.5,
            "faster",
        ),
        (Measurement("lost", 1.0, "", "= 0", ""), Measurement("lost", 0.0, "", "= 0", ""), None, "worse"),
        (Measurement("lost", 0.0, "", "= 0", ""), Measurement("lost", 0.0, "", "= 0", ""), None, ""),
        (Measurement("found", 300.0, "", "", "", 0.0), Measurement("found", 200.0, "", "", "", 0.0), 1.5, ""),
        (
            Measurement("memory", 90.0, "MB", "< 150", ""),
            Measurement("memory", 140.0, "MB", "< 150", ""),
            90 / 140,
            "better",
        ),
        (Measurement("plan", 2.0, "s", "", "", 0.0), Measurement("plan", 3.0, "ms", "", "", 0.0), None, ""),
    ],
)
def test_what_is_beyond_the_noise_is_marked(
    new: Measurement, old: Measurement, ratio: float | None, verdict: str
) -> None:
    row = compared(new, old)
    assert row.ratio == (None if ratio is None else pytest.approx(ratio))
    assert row.verdict == verdict


def test_noise_is_what_repeats_show_and_more_where_there_were_none() -> None:
    assert compared(time_of(1.0), time_of(1.0)).noise == LEAST_NOISE
    assert compared(time_of(1.0, 0.1), time_of(1.0, 0.2)).noise == pytest.approx(LEAST_NOISE + 0.6)
    assert compared(time_of(1.0, 0.1), time_of(1.0, None)).noise == UNKNOWN_NOISE


def test_where_repeats_do_not_tell_a_busy_machine_draws_times_out() -> None:
    busy = replace(CONDITIONS, load=MachineLoad(2.0, 0.0, 0.5))
    rows = (time_of(1.0, None), Measurement("memory", 1.0, "MB", "", ""), Measurement("known", 1.0, "s", "", "", 0.0))
    noises = [row.noise for row in compare_bench(report(*rows), report(*rows, conditions=busy)).rows]
    assert noises == [UNKNOWN_NOISE + 1.0, UNKNOWN_NOISE, LEAST_NOISE]


def test_on_another_machine_times_are_compared_over_bare_newton() -> None:
    memory = Measurement("memory", 100.0, "MB", "< 150", "")
    command = Measurement("help", 0.1, "s", "< 0.3", "", 0.0)
    rate = Measurement("scenes", 100.0, "/s", "", "", 0.0, 30.0)
    now = report(time_of(50.0, 0.0, 3.0), memory, command, rate)
    faster_machine = (
        time_of(10.0, 0.0, 3.1),
        memory,
        replace(command, value=0.01),
        replace(rate, over_bare_newton=20.0),
    )
    found = compare_bench(now, report(*faster_machine, conditions=OTHER))
    assert found.differences == ("the machines differ in processor: Another then, Some Processor now",)
    rows = {row.name: row for row in found.rows}
    assert (rows["relax"].now, rows["relax"].then, rows["relax"].unit) == (3.0, 3.1, BARE)
    assert rows["relax"].verdict == ""
    assert rows["memory"].ratio == 1.0
    assert rows["help"].ratio is None
    assert (rows["scenes"].ratio, rows["scenes"].verdict) == (1.5, "slower")
    assert found.document()["by"] == "ratios"


def test_other_versions_count_and_another_commit_or_load_does_not() -> None:
    new = report(time_of(1.0))
    numpy = replace(CONDITIONS, versions=replace(CONDITIONS.versions, numpy=None))
    (sentence,) = compare_bench(new, report(time_of(1.0), conditions=numpy)).differences
    assert sentence == "the versions differ in numpy: none then, 2.4.6 now"
    older = replace(CONDITIONS, commit="d" * 40, curveline="0.0.9", load=MachineLoad(9.0, 0.9, 0.9), kernels="numba")
    found = compare_bench(new, report(time_of(1.0), conditions=older))
    assert found.differences == ()
    assert found.remarks == (
        "other kernels ran: numba then, shipped now",
        "the machine was busy then: distrust what became slower or faster",
    )


def test_other_shapes_and_rows_of_one_side_are_told() -> None:
    new, old = report(time_of(1.0), Measurement("new", 1.0, "s", "", "")), report(time_of(1.0))
    found = compare_bench(replace(new, shapes=("a", "b")), replace(old, shapes=("a",)))
    assert found.remarks == ("other shapes were measured: 1 shape then, 2 now",)
    assert (found.only_now, found.only_then) == (("new",), ())


def test_the_comparison_reads_well_in_80_columns() -> None:
    rows = [
        Measurement("solve_bvp over two known states", 41.9, "x", "> 30", "", 0.0),
        Measurement("plan 64 segments", 1234.5678, "ms", "< 1.5", "", 0.123, 12345.6),
        time_of(41.234, 0.5, 3.5),
    ]
    new = [replace(row, value=2.0 * (row.value or 0.0), over_bare_newton=9999.9) for row in rows]
    for conditions in (CONDITIONS, OTHER):
        found = compare_bench(report(*new), report(*rows, conditions=conditions))
        lines = list(bench_text.compared(found))
        assert lines[0].startswith("compared with 2023-11-1")
        assert lines[0].endswith("curveline 0.1.0, commit cccccccccccc with changes")
        assert all(len(line) <= 80 for line in lines if line.startswith(("solve", "plan", "relax")))
    assert lines[-1].startswith("of 3 figures by more than the noise: 1 faster or better, 1 slower or worse: relax")
    assert json.loads(json.dumps(found.document()))["slower"] == found.slower


def test_a_figure_without_a_value_is_shown_and_counts_as_missed() -> None:
    row = Measurement("first run of send", None, "s", "< 10", "failed: exit code 2")
    (line,) = bench_text.measured(row)
    assert line.split() == ["!", "first", "run", "of", "send", "-", "s", "<", "10", "failed:", "exit", "code", "2"]
    assert bench_text.missed([row]) == "1 of 1 goals missed, marked !: first run of send"


@pytest.mark.parametrize(("value", "shown"), [(30.0449, "30.04"), (30.0, "30"), (30.7, "30.7"), (29.98, "29.98")])
def test_what_is_near_its_goal_reads_on_its_side(value: float, shown: str) -> None:
    (line,) = bench_text.measured(time_of(value))
    assert line.split()[1 if line.startswith(" ") else 2] == shown


def test_ratios_stand_in_a_table_of_their_own() -> None:
    lines = bench_text.ratios([time_of(41.2, 0.0, 3.49), Measurement("help", 0.1, "s", "", "")])
    assert [line.split() for line in lines[2:]] == [["relax", "41.2", "us", "3.49", "-"]]
    assert bench_text.ratios([Measurement("help", 0.1, "s", "", "")]) == []


def test_conditions_are_told_in_lines_of_a_terminal() -> None:
    lines = bench_text.conditions(CONDITIONS)
    assert lines == [
        "machine    Some Processor, 2 cores, 8.0 GB, Linux x86_64",
        "load       0.50 over the last minute, 2 % of the processors at work just before,",
        "           3 % of them used by others during it",
        "curveline  0.1.0, commit cccccccccccc with changes, Python 3.11.7",
        "kernels    shipped as machine code",
        "with       numpy 2.4.6, scipy 1.17.1, numba 0.68.1, llvmlite 0.50.0",
    ]


def test_nothing_compared_is_no_change() -> None:
    found = BenchComparison(CONDITIONS, (), (), (), ("a",), ("b", "c"))
    assert (
        list(bench_text.compared(found))[-1]
        == "of 0 figures by more than the noise: 0 faster or better, 0 slower or worse"
    )

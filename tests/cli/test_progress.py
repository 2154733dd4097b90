"""Whatever takes long says so while it does: kernels that are compiled, figures measured, nodes watched."""

from __future__ import annotations

import re
import sys
import threading
import time
from collections.abc import Iterator

import pytest
import typer
from numba.core import caching

from curveline.bench import link
from curveline.bench.measurement import Measurement
from curveline.cli import consent
from curveline.cli.app import main
from curveline.cli.commands import status
from curveline.cli.printing import screen, terminal
from curveline.cli.printing.progress import compiling, ticker
from curveline.cli.printing.reports.bench_text import measured
from curveline.kernels.compile_time import COMPILATION, clock
from curveline.kernels.kernel import njit
from curveline.shapes import files

from .conftest import SHAPES, Run
from .terminals import ERASED, ESCAPES, Shown, here

HEARD = compiling.Announcement._heard
"""As it is, which the fixture of all tests of commands takes away."""


@pytest.fixture
def compilation(monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    """Kernels that are compiled in a test, and who hears of it, are gone after it."""
    monkeypatch.setattr(compiling.Announcement, "_heard", HEARD)
    monkeypatch.setattr(ticker, "TICK_S", 0.02)
    before = dict(vars(COMPILATION))
    vars(COMPILATION).update(kernels=0, _spent=0.0)  # what this process had to compile before
    yield
    vars(COMPILATION).update(before)


def compile_for(seconds: float) -> None:
    """What numba says when it compiles a kernel that calls another one."""
    COMPILATION.begin()
    COMPILATION.begin()
    time.sleep(seconds / 2)
    COMPILATION.end()
    time.sleep(seconds / 2)
    COMPILATION.end()


def test_kernels_are_counted_on_a_terminal_while_they_are_compiled(
    monkeypatch: pytest.MonkeyPatch, compilation: None
) -> None:
    terminal.begin()
    with here(monkeypatch) as text:
        compiling.announce_compilation()
        compile_for(0.3)
        time.sleep(0.1)
        screen.result("an answer")
    told = Shown(0, text[0], 0.0)
    done = COMPILATION.kernels
    assert f"compiling kernels: {done - 2} done in 0 s" in told.raw
    assert f"compiling kernels: {done - 1} done in 0 s" in told.raw
    first, answer, _ = told.left.split("\n")
    assert first.startswith("compiling kernels that are new here, up to half a minute")
    assert answer == "an answer"


def test_the_line_of_the_kernels_goes_when_they_are_done(monkeypatch: pytest.MonkeyPatch, compilation: None) -> None:
    terminal.begin()
    with here(monkeypatch) as text:
        compiling.announce_compilation()
        compile_for(0.1)
        time.sleep(0.2)
    assert text[0].endswith(" s\r\x1b[J")


def test_elsewhere_a_sentence_says_that_they_are(compilation: None, capsys: pytest.CaptureFixture[str]) -> None:
    compiling.announce_compilation()
    assert capsys.readouterr().err == ""
    compile_for(0.1)
    compile_for(0.1)
    assert capsys.readouterr().err.count("\n") == 1


def test_a_real_kernel_is_counted_and_timed(monkeypatch: pytest.MonkeyPatch, compilation: None) -> None:
    monkeypatch.setattr(caching.IndexDataCacheFile, "load", lambda self, key: None)

    @njit
    def inner(x: float) -> float:
        return 2.0 * x

    @njit
    def outer(x: float) -> float:
        return inner(x) + 1.0

    kernels, seconds = COMPILATION.kernels, COMPILATION.seconds
    begin, other = time.perf_counter(), clock()
    assert outer(1.5) == 4.0
    took = time.perf_counter() - begin
    spent = COMPILATION.seconds - seconds
    assert 0.0 < spent < took
    assert COMPILATION.kernels - kernels >= 2
    assert not COMPILATION.is_busy
    assert clock() - other == pytest.approx(took - spent, abs=0.005)
    before = COMPILATION.seconds
    outer(2.5)
    assert COMPILATION.seconds == before


def test_the_time_of_a_load_is_without_its_kernels(
    run: Run, monkeypatch: pytest.MonkeyPatch, compilation: None
) -> None:
    import json

    from curveline.loading import snap_through

    really = snap_through.stand_of

    def slow(*arguments: object) -> object:
        compile_for(3.0)
        return really(*arguments)  # type: ignore[arg-type]

    monkeypatch.setattr(snap_through, "stand_of", slow)
    done = run("load", SHAPES / "level-neutral-peak.toml", "--json")
    assert json.loads(done.out)["seconds"] < 2.5


def test_what_nobody_else_tells_of_is_told_by_its_time(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(ticker, "TICK_S", 0.02)
    monkeypatch.setattr(ticker, "QUIET_S", 0.1)
    terminal.begin()
    with here(monkeypatch) as text:
        with ticker.patience("measuring"):
            time.sleep(0.05)
        with ticker.patience("searching"):
            time.sleep(0.3)
        screen.result("found")
    assert "measuring" not in text[0]
    assert "searching: 0 s" in text[0]
    assert text[0].endswith(f"{ERASED}found\r\n")


def test_nothing_is_drawn_into_what_is_written(monkeypatch: pytest.MonkeyPatch) -> None:
    terminal.begin()
    with here(monkeypatch) as text:
        terminal.draw("a line")
        with terminal.aside():
            other = threading.Thread(target=terminal.fill, args=("working",))
            other.start()
            other.join(0.1)
            assert other.is_alive()
            print("an answer", flush=True)
        other.join()
        terminal.erase()
    assert text[0] == "a line\r\x1b[Jan answer\r\nworking\r\x1b[J"


@pytest.fixture
def impatient(monkeypatch: pytest.MonkeyPatch) -> None:
    """Let whatever takes a tenth of a second be long."""
    monkeypatch.setattr(ticker, "TICK_S", 0.02)
    monkeypatch.setattr(ticker, "QUIET_S", 0.1)


def slow(monkeypatch: pytest.MonkeyPatch) -> None:
    """Let displays be read slowly."""
    really = files.read_display

    def read_slowly(name: str) -> object:
        time.sleep(0.3)
        return really(name)

    monkeypatch.setattr(files, "read_display", read_slowly)


def test_every_command_says_that_it_is_at_work(monkeypatch: pytest.MonkeyPatch, impatient: None) -> None:
    slow(monkeypatch)
    monkeypatch.setattr(sys, "argv", ["curveline", "status", "--radio", "mock"])
    with here(monkeypatch) as text, pytest.raises(SystemExit):
        main()
    assert text[0].startswith("working: 0 s")
    assert f"{ERASED}display single over mock\r\n" in text[0]


def test_nothing_is_drawn_over_a_question(monkeypatch: pytest.MonkeyPatch, impatient: None) -> None:
    def ask(question: str, *, err: bool) -> bool:
        print(question, end=" ", file=sys.stderr, flush=True)
        time.sleep(0.3)
        print("n", file=sys.stderr, flush=True)
        return False

    monkeypatch.setattr(consent, "require_terminal", lambda why, hint: None)
    monkeypatch.setattr(typer, "confirm", ask)
    monkeypatch.setattr(sys, "argv", ["curveline", "send", str(SHAPES / "level-up-peak.toml"), "--radio", "mock"])
    with here(monkeypatch) as text, pytest.raises(SystemExit):
        main()
    assert "Move the display? n\r\n" in text[0]


def test_a_filler_gives_way_to_better_news(monkeypatch: pytest.MonkeyPatch) -> None:
    terminal.begin()
    with here(monkeypatch) as text:
        terminal.draw("12 of 40")
        terminal.fill("waiting")
        terminal.erase()
        terminal.fill("waiting again")
        terminal.draw("13 of 40")
        terminal.end()
        terminal.draw("too late")
    assert "waiting\r" not in text[0]
    assert "waiting again" in text[0]
    assert "too late" not in text[0]
    assert text[0].endswith("13 of 40\r\x1b[J")


def test_a_drawing_is_cut_to_the_size_of_the_terminal(monkeypatch: pytest.MonkeyPatch) -> None:
    terminal.begin()
    with here(monkeypatch, columns=20, rows=6) as text:
        terminal.draw("\n".join(f"node {number:3} is in a fine state" for number in range(9)))
        terminal.draw("done")
        terminal.keep()
    first, _, last = text[0].partition("\r\x1b[4A\x1b[J")
    assert first.split("\r\n") == [f"node {number:3} is in a fi" for number in range(4)] + ["... 5 more lines"]
    assert last == "done\r\n"


def test_watching_draws_over_and_tells_the_time(run: Run, monkeypatch: pytest.MonkeyPatch) -> None:
    polls = []

    def sleep(seconds: float) -> None:
        polls.append(seconds)
        if len(polls) == 3:
            raise KeyboardInterrupt

    monkeypatch.setattr(status.time, "sleep", sleep)
    monkeypatch.setattr(sys, "argv", ["curveline", "status", "--radio", "mock", "--watch"])
    with here(monkeypatch) as text, pytest.raises(SystemExit) as stop:
        main()
    assert stop.value.code == 130
    assert text[0].count("display single over mock") == 3
    begin, *_, last = re.split("\r\x1b\\[[0-9]+A\x1b\\[J", text[0])
    for block in (begin, last):
        lines = ESCAPES.sub("", block).replace("\r", "").split("\n")
        assert re.fullmatch(r"[0-2][0-9]:[0-5][0-9]:[0-5][0-9], Ctrl-C ends", lines[0])
        assert lines[1] == "display single over mock"
    assert last.endswith("rod: not known\r\n")


def test_watching_into_a_file_gives_every_block_its_time(run: Run, monkeypatch: pytest.MonkeyPatch) -> None:
    polls = []

    def sleep(seconds: float) -> None:
        polls.append(seconds)
        if len(polls) == 2:
            raise KeyboardInterrupt

    monkeypatch.setattr(status.time, "sleep", sleep)
    out = run("status", "--radio", "mock", "-w").out
    assert "\x1b" not in out
    assert len(re.findall(r"^[0-2][0-9]:[0-5][0-9]:[0-5][0-9]\ndisplay single", out, re.MULTILINE)) == 2


@pytest.mark.parametrize(
    ("value", "goal", "is_missed"),
    [
        (99.0, "< 100", False),
        (100.0, "< 100", True),
        (1.15, "<= 1.15", False),
        (1.2, "<= 1.15", True),
        (36.0, "> 35", False),
        (35.0, "> 35", True),
        (1e9, "", False),
    ],
)
def test_a_goal_that_is_missed_is_marked(value: float, goal: str, is_missed: bool) -> None:
    row = Measurement("relax to 0.1 mm", value, "us", goal, "from a spline guess")
    assert row.is_missed is is_missed
    (line,) = measured(row)
    assert line.startswith("! " if is_missed else "  ")
    first, second = measured(Measurement("release, 32 nodes, 30 % loss, p99", value, "ms", goal, "x" * 40))
    assert max(len(first), len(second), len(line)) <= 80


def test_bench_says_how_many_goals_are_missed(run: Run, monkeypatch: pytest.MonkeyPatch) -> None:
    rows = [Measurement("one", 1.0, "s", "< 2", "a"), Measurement("two", 3.0, "s", "< 2", "b")]
    monkeypatch.setattr(link, "rows", lambda: iter(rows))
    assert run("bench", "--link").out.splitlines()[-3:] == [
        "! two" + " " * 37 + "3 s       < 2  b",
        "",
        "1 of 2 goals missed, marked !: two",
    ]
    monkeypatch.setattr(link, "rows", lambda: iter(rows[:1]))
    assert run("bench", "--link").out.endswith("all 1 goals met\n")
    assert '"rows": [{' in run("bench", "--link", "--json").out

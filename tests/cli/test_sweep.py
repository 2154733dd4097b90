"""`simulate --sweep` and `--jobs`: the same bytes whatever the number of processes, and nothing left behind."""

from __future__ import annotations

import csv
import io
import json
import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from pathlib import Path

import numpy as np
import pytest

from curveline.cli.printing import terminal
from curveline.cli.printing.progress import progress_bar
from curveline.kernels import readiness
from curveline.simulation import batch
from curveline.system import workers

from .conftest import BROKEN, SHAPES, Result, Run

PEAK = SHAPES / "level-up-peak.toml"
STAGGERED = SHAPES / "staggered-up-peak.toml"
ANGLE = "nodes.1.angle_deg=-60:60:5"
LENGTH = "segments.1.length_mm=600:700:3"
GRID = ("--sweep", ANGLE, "--sweep", LENGTH)
LIMIT_S = 30.0


def comparable(text: str) -> list[object]:
    """Documents without their time and the command line, which tell two runs apart; what is no JSON as it is."""
    found: list[object] = []
    for line in text.splitlines():
        if line.startswith("{"):
            document = json.loads(line)
            if "error" not in document:
                del document["seconds"], document["provenance"]["argv"]
            found.append(json.dumps(document))
        else:
            found.append(line)
    return found


def test_a_batch_is_the_same_on_any_number_of_processes(run: Run, no_valley: Path) -> None:
    shapes = (BROKEN / "many-problems.toml", PEAK, no_valley, *sorted(SHAPES.glob("staggered-*.toml")), "missing.toml")
    one, two = (run("simulate", *shapes, "--json", "--jobs", jobs) for jobs in (1, 2))
    assert one.code == two.code == 1
    assert comparable(one.out) == comparable(two.out)
    assert len(one.out.splitlines()) == 12
    assert one.err == two.err
    assert one.err.index("many-problems.toml:4:1") < one.err.index("has no valley") < one.err.index("no such file")
    # Apart from the digits of `seconds` it is the very bytes: same keys, same order, same spaces.
    assert [len(json.loads(line)) for line in one.out.splitlines()] == [3, *[6] * 10, 3]
    files = [json.loads(line).get("file") for line in one.out.splitlines()]
    assert files == [str(shapes[0]), *[None] * 10, "missing.toml"]


def test_a_sweep_is_the_same_on_any_number_of_processes(run: Run, tmp_path: Path) -> None:
    def swept(jobs: int) -> tuple[Result, dict[str, bytes]]:
        files = [tmp_path / f"{jobs}.{suffix}" for suffix in ("csv", "npz", "json")]
        outputs = [part for file in files for part in ("-o", file)]
        result = run("simulate", PEAK, *GRID, "--points", 7, "--json", *outputs, "-j", jobs)
        return result, {file.suffix: file.read_bytes() for file in files}

    (one, ones), (two, twos) = swept(1), swept(2)
    assert one.code == two.code == 1
    assert comparable(one.out) == comparable(two.out)
    assert one.err.replace("1.", "2.") == two.err.replace("1.", "2.")
    assert ones[".csv"] == twos[".csv"]
    assert comparable(ones[".json"].decode()) == comparable(twos[".json"].decode())
    assert comparable(ones[".json"].decode()) == comparable(one.out)
    with np.load(io.BytesIO(ones[".npz"])) as first, np.load(io.BytesIO(twos[".npz"])) as second:
        assert first.files == second.files
        for name in set(first.files) - {"settings"}:
            assert np.array_equal(first[name], second[name]), name


def test_a_document_per_point_says_what_was_swept(run: Run, tmp_path: Path) -> None:
    code, out, err = run("simulate", PEAK, *GRID, "--json", "--points", "5")
    documents = [json.loads(line) for line in out.splitlines()]
    assert [document["point"] for document in documents] == list(range(1, 16))
    assert documents[4]["swept"] == {"nodes.1.angle_deg": -30.0, "segments.1.length_mm": 650.0}
    assert list(documents[4])[:5] == ["curveline", "shape", "point", "swept", "tolerance_mm"]
    path = tmp_path / "point-5.toml"
    path.write_text(PEAK.read_text().replace("= 30.0", "= -30.0").replace("660.0", "650.0"))
    alone = json.loads(run("simulate", path, "--json", "--points", "5").out)
    assert documents[4]["segments"] == alone["segments"]
    without = [
        document for document in documents if not any(state["wanted"] for state in document["segments"][0]["states"])
    ]
    assert code == 1
    assert err == f"{15 - len(without)} of 15 points as asked for\n  without the wanted state: {len(without)}\n"
    assert 0 < len(without) < 15


def test_csv_and_npz_have_a_row_per_state(run: Run, tmp_path: Path) -> None:
    csv_file, npz_file = tmp_path / "sweep.csv", tmp_path / "sweep.npz"
    out = run("simulate", PEAK, *GRID, "--json", "--points", "9", "-o", csv_file, "-o", npz_file).out
    rows = list(csv.DictReader(csv_file.read_text().splitlines()))
    states = [
        (document, state)
        for document in map(json.loads, out.splitlines())
        for segment in document["segments"]
        for state in segment["states"]
    ]
    assert len(rows) == len(states)
    with np.load(npz_file, allow_pickle=False) as stored:
        arrays = {name: stored[name] for name in stored.files}
    assert arrays["swept_keys"].tolist() == ["nodes.1.angle_deg", "segments.1.length_mm"]
    assert json.loads(str(arrays["settings"]))["points"] == 9
    assert arrays["wanted"].dtype == bool
    for index, (row, (document, state)) in enumerate(zip(rows, states, strict=True)):
        assert int(row["point"]) == arrays["point"][index] == document["point"]
        for key, value in document["swept"].items():
            assert float(row[key]) == arrays[key][index] == value
        assert row["state"] == arrays["state"][index] == state["name"]
        for name in ("energy_mJ", "error_mm", "lowest_eigenvalue", "mean_height_mm"):
            assert float(row[name]) == arrays[name][index] == state[name]
        assert row["wanted"] == str(state["wanted"]).lower()
        assert [float(row["left_force_x_N"]), float(row["left_force_y_N"])] == state["clamp_force_N"][0]
        assert arrays["clamp_force_N"][index].tolist() == state["clamp_force_N"]
        assert arrays["clamp_moment_Nmm"][index].tolist() == state["clamp_moment_Nmm"]
        assert arrays["curve_mm"][index].tolist() == state["curve_mm"]


def test_the_summary_fits_on_a_screen(run: Run) -> None:
    code, out, err = run("simulate", SHAPES / "level-neutral-valley.toml", "--sweep", "nodes.2.angle_deg=-75:75:31")
    lines = out.splitlines()
    assert all(len(line) <= 80 for line in lines)
    assert len(lines) < 15
    assert "31 points" in lines[1]
    assert lines[2] == "  nodes.2.angle_deg -75 to 75 in 31 values"
    table = [line.rsplit(maxsplit=6) for line in lines[5:] if line.startswith("  ")]
    counts = [int(cells[1]) for cells in table]
    assert sum(counts) == 31
    assert "1 process, " in lines[-1]
    assert "points per second" in lines[-1]
    missing = [line for line in lines if line.startswith("without valley")]
    assert (code == 0) == (not missing)
    assert "of 31 points as asked for" in err


def test_a_bad_point_stops_a_sweep_before_it_starts(run: Run, tmp_path: Path) -> None:
    file = tmp_path / "out.csv"
    code, out, err = run("simulate", PEAK, "--sweep", "nodes.1.angle_deg=-80:0:9", "-o", file)
    assert (code, out) == (2, "")
    assert "nodes.1.angle_deg=-80" in err
    assert "(1 of 9 points cannot be used)" in err
    assert not file.exists()


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        ((PEAK, PEAK, "--sweep", ANGLE), "--sweep is for one shape, not 2"),
        ((PEAK, "--sweep", ANGLE, "-o", "out.gif"), "out.gif: cannot tell the format from the suffix '.gif'"),
        (
            (PEAK, *GRID, "--sweep", "nodes.2.angle_deg=0:10:2", "-o", "out.svg"),
            "a figure shows a sweep over one key or two, not 3",
        ),
        ((PEAK, *GRID, "--plot", "energy_mJ", "-o", "out.svg"), "over two keys the figure is a map"),
        ((PEAK, "--sweep", ANGLE, "--plot", "weight", "-o", "out.svg"), "--plot weight: states have no such number"),
        ((PEAK, "--sweep", ANGLE, "--plot", "energy_mJ", "-o", "out.csv"), "--plot is for the figure of a sweep"),
        ((PEAK, "--plot", "energy_mJ", "-o", "out.svg"), "--plot is for the figure of a sweep"),
        ((BROKEN / "many-problems.toml", "--sweep", ANGLE), "error[unknown-key]"),
        ((PEAK, "--sweep", "nodes.1.angle_deg"), "KEY=START:STOP:COUNT"),
        ((PEAK, "--jobs", "-1"), "--jobs"),
    ],
)
def test_what_cannot_be_swept_is_refused(run: Run, arguments: tuple[object, ...], words: str) -> None:
    code, out, err = run("simulate", *arguments)
    assert (code, out) == (2, "")
    assert words in err
    assert "Traceback" not in err


def test_figures_are_the_same_on_any_number_of_processes(run: Run, tmp_path: Path) -> None:
    for options in (("--sweep", ANGLE, "--plot", "energy_mJ"), GRID):
        made = []
        for jobs in (1, 2):
            figure, rows = tmp_path / f"{jobs}.svg", tmp_path / f"{jobs}.csv"
            result = run("simulate", PEAK, *options, "-o", figure, "-o", rows, "-j", jobs, "--force")
            assert f"wrote {figure}\nwrote {rows}\n" in result.err
            made.append(figure.read_text())
        assert made[0] == made[1]
    assert ">peak, valley</text>" in made[0]


def test_what_cannot_be_drawn_is_refused_before_any_point_is_looked_at(
    run: Run, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("curveline.simulation.sweep.Sweep.check", lambda *_: pytest.fail("a point was checked"))
    third = ("--sweep", "nodes.2.angle_deg=0:10:2", "-o", tmp_path / "out.png", "-o", tmp_path / "out.csv")
    code, out, err = run("simulate", PEAK, *GRID, *third)
    assert (code, out) == (2, "")
    assert "hint: give all but two of them one value, KEY=VALUE:VALUE:1, or write .csv or .npz" in err
    assert list(tmp_path.iterdir()) == []


def test_a_dead_worker_costs_its_point_and_no_more(run: Run, monkeypatch: pytest.MonkeyPatch) -> None:
    from curveline.system.workers import WorkerDied

    perform = batch.perform

    def killed(order: batch.Order, task: batch.Task) -> object:
        return (
            WorkerDied("the process that computed it was killed", "fewer") if task.number == 2 else perform(order, task)
        )

    monkeypatch.setattr(batch, "perform", killed)
    # With a model of its own every point is a task of its own.
    code, out, err = run("simulate", PEAK, "--sweep", "nodes.1.angle_deg=10:30:3", "--json", "--model", "extensible")
    assert code == 1
    documents = [json.loads(line) for line in out.splitlines()]
    assert [each["point"] for each in documents] == [1, 2, 3]
    assert [each["swept"]["nodes.1.angle_deg"] for each in documents] == [10.0, 20.0, 30.0]
    assert documents[1]["error"]["message"] == "the process that computed it was killed"
    assert "point 2, nodes.1.angle_deg=20: the process that computed it was killed" in err
    assert err.endswith("2 of 3 points as asked for\n  failed: 1\n")


def test_kernels_are_compiled_before_workers_start(run: Run, monkeypatch: pytest.MonkeyPatch) -> None:
    handed_over: list[batch.Task] = []

    class Here:
        """Workers that are none."""

        def __init__(self, function: Callable[[batch.Task], object], count: int) -> None:
            self.function = function

        def __enter__(self) -> Here:
            return self

        def __exit__(self, *error: object) -> None:
            pass

        def map(self, tasks: Iterable[batch.Task], total: int) -> Iterator[tuple[batch.Task, object]]:
            for task in tasks:
                handed_over.append(task)
                yield task, self.function(task)

    monkeypatch.setattr(readiness, "is_first_run", lambda: True)
    monkeypatch.setattr(workers, "Workers", Here)
    code, out, err = run("simulate", "none.toml", PEAK, STAGGERED, "--json", "--jobs", 2)
    assert code == 1
    assert len(out.splitlines()) == 3
    # The broken file and the first sound one were looked at before.
    assert [task.label for task in handed_over] == [str(STAGGERED)]
    assert err.index("none.toml") < err.index("compiling kernels")


@pytest.mark.parametrize(
    ("wanted", "scenes", "cores", "jobs"),
    [
        (None, 1, 8, 1),
        (None, batch.MANY - 1, 8, 1),
        (None, batch.MANY, 2, 2),
        (None, batch.MANY, 64, 4),
        (None, 10_000, 8, 8),
        (0, 3, 2, 2),
        (0, 1, 8, 1),
        (4, 10_000, 2, 4),
        (4, 2, 2, 2),
    ],
)
def test_how_many_processes(
    monkeypatch: pytest.MonkeyPatch, wanted: int | None, scenes: int, cores: int, jobs: int
) -> None:
    monkeypatch.setattr(batch, "cores", lambda: cores)
    assert batch.jobs_for(wanted, scenes) == jobs


def heed_interrupts() -> None:
    """Undo what a shell does to a job in the background: it makes it, and all that it starts, deaf to Ctrl-C."""
    signal.signal(signal.SIGINT, signal.SIG_DFL)


@contextmanager
def sweeping(folder: Path, *options: str) -> Iterator[subprocess.Popen[str]]:
    """A sweep that takes a while, on two processes, in a group of its own, from its first document on."""
    command = [sys.executable, "-m", "curveline", "simulate", str(PEAK), "--json", "--jobs", "2", *options]
    command += ["--sweep", "nodes.1.angle_deg=-60:60:60", "--sweep", "nodes.2.angle_deg=-60:60:40"]
    with subprocess.Popen(
        command,
        cwd=folder,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        start_new_session=True,
        preexec_fn=heed_interrupts,
    ) as process:
        assert process.stdout is not None
        assert json.loads(process.stdout.readline())["point"] == 1
        yield process
        deadline = time.monotonic() + LIMIT_S
        while group_lives(process.pid):
            assert time.monotonic() < deadline, "a process outlived the command"
            time.sleep(0.05)


def group_lives(group: int) -> bool:
    try:
        os.killpg(group, 0)
    except ProcessLookupError:
        return False
    return True


def test_an_interrupt_ends_all_processes_and_leaves_nothing(tmp_path: Path) -> None:
    with sweeping(tmp_path, "-o", "out.csv") as process:
        # What a terminal does at Ctrl-C.
        os.killpg(process.pid, signal.SIGINT)
        _, err = process.communicate(timeout=LIMIT_S)
    assert process.returncode == 130
    assert err == ""
    assert list(tmp_path.iterdir()) == []


def test_a_reader_that_leaves_ends_all_processes(tmp_path: Path) -> None:
    with sweeping(tmp_path) as process:
        assert process.stdout is not None
        assert process.stderr is not None
        process.stdout.close()
        err = process.stderr.read()
        process.wait(LIMIT_S)
    assert process.returncode == 1
    assert err == ""


def test_workers_do_not_outlive_a_killed_parent(tmp_path: Path) -> None:
    with sweeping(tmp_path) as process:
        process.kill()
        _, err = process.communicate(timeout=LIMIT_S)
    assert process.returncode == -signal.SIGKILL
    assert "Traceback" not in err


def test_one_shape_needs_neither_processes_nor_a_bar() -> None:
    code = (
        "import sys\nfrom curveline.cli.app import main\n"
        "try:\n    main()\nexcept SystemExit:\n    print(*sys.modules, file=sys.stderr)"
    )
    command = [sys.executable, "-c", code, "simulate", str(PEAK), "--no-drawing"]
    done = subprocess.run(command, capture_output=True, text=True, check=True)
    loaded = set(done.stderr.split())
    assert "curveline.simulation.simulate" in loaded
    assert not loaded & {"curveline.system.workers", "curveline.simulation.sweep", "multiprocessing.connection", "rich"}


class Screen(io.StringIO):
    """A terminal."""

    def isatty(self) -> bool:
        return True


@pytest.fixture
def screen_of_its_own(monkeypatch: pytest.MonkeyPatch) -> Screen:
    monkeypatch.setenv("TERM", "xterm-256color")
    monkeypatch.setattr(progress_bar, "QUIET_S", 0.0)
    monkeypatch.setattr(progress_bar, "REDRAW_S", 0.0)
    terminal.begin()
    return Screen()


def test_a_bar_is_drawn_on_a_terminal_and_gone_at_the_end(
    screen_of_its_own: Screen, monkeypatch: pytest.MonkeyPatch
) -> None:
    # Not in the fixture: pytest sets the streams anew for every phase of a test.
    monkeypatch.setattr(sys, "stderr", screen_of_its_own)
    with progress_bar.Bar("simulating", 50) as shown:
        shown.reach(20)
        told = screen_of_its_own.getvalue()
        assert "simulating  [##########..............] 20 of 50" in told
        with terminal.aside():
            # Whoever writes finds the line empty.
            assert screen_of_its_own.getvalue().endswith("\r\x1b[J")
            screen_of_its_own.write("a result\n")
        shown.reach(21)
    assert "21 of 50" in screen_of_its_own.getvalue()
    assert screen_of_its_own.getvalue().endswith("\r\x1b[J")


def test_a_bar_says_how_fast_it_goes_and_what_is_being_done(
    screen_of_its_own: Screen, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(sys, "stderr", screen_of_its_own)
    moments = iter([0.0, 10.0, 10.0, 20.0, 20.0])
    monkeypatch.setattr(progress_bar.time, "monotonic", lambda: next(moments))
    with progress_bar.Bar("measuring", 300) as shown:
        shown.detail = "by hand"
        shown.reach(100)
        shown.reach(200)
    *_, last, _ = screen_of_its_own.getvalue().split("\r\x1b[J")
    assert last == "measuring  [################........] 200 of 300  10/s  10 s to go  by hand"


@pytest.mark.parametrize("setting", ["CI", "TERM", "total", "soon"])
def test_a_bar_is_not_drawn_where_it_is_no_use(
    screen_of_its_own: Screen, monkeypatch: pytest.MonkeyPatch, setting: str
) -> None:
    monkeypatch.setattr(sys, "stderr", screen_of_its_own)
    if setting in ("CI", "TERM"):
        monkeypatch.setenv(setting, "dumb")
    if setting == "soon":
        monkeypatch.setattr(progress_bar, "QUIET_S", 60.0)
    with progress_bar.Bar("simulating", 1 if setting == "total" else 50) as shown:
        shown.reach(1)
    assert screen_of_its_own.getvalue() == ""

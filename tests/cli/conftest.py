"""Run the command line in this process, with its own folder of runs and no settings of the user's."""

from __future__ import annotations

import json
import signal
import sys
from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any, NamedTuple

import pytest

from curveline.cli.app import main
from curveline.cli.printing.progress import compiling
from curveline.drive_settings import drive_settings
from curveline.kernels import readiness
from curveline.plan_file import NodeTarget, Plan, Step, sealed, write_plan
from curveline.planning import tours
from curveline.shapes.files import read_display

SHAPES = Path(__file__).parent.parent.parent / "shapes"
BROKEN = Path(__file__).parent.parent / "broken" / "shapes"


class Result(NamedTuple):
    """What a command left behind."""

    code: int
    out: str
    err: str


Run = Callable[..., Result]

FAILURE_KEYS = {"code", "message", "hint", "exit_code", "diagnostics", "node", "cause"}


def failure(out: str, exit_code: int) -> dict[str, Any]:
    """What went wrong, as a command said it in JSON that had nothing else to say."""
    (line,) = out.splitlines()
    document = json.loads(line)
    assert set(document) == {"curveline", "error"}
    error: dict[str, Any] = document["error"]
    assert set(error) == FAILURE_KEYS
    assert error["exit_code"] == exit_code
    return error


@pytest.fixture(autouse=True, scope="session")
def _heeds_interrupts() -> None:
    """Let what the tests start hear Ctrl-C: whatever a shell starts in the background inherits that it is ignored."""
    signal.signal(signal.SIGINT, signal.default_int_handler)


Make = Callable[..., Plan]


def _once(make: Make, known: dict[object, tuple[Plan, int]]) -> Make:
    """The same function, whose answers are remembered; who listens hears of as many proven steps."""

    def remembered(of: Any, start: Any = None, shows: Any = (), tell: Callable[[], None] = lambda: None) -> Plan:
        key = (make.__name__, tuple(of) if isinstance(of, Sequence) else of, start and tuple(start), tuple(shows))
        if key not in known:
            told: list[None] = []
            plan = make(of, start, shows, lambda: told.append(tell()))  # type: ignore[func-returns-value]
            known[key] = plan, len(told)
            return plan
        plan, steps = known[key]
        for _ in range(steps):
            tell()
        return plan

    return remembered


@pytest.fixture(scope="session")
def _plans() -> dict[object, tuple[Plan, int]]:
    return {}


@pytest.fixture(autouse=True)
def _planned_once(monkeypatch: pytest.MonkeyPatch, _plans: dict[object, tuple[Plan, int]]) -> None:
    """Most tests send one of a few shapes: what they are about is the command, not how long it plans."""
    for name in ("make_tour", "make_round_trip", "make_home_plan"):
        monkeypatch.setattr(tours, name, _once(getattr(tours, name), _plans))


@pytest.fixture(autouse=True)
def _apart(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    for name in ("CURVELINE_RADIO", "CURVELINE_KEYS", "NO_COLOR", "CI"):
        monkeypatch.delenv(name, raising=False)
    monkeypatch.setenv("CURVELINE_RUNS", str(tmp_path / "runs"))
    monkeypatch.setenv("XDG_CONFIG_HOME", str(tmp_path / "no-config"))
    monkeypatch.setattr(readiness, "is_first_run", lambda: False)
    monkeypatch.setattr(compiling.Announcement, "_heard", lambda self: None)
    compiling.announce_compilation.cache_clear()


@pytest.fixture
def run(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> Run:
    def run_main(*arguments: object) -> Result:
        monkeypatch.setattr(sys, "argv", ["curveline", *map(str, arguments)])
        capsys.readouterr()
        with pytest.raises(SystemExit) as stop:
            main()
        captured = capsys.readouterr()
        assert isinstance(stop.value.code, int)
        return Result(stop.value.code, captured.out, captured.err)

    return run_main


def small_plan(steps: int = 2, seconds: float = 0.5, display: str = "single") -> Plan:
    """A plan of a few small moves for a display of two nodes, quick to send."""
    found = read_display(display)
    drive = drive_settings(found)

    def target(extrude_mm: float) -> NodeTarget:
        return NodeTarget(extrude_mm, 0.0, 0.0, (drive.axes[0].counts(extrude_mm), 0, 0))

    moves = tuple(
        Step(
            number=number,
            action="extrude",
            seconds=seconds,
            targets=(target(number), target(-number)),
            lengths_mm=(500.0 + 2 * number,),
            states=("peak|valley",),
            lowest_eigenvalue=1.0,
            margin=1.0,
            margin_of="nothing: a test",
            max_strain=0.01,
            max_force_N=1.0,
            max_moment_Nmm=1.0,
        )
        for number in range(1, steps + 1)
    )
    provenance = {"display": found.path or found.name}
    plan = Plan("small", drive, (target(0.0),) * 2, moves, ("valley",), moves[-1].lengths_mm, provenance=provenance)
    return promising(plan, "valley")


def promising(plan: Plan, *states: str) -> Plan:
    """The same plan with `states` after its last step, sealed as if that had been proven."""
    last = replace(plan.steps[-1], states=states)
    return sealed(replace(plan, steps=(*plan.steps[:-1], last), wanted=states, lengths_mm=last.lengths_mm))


@pytest.fixture
def plan_file(tmp_path: Path) -> Path:
    path = tmp_path / "small.json"
    write_plan(small_plan(), path)
    return path


@pytest.fixture
def no_valley(tmp_path: Path) -> Path:
    """A shape whose rod has but one stable state, which is not the one it asks for."""
    path = tmp_path / "no-valley.toml"
    path.write_text(
        'name = "no-valley"\ndisplay = "single"\n'
        "nodes = [ { height_mm = 0.0, angle_deg = 50.0 }, { height_mm = 0.0, angle_deg = -50.0 } ]\n"
        'segments = [ { length_mm = 560.0, state = "valley" } ]\n'
    )
    return path

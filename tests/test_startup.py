"""What a command loads: the commands of the small computer at the display stay without numpy and its like."""

from __future__ import annotations

import json
import os
import subprocess
import sys
import textwrap
from pathlib import Path
from typing import NamedTuple

import pytest

import curveline
from curveline.drive_settings import drive_settings
from curveline.plan_file import NodeTarget, Plan, Step, sealed, write_plan
from curveline.shapes.files import read_display

HEAVY = {"numpy", "numba", "scipy", "matplotlib", "cv2", "serial", "pyrf24", "PIL", "ezdxf", "svgelements", "trimesh"}
COMMANDS = ("simulate", "plan", "send", "status", "stop", "runs", "load", "keys", "bench", "shapes", "new")

SCRIPT = """
import json, sys
import curveline.radio.interface
curveline.radio.interface.BACK_ENDS["wire"] = "wire"
sys.argv = ["curveline", *json.loads(sys.argv[1])]
from curveline.cli.app import main
try:
    main()
except SystemExit as stop:
    code = stop.code
sys.stderr.write("\\n" + json.dumps([code, sorted({name.split(".")[0] for name in sys.modules})]))
"""

WIRE = '''
"""A radio that is no mock as far as the command line can tell: it only carries frames."""

from curveline.radio.mock.display import open_radio as open_mock


class Wire:
    def __init__(self, mock):
        self._mock = mock
        self.site = mock.site

    retries = 0
    modelled = None

    def __getattr__(self, name):
        return getattr(object.__getattribute__(self, "_mock"), name)


def open_radio(settings, drive, runs):
    return Wire(open_mock(settings, drive, runs))
'''


class Loaded(NamedTuple):
    """How a command ended, what it printed, and which packages it had loaded by then."""

    code: int
    out: str
    packages: set[str]


@pytest.fixture
def load(tmp_path: Path):
    (tmp_path / "wire.py").write_text(textwrap.dedent(WIRE))

    def run(*arguments: str) -> Loaded:
        # This tree, whichever other one is installed.
        paths = os.pathsep.join([str(tmp_path), str(Path(curveline.__file__).parents[1])])
        environment = {**os.environ, "CURVELINE_RUNS": str(tmp_path / "runs"), "PYTHONPATH": paths}
        environment.pop("CURVELINE_RADIO", None)
        command = [sys.executable, "-c", SCRIPT, json.dumps(arguments)]
        done = subprocess.run(command, env=environment, cwd=tmp_path, capture_output=True, text=True, check=True)
        code, packages = json.loads(done.stderr.splitlines()[-1])
        return Loaded(code, done.stdout, set(packages))

    return run


def short_plan() -> Plan:
    drive = drive_settings(read_display("single"))
    home = NodeTarget(0.0, 0.0, 0.0, (0, 0, 0))
    there = NodeTarget(1.0, 0.0, 0.0, (drive.axes[0].counts(1.0), 0, 0))
    step = Step(1, "extrude", 0.3, (there, there), (500.0,), ("valley",), 1.0, 1.0, "a test", 0.0, 0.0, 0.0)
    plan = Plan("short", drive, (home, home), (step,), ("valley",), (500.0,), provenance={"display": "single"})
    return sealed(plan)


@pytest.mark.parametrize("arguments", [("--help",), ("--version",), *((command, "--help") for command in COMMANDS)])
def test_help_loads_nothing_heavy(load, arguments: tuple[str, ...]) -> None:
    loaded = load(*arguments)
    assert loaded.code == 0
    assert not loaded.packages & HEAVY


def test_top_level_help_loads_neither_tables_nor_validation(load) -> None:
    assert not load("--help").packages & {"pydantic", "rich"}


def test_scan_and_stop_load_nothing_heavy(load) -> None:
    for arguments in (("status", "--scan"), ("status", "--radio-test"), ("stop",)):
        loaded = load(*arguments, "--radio", "mock", "--json")
        assert loaded.code == 0
        assert len(json.loads(loaded.out)["nodes"]) == 2
        assert not loaded.packages & HEAVY


@pytest.mark.parametrize("radio", ["mock", "wire"])
def test_status_loads_nothing_heavy(load, radio: str) -> None:
    loaded = load("status", "--radio", radio, "--json")
    assert loaded.code == 0
    assert len(json.loads(loaded.out)["nodes"]) == 2
    assert not loaded.packages & HEAVY


def test_sending_a_plan_over_a_radio_loads_nothing_heavy(load, tmp_path: Path) -> None:
    write_plan(short_plan(), tmp_path / "plan.json")
    loaded = load("send", "plan.json", "--radio", "wire", "--yes", "--json")
    assert loaded.code == 0
    document = json.loads(loaded.out)
    assert (document["outcome"], document["rod"]) == ("done", None)
    assert not loaded.packages & HEAVY


def test_a_dry_run_of_a_plan_loads_nothing_heavy(load, tmp_path: Path) -> None:
    write_plan(short_plan(), tmp_path / "plan.json")
    loaded = load("send", "plan.json", "--dry-run")
    assert loaded.code == 0
    assert not loaded.packages & HEAVY


def test_importing_the_package_loads_nothing() -> None:
    code = "import sys; before = set(sys.modules); import curveline; print(*(set(sys.modules) - before))"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    names = done.stdout.split()
    assert "curveline" in names
    ours = {name for name in names if name.startswith("curveline.")}
    assert ours <= {"curveline._version"}
    assert not {name.split(".")[0] for name in names} & HEAVY

"""The commands on macOS and on Windows, as far as Linux can imitate these: see `imitation/sitecustomize.py`."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import time
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import NamedTuple

import pytest

import standby
from campaign import only
from cli.conftest import SHAPES, small_plan
from curveline.drive_settings import drive_settings
from curveline.plan_file import read_plan, write_plan
from curveline.radio.host.journal import read_journal
from curveline.radio.site.key_file import read_site
from curveline.shapes.files import read_display
from radio.dongle_host import DongleHost, Room, dongle_host, write_keys

IMITATION = Path(__file__).parent / "imitation"
SHAPE = SHAPES / "level-up-peak.toml"
DRIVE = drive_settings(read_display("single"))
LIMIT_S = 120.0
BREAK = 21
"""What Windows sends to the programs of a console that is closed, under the number that it has there."""


class Result(NamedTuple):
    """What a command left behind."""

    code: int
    out: str
    err: str


class Computer:
    """Another system, with a home of its own in `folder`."""

    def __init__(self, system: str, folder: Path) -> None:
        self.system = system
        self.folder = folder
        self.runs = folder / "runs"
        self.keys = folder / "keys" / "site.json"
        inherited = os.environ.get("PYTHONPATH")
        self.environment = {
            **os.environ,
            "PYTHONPATH": os.pathsep.join([str(IMITATION), *([inherited] if inherited else [])]),
            "IMITATED": system,
            "CURVELINE_RUNS": str(self.runs),
            "CURVELINE_KEYS": str(self.keys),
        }

    def begin(self, *command: object, interpreter: Sequence[str] = (sys.executable,)) -> subprocess.Popen[str]:
        """A process of Python there."""
        return subprocess.Popen(
            [*interpreter, *map(str, command)],
            cwd=self.folder,
            env=self.environment,
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
        )

    def python(self, *command: object, interpreter: Sequence[str] = (sys.executable,)) -> Result:
        """What such a process comes to."""
        with self.begin(*command, interpreter=interpreter) as process:
            out, err = process.communicate(timeout=LIMIT_S)
        assert "Traceback" not in err, err
        return Result(process.returncode, out, err)

    def run(self, *arguments: object) -> Result:
        """What a command comes to."""
        return self.python("-m", "curveline", *arguments, interpreter=standby.python(self.environment))

    def journals(self) -> list[list[str]]:
        """The kinds of records of every run, as Linux reads them."""
        return [[str(each["type"]) for each in read_journal(path)] for path in sorted(self.runs.glob("*/journal"))]


@pytest.fixture(params=["darwin", "win32"])
def there(request: pytest.FixtureRequest, tmp_path: Path) -> Computer:
    return Computer(request.param, tmp_path)


LONG = pytest.mark.parametrize("there", ["win32", *only(["darwin"])], indirect=True)
"""Takes seconds, and nothing that the shorter tests do not hold is macOS' own in it."""

PROBE = """
import os, sys
look = '''
import errno, os, signal, sys, time
try:
    import fcntl
    has_fcntl = True
except ImportError:
    has_fcntl = False
names = ["os.posix_fallocate", "os.sched_getaffinity", "os.pwrite", "os.O_NONBLOCK", "signal.SIGHUP",
         "signal.pthread_sigmask", "time.CLOCK_BOOTTIME", "time.clock_gettime", "os.replace"]
seen = [name for name in names if hasattr(globals()[name.split(".")[0]], name.split(".")[1])]
print(sys.platform, has_fcntl, *seen)
'''
exec(look, {"__name__": "curveline.probe"})
exec(look, {"__name__": "numba.probe"})
"""


def test_what_is_imitated(there: Computer) -> None:
    seen, really = there.python("-c", PROBE).out.splitlines()
    some = "os.pwrite os.O_NONBLOCK signal.SIGHUP signal.pthread_sigmask time.clock_gettime os.replace"
    assert seen == {"darwin": f"darwin True {some}", "win32": "win32 False os.replace"}[there.system]
    assert really.startswith("linux True os.posix_fallocate")
    assert len(really.split()) == 11


def test_a_shape_is_simulated(there: Computer) -> None:
    code, out, err = there.run("simulate", SHAPE, "--json", "-o", "peak.csv")
    assert code == 0, err
    assert [state["name"] for state in json.loads(out)["segments"][0]["states"]] == ["peak", "valley"]
    assert (there.folder / "peak.csv").read_bytes().count(b"\n") > 100
    assert not list(there.folder.glob(".*"))


def test_half_a_file_leaves_nothing(there: Computer) -> None:
    code = """
from curveline.system.files import NewFile
try:
    with NewFile("peak.csv") as file:
        file.write(b"half")
        raise KeyError
except KeyError:
    pass
"""
    before = sorted(there.folder.iterdir())
    there.python("-c", code)
    assert sorted(there.folder.iterdir()) == before


@LONG
def test_a_sweep_takes_several_processes(there: Computer) -> None:
    code, out, err = there.run("simulate", SHAPE, "--sweep", "nodes.1.angle_deg=-30:30:5", "--jobs", 2, "--json")
    assert (code, len(out.splitlines())) == (0, 5), err
    assert "5 of 5 points" in err


@LONG
def test_a_shape_is_pushed(there: Computer) -> None:
    code, out, err = there.run("load", SHAPE, "--at", 0.35, "--json")
    assert code == 0, err
    assert json.loads(out)["snap_through_N"] > 0


@LONG
def test_a_plan_is_made_sent_and_the_display_goes_home(there: Computer) -> None:
    code, _, err = there.run("plan", SHAPE, "-o", "plan.json")
    assert code == 0, err
    assert read_plan(there.folder / "plan.json").name == "level-up-peak"
    code, out, err = there.run("send", "plan.json", "--radio", "mock:fresh", "--yes", "--json")
    assert (code, json.loads(out)["rod"]["states"]) == (0, ["peak"]), err
    code, _, err = there.run("send", "--home", "--radio", "mock", "--yes")
    assert code == 0, err
    assert [kinds[0] + kinds[-1] for kinds in there.journals()] == ["startend", "startend"]
    code, out, _ = there.run("status", "--radio", "mock", "--json")
    assert (code, json.loads(out)["rod"]) == (0, ["straight"])
    code, out, _ = there.run("stop", "--radio", "mock")
    assert (code, out.count("stands (hold)")) == (0, 2)
    assert there.run("send", "--resume", "last", "--radio", "mock", "--yes").code == 2


@LONG
def test_a_fault_is_cleared_a_node_homed_and_the_run_told_and_gone_on_with(there: Computer) -> None:
    assert there.run("send", SHAPE, "--radio", "mock:fresh,stall=1@step2", "--yes").code == 3
    assert there.run("node", "status", "1", "--radio", "mock").code == 3
    assert there.run("node", "clear", "1", "--radio", "mock").code == 0
    code, out, _ = there.run("runs")
    assert (code, "to go on: curveline send --resume" in out) == (0, True)
    assert there.run("send", "--resume", "last", "--radio", "mock", "--yes").code == 0
    assert there.run("runs", "show", "last", "--json").code == 0
    assert there.run("node", "home", "1", "--radio", "mock:unhomed=1", "--yes").code == 0


def test_keys_are_made_shown_and_adopted(there: Computer) -> None:
    code, out, err = there.run("keys", "new")
    assert code == 0, err
    site = read_site(there.keys)
    assert site.fingerprint in out
    assert b"\r" not in there.keys.read_bytes()
    assert there.run("keys", "new").code == 2
    assert there.run("keys", "adopt", "--radio", "mock:keys", "--yes").code == 0
    assert len(read_site(there.keys).chips) == 2
    assert there.run("keys", "show").out.count("C1C1C1C1") == 2
    assert there.run("status", "--radio", "mock:keys").code == 0
    assert [each.name for each in there.keys.parent.iterdir()] == ["site.json"]


def test_who_may_read_a_key_file_is_asked_where_modes_tell(there: Computer) -> None:
    there.run("keys", "new")
    there.keys.chmod(0o644)
    assert there.run("keys", "show").code == {"darwin": 2, "win32": 0}[there.system]


@pytest.fixture
def sending(there: Computer) -> Iterator[subprocess.Popen[str]]:
    """A send that is in its first step of three."""
    write_plan(small_plan(steps=3, seconds=1.5), there.folder / "plan.json")
    with there.begin("-m", "curveline", "send", "plan.json", "--radio", "mock:realtime", "--yes") as process:
        assert process.stderr is not None
        while "step 1 of 3" not in (line := process.stderr.readline()):
            assert line, "it has ended"
        yield process
        process.kill()


def test_the_keyboard_pauses_a_run_which_then_goes_on(there: Computer, sending: subprocess.Popen[str]) -> None:
    sending.send_signal(signal.SIGINT)
    assert sending.stderr is not None
    err = sending.stderr.read()
    assert (sending.wait(), "pausing at the barrier" in err) == (130, True), err
    assert "Traceback" not in err
    code, _, err = there.run("send", "--resume", "last", "--radio", "mock", "--yes")
    assert code in (0, 1), "the rod need not take the curve that this plan does not aim at"
    (kinds,) = there.journals()
    assert (kinds.count("barrier"), kinds[-1]) == (3, "end"), err


def test_a_console_that_is_closed_pauses_a_run(there: Computer, sending: subprocess.Popen[str]) -> None:
    sending.send_signal({"darwin": signal.SIGHUP, "win32": BREAK}[there.system])
    assert sending.wait(LIMIT_S) == 130
    assert there.journals()[0][-1] == "pause"


def test_a_run_has_one_host_until_that_is_killed(there: Computer, sending: subprocess.Popen[str]) -> None:
    (run,) = (path.parent for path in there.runs.glob("*/journal"))
    code, _, err = there.run("send", "--resume", run, "--radio", "mock:seed=1", "--yes")
    assert (code, f"another process is sending the run {run.name}" in err) == (3, True), err
    sending.kill()
    sending.wait()
    code, _, err = there.run("send", "--resume", "last", "--radio", "mock", "--yes")
    assert code in (0, 1), err
    assert there.journals()[0][-1] == "end"


HOLD = """
import sys
from pathlib import Path
from curveline.drive_settings import drive_settings
from curveline.radio.mock import store
from curveline.shapes.files import read_display
store.LOCK_WAIT_S = 0.2
mine = store.Store(Path(sys.argv[1]), drive_settings(read_display("single")))
try:
    mine.open()
except store.InUse as error:
    print(error.message)
else:
    print("mine", flush=True)
    sys.stdin.read()
"""


def test_who_has_a_mock_display_is_named_until_it_is_killed(there: Computer) -> None:
    arguments = ("-c", HOLD, there.runs)
    there.environment["PYTHONUNBUFFERED"] = "1"
    with subprocess.Popen(
        [sys.executable, *map(str, arguments)],
        env=there.environment,
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        text=True,
    ) as first:
        assert first.stdout is not None
        assert first.stdout.readline() == "mine\n"
        said = there.python(*arguments).out
        assert f"'single' is in use by process {first.pid} (-c): a run may be on" in said
        first.kill()
    with there.begin(*arguments) as last:
        assert last.stdout is not None
        assert last.stdout.readline() == "mine\n"
        last.kill()


@pytest.fixture
def dongle(there: Computer) -> Iterator[DongleHost]:
    there.keys.parent.mkdir()
    with dongle_host(there.folder / "dongle", Room(DRIVE, write_keys(there.keys, DRIVE))) as host:
        yield host


def test_a_plan_goes_through_a_dongle(there: Computer, dongle: DongleHost) -> None:
    plan = small_plan()
    write_plan(plan, there.folder / "plan.json")
    radio = ("--radio", f"serial:{dongle.path}")
    code, out, err = there.run("send", "plan.json", *radio, "--yes")
    assert (code, "done: 2 of 2 steps" in out) == (0, True), err
    assert dongle.room.positions() == [target.counts for target in plan.steps[-1].targets]
    assert there.run("status", *radio).code == 0
    assert there.run("stop", *radio).code == 0
    code, _, err = there.run("status", "--radio", f"serial:{there.folder / 'nothing'}")
    assert (code, "there is no port" in err) == (3, True), err


def test_a_chip_on_a_bus_needs_linux(there: Computer) -> None:
    code, _, err = there.run("status", "--radio", "nrf24:22,0")
    assert (code, "needs the SPI bus of a Linux board" in err) == (2, True)
    assert "serial:PORT" in err


def test_room_for_a_record_is_made_by_hand_where_no_call_makes_it(there: Computer) -> None:
    code = """
import os, sys
from pathlib import Path
from curveline.radio.host.journal import Journal
journal = Journal(Path(sys.argv[1]))
journal.append({"type": "start"})
journal.reserve(200_000)
print(journal.path.stat().st_size)
journal.append({"type": "end"})
journal.close()
print(journal.path.stat().st_size)
"""
    there.runs.mkdir()
    reserved, left = map(int, there.python("-c", code, there.runs).out.split())
    assert reserved > 200_000
    assert left < 200
    assert [each["type"] for each in read_journal(there.runs / "journal")] == ["start", "end"]


def test_a_record_is_forced_to_the_medium_as_the_system_wants_it(there: Computer) -> None:
    code = """
import os, sys
from pathlib import Path
from curveline.radio.host.journal import Journal
synced = []
really = os.fsync
os.fsync = lambda descriptor: (synced.append(sys._getframe(1).f_code.co_name), really(descriptor))[1]
Journal(Path(sys.argv[1])).append({"type": "start"})
print(*synced)
"""
    there.runs.mkdir()
    names = there.python("-c", code, there.runs).out.split()
    assert names == {"darwin": ["full_sync", "sync_folder", "full_sync"], "win32": ["sync", "sync"]}[there.system]


def test_waiting_for_a_scanner_ends() -> None:
    """What another program never lets go is an error after a while, not a hang."""
    code = """
import os, time
from pathlib import Path
from curveline.system import portable
waited = []
time.sleep = waited.append
def refuse(*paths):
    raise PermissionError(13, "in use")
os.replace = refuse
portable.IS_WINDOWS = True
try:
    portable.replace(Path("a"), Path("b"))
except PermissionError:
    print(sum(waited))
"""
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert 1.0 < float(done.stdout) < 3.0


def test_time_goes_on(there: Computer) -> None:
    code = """
import time
from curveline.radio.clock import steady_us
begin = steady_us()
time.sleep(0.05)
print(steady_us() - begin)
"""
    begin = time.monotonic()
    passed = int(there.python("-c", code).out)
    assert 50_000 <= passed <= 1e6 * (time.monotonic() - begin)

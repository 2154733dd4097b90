"""Nobody is ever stuck: from every fault of the mock to a display that shows the next shape, by what hints print."""

from __future__ import annotations

import re
from dataclasses import dataclass, field
from pathlib import Path

import pytest

from campaign import only
from curveline.radio.host.stop_causes import Cause
from curveline.radio.mock.fault_injection import MISHAPS

from .conftest import SHAPES, Result, Run

FIRST, NEXT = SHAPES / "level-down-peak.toml", SHAPES / "level-up-valley.toml"
ROUNDS = 5
"""Sends of the next shape at most, with what their refusals advise between them."""
FAULTS = (
    *("stall=1@step2", "encoder=2@step1", "runaway=1@step3", "driver=2@step2", "brownout=1@step2", "reboot=2@step3"),
    *("reboot=1@step5", "off=1@step2", "silence=2@step2", "taken=1@step2", "jam@step2", "reset@step2", "gone@step2"),
    *("replug@step2", "sleep@step2", "stop@step2", "disk=full@step2", "unhomed=2", "unhomed=1,unhomed=2"),
    *(
        "absent=translate@1,unhomed=1",
        "absent=extrude@2",
        "estop=1",
        "version=2",
        "config=1",
        "chip=2",
        "chip=1,twin=1",
    ),
    *("reversed=extrude@1", "swapped=bias@2", "noisy=extrude@1", "loose=extrude@2", "key=2", "channel=1"),
    *("firmware=1", "noloader=1", "gear=bias@1", "switch=translate@2", "open=translate@1", "supply=1", "away=2"),
    *("busy=1", "clone=2", "stranger=0.5", "replay=0.5", "cut=1@word3"),
)
MOVES = ("send", "node home", "node settings")


@dataclass
class Walk:
    """A person who types what the hints print, and nothing else; `typed` is what was typed."""

    run: Run
    typed: list[str] = field(default_factory=list)

    def type(self, command: str) -> Result:
        """A command as printed, with --yes where it would ask."""
        self.typed.append(command)
        asks = ["--yes"] * command.startswith(MOVES)
        return self.run(*command.split(), *asks)

    def follow(self, result: Result) -> None:
        """Everything that a command advised, in order."""
        for command in advised(result.err):
            assert "Traceback" not in self.type(command).err

    def walk(self, begun: Result) -> str:
        """Send the next shape until it is there; why not, if it never is."""
        self.follow(begun)
        for _ in range(ROUNDS):
            sent = self.run("send", NEXT, "--yes")
            if sent.code == 0:
                return ""
            assert advised(sent.err), f"a refusal without a way out: {sent.err}"
            self.follow(sent)
        return f"still stuck after {self.typed}: {sent.err}"


def advised(text: str) -> list[str]:
    """The commands that a text advises; offers to go on with a run stand without marks."""
    found = re.findall(r"`curveline ([^`]*)`", " ".join(text.split()))
    return list(dict.fromkeys(each for each in found if "PORT" not in each and not each.startswith("keys")))


@pytest.fixture
def walk(run: Run, monkeypatch: pytest.MonkeyPatch) -> Walk:
    monkeypatch.setenv("CURVELINE_RADIO", "mock")
    return Walk(run)


def test_every_fault_of_the_mock_is_walked_out_of() -> None:
    walked = {re.split("[=@]", part)[0] for fault in FAULTS for part in fault.split(",")}
    assert walked == set(MISHAPS)


@pytest.mark.parametrize("fault", FAULTS)
def test_the_hints_lead_from_a_fault_to_the_next_shape(walk: Walk, fault: str) -> None:
    begun = walk.run("send", FIRST, "--radio", f"mock:fresh,{fault}", "--yes")
    assert walk.walk(begun) == ""
    assert walk.run("status").code == 0


@pytest.mark.parametrize("fault", [*FAULTS[::3], *only(each for each in FAULTS if each not in FAULTS[::3])])
def test_nor_does_trying_to_go_home_or_to_go_on_in_between_lead_into_a_circle(walk: Walk, fault: str) -> None:
    walk.run("send", FIRST, "--radio", f"mock:fresh,{fault}", "--yes")
    walk.run("send", "--home", "--yes")
    again = walk.run("send", "--resume", "last", "--yes")
    assert walk.walk(again) == ""


@pytest.mark.parametrize("fault", ["stall=1@step2", "driver=2@step2", "silence=2@step2", "stop@step2", "sleep@step2"])
def test_a_refused_send_destroys_nothing_that_an_earlier_run_needs(run: Run, fault: str) -> None:
    """A plan from elsewhere, and a way home that the fault forbids: then the run goes on."""
    plan = run("plan", NEXT, "-o", "-")
    assert plan.code == 0
    begun = run("send", FIRST, "--radio", f"mock:fresh,{fault}", "--yes")
    assert begun.code == 3
    path = Path(begun.err.partition("record: ")[2].partition("\n")[0]) / "elsewhere.json"
    path.write_text(plan.out)
    refused = run("send", path, "--radio", "mock", "--yes")
    assert refused.code in (1, 3)
    gone_on = run("send", "--resume", "last", "--radio", "mock", "--yes")
    assert gone_on.code == 0, gone_on.err
    assert "5 of 5 steps" in gone_on.out


def test_a_motor_that_was_absent_has_a_way_out_too(walk: Walk) -> None:
    walk.run("status", "--radio", "mock:fresh,unhomed=1")
    absent = walk.run("node", "home", "1", "--radio", "mock:absent=bias@1", "--yes")
    assert absent.code == 3
    assert "bias: not homed: no counts came from it" in absent.out
    assert "extrude: 0.00 mm" in absent.out
    assert walk.walk(absent) == ""


@pytest.mark.parametrize("cause", Cause, ids=lambda cause: cause.name)
def test_every_cause_says_what_to_do_next(cause: Cause) -> None:
    """A command, or to go on, or to send again: never only what is wrong."""
    assert re.search(r"`curveline |--takeover|resume|resumed|send|flash|write the|plug|free space|switch", cause.hint)
    assert all(name in ("node", "display", "channel") for name in re.findall(r"\{(\w+)\}", cause.hint))

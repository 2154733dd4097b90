"""Mistakes built into the real node and host: a simulation finds every one, and an invariant gives it its name."""

from __future__ import annotations

from dataclasses import dataclass

import pytest

from .mutants import Mistake, mutant, with_body
from .scenarios import SCENARIOS
from .test_simulation import RUNS
from .watched import Broken, Watched

SEEDS = {**RUNS, "filtered": 1}
"""How many seeds of its scenario a mistake may meet before it is found: those of every time."""


@dataclass(frozen=True)
class Trial:
    """A mistake, the scenario that is to find it, and how the message then begins."""

    mistake: Mistake
    scenario: str
    caught: str


def trial(name: str, where: tuple[str, str, str], scenario: str, caught: str) -> Trial:
    """One row of the table below."""
    return Trial(Mistake(name, *where), scenario, caught)


TRIALS = (
    trial(
        "a hold does not keep a node from moving",
        ("node.body", "return not (self._silent or self._stopped or session.hold_gen & 1)", "return True"),
        "paused",
        "I3",
    ),
    trial(
        "release is an edge",
        (
            "node.machine",
            "session.release = max(session.release, frame.release)",
            "session.release = 65535 * (frame.release > 0)",
        ),
        "lossy",
        "I4",
    ),
    trial("a counter is not checked", ("node.machine", "counter <= session.counter or", ""), "haunted", "I6"),
    trial(
        "the dead-man does not brake",
        (
            "node.body",
            "self._lift_above = self._session.hold_gen\n            self._halt(now_ms)",
            "self._lift_above = self._session.hold_gen",
        ),
        "silenced",
        "I8",
    ),
    trial(
        "being heard again lifts the dead-man",
        (
            "node.machine",
            "session.counter = counter\n        return",
            "session.counter, self._silent = counter, False\n        return",
        ),
        "withheld",
        "I3",
    ),
    trial(
        "another target for a staged step is taken",
        (
            "node.machine",
            "memory.next_target, memory.next_ms):\n                self._fail(now_ms, Fault.CONFLICT, 0)",
            "memory.next_target, memory.next_ms):\n                memory.next_target = frame.target",
        ),
        "misled",
        "I2",
    ),
    trial(
        "a target is used as soon as it is staged",
        (
            "node.machine",
            "memory.next_target, memory.next_ms = frame.target, frame.move_ms",
            "memory.target = memory.next_target = frame.target",
        ),
        "lossy",
        "I10",
    ),
    trial(
        "a resumed session begins from nothing",
        ("node.machine", "session.owns_run = bool(flags & FLAG_RESUME)", "session.owns_run = False"),
        "killed",
        "I10",
    ),
    trial(
        "a session key without the node's nonce",
        ("protocol.keys", "*numbers, run_tag", "run_tag"),
        "haunted",
        "I6",
    ),
    trial(
        "frames never grow old",
        ("node.machine", "now_ms >= said_ms + session.hello.deadman_ms", "False"),
        "withheld",
        "I8",
    ),
    trial(
        "the dead-man is fed by a frame's arrival, not by what its host had heard",
        ("node.machine", "session.heard_ms = max(session.heard_ms, said_ms)", "session.heard_ms = now_ms"),
        "withheld",
        "I8",
    ),
    trial(
        "a run is forgotten as soon as another host looks in",
        (
            "node.machine",
            "if not session.owns_run:\n            self._silent",
            "if not session.owns_run:\n            self._begin_run(session)\n            self._silent",
        ),
        "visited",
        "I10",
    ),
    trial(
        "a step is released before its record",
        (
            "host.conductor",
            'self._write({"type": "release", "step": self.step}, self._release)',
            "self._release(now_ms)",
        ),
        "lossy",
        "I4",
    ),
    trial(
        "the barrier asks one node only",
        (
            "host.conductor",
            "late = [peer for peer in self.peers if peer.finished < self.step]",
            "late = [peer for peer in self.peers[:1] if peer.finished < self.step]",
        ),
        "lossy",
        "I1",
    ),
    trial(
        "the barrier asks for started, not finished",
        ("host.conductor", "if peer.finished < self.step]", "if peer.started < self.step]"),
        "lossy",
        "I1",
    ),
    trial(
        "a resumed run leaves a step out",
        (
            "host.conductor",
            "self.step = 1 if resume is None else resume.barrier + 1",
            "self.step = 1 if resume is None else resume.released + 1",
        ),
        "killed",
        "I10",
    ),
    trial(
        "a restart is not noticed",
        ("host.conductor", "elif ident.boot != peer.boot:", "elif ident.boot < 0:"),
        "restarted",
        "I2",
    ),
    trial(
        "a pause is believed without an answer to it",
        ("host.conductor", "status.echo < peer.mark:", "status.echo < 0:"),
        "paused",
        "I3",
    ),
    trial(
        "the newest answer wins, however old its facts",
        ("host.peer", "self.started = max(self.started, status.started)", "self.started = status.started"),
        "lossy",
        "I4",
    ),
    trial(
        "a handshake is repeated bit by bit",
        ("host.peer", "(self.nonce + 1 & ATTEMPT_MASK)", "(self.nonce & ATTEMPT_MASK)"),
        "filtered",
        "I10",
    ),
    trial(
        "a poll is repeated bit by bit",
        (
            "host.peer",
            "self.counter += 1\n        step, target",
            "self.counter = max(self.counter, 1)\n        step, target",
        ),
        "lossy",
        "I10",
    ),
)


def bench_with(mistake: Mistake) -> type[Watched]:
    """A bench whose nodes and host are made with the mistake."""
    module = mutant(mistake)

    class Mistaken(Watched):
        pass

    if mistake.module == "node.machine":
        Mistaken.node_class = module.NodeMachine
    elif mistake.module == "node.body":
        Mistaken.node_class = with_body(module)
    elif mistake.module == "host.conductor":
        Mistaken.host_class = module.Conductor
    else:
        _rebuild(Mistaken, mistake.module, vars(module))
    return Mistaken


def _rebuild(bench: type[Watched], name: str, names: dict[str, object]) -> None:
    """Host and node once more, with what they import from the module of the mistake."""
    node, peer, conductor = (
        mutant(Mistake("", module, "from __future__", "from __future__"))
        for module in ("node.machine", "host.peer", "host.conductor")
    )
    if name == "protocol.keys":
        node.session_key = peer.session_key = names["session_key"]
        conductor.Peer = peer.Peer
    else:
        conductor.Peer = names["Peer"]
    bench.node_class, bench.host_class = node.NodeMachine, conductor.Conductor


@pytest.mark.parametrize("trial", TRIALS, ids=lambda trial: trial.mistake.name)
def test_a_mistake_is_found_by_simulation(trial: Trial) -> None:
    bench = bench_with(trial.mistake)
    for seed in range(SEEDS[trial.scenario]):
        message = broken_by(trial.scenario, seed, bench)
        if message:
            break
    print(f"{trial.mistake.name}: {message} ({trial.scenario} {seed})")
    assert message.startswith(trial.caught), f"{seed + 1} seeds of {trial.scenario} find {message!r}"
    assert message


def broken_by(scenario: str, seed: int, bench: type[Watched]) -> str:
    """How a scenario fails; empty if it does not."""
    try:
        SCENARIOS[scenario](seed, bench)
    except Broken as broken:
        return str(broken)
    return ""

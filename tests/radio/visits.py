"""Seeded runs into which somebody else comes: an eavesdropper who keeps frames back, and a host that is refused."""

from __future__ import annotations

from dataclasses import replace

from curveline.errors import InvalidInput
from curveline.radio.host.actions import Phase, Send
from curveline.radio.host.stop_causes import Cause

from .watched import Watched, require

HOLD_MS = 50
"""How much later than its dead-man time a node may begin to brake."""
KEPT_MS = (200, 500, 900)
"""How often an eavesdropper delivers a frame: often enough to keep a dead-man fed that takes any frame."""
OUT_OF_THE_WAY = (100_000, 0, 0)


def keep_back(bench: Watched) -> None:
    """Jam all frames for a while and keep them; the host falls silent, and one by one they come after all.

    Every third time what is kept is the end of a pause.
    """
    bench.run_for(bench.random.randrange(3000))
    if bench.random.random() < 0.3 and bench.conductor.phase in (Phase.STAGING, Phase.RELEASED):
        bench.conductor.hold(bench.now_ms)
        bench.run(lambda: bench.conductor.phase is Phase.PAUSED)
    kept = _jammed(bench, bench.random.randrange(900))
    silent_ms = bench.now_ms
    departures = list(bench.departures)
    deadman_ms = bench.conductor._pace.deadman_ms
    alone_ms = min(node._session.expires_ms for node in bench.nodes if node._session is not None)
    begin_ms = bench.random.choice((silent_ms, silent_ms + 2 * deadman_ms, *2 * (max(silent_ms, alone_ms + 1),)))
    every_ms = bench.random.choice(KEPT_MS)
    alone: dict[int, int] = {}
    for number, send in enumerate(kept):
        now_ms = begin_ms + number // len(bench.nodes) * every_ms
        node = bench.nodes[send.node - 1]
        node.advance(now_ms)
        if node._silent and not bench.conductor._hold_gen:
            alone.setdefault(send.node - 1, bench.departures[send.node - 1])
        node.receive(now_ms, send.payload)
        moves = node.move is not None and node.move.brake_ms is None
        require(not moves or now_ms <= silent_ms + deadman_ms + HOLD_MS, "I8: frames that were kept back move a node")
        went = [index for index, count in alone.items() if bench.departures[index] > count]
        require(not went, "I3: being heard again lifts the dead-man")
        bench.now_us = max(bench.now_us, 1000 * now_ms)
        if now_ms > silent_ms + deadman_ms:
            require(bench.departures[send.node - 1] - departures[send.node - 1] <= 1, "I8: a node sets off in silence")


def _jammed(bench: Watched, duration_ms: int) -> list[Send]:
    """What the host sends meanwhile, and nobody hears."""
    kept: list[Send] = []
    keep = kept.append
    bench.hooks.append(keep)
    bench.deaf.update(range(len(bench.nodes)))
    bench.conductor.resume(bench.now_ms)
    bench.run_for(duration_ms)
    bench.hooks.remove(keep)
    bench.deaf.clear()
    return kept


def look_in(bench: Watched) -> None:
    """A host is killed; another one comes with a plan that is refused, and leaves; the first run goes on unharmed."""
    bench.run_for(bench.random.randrange(700))
    if bench.conductor.phase in (Phase.CLOSING, Phase.DONE):
        return
    bench.now_us += 1000 * (bench.conductor._pace.deadman_ms + 500)
    records, plan, policy = bench.records, bench.plan, bench.conductor.policy
    bench.records = []
    elsewhere = replace(plan, start=tuple(replace(each, counts=OUT_OF_THE_WAY) for each in plan.start))
    bench.conductor = bench.host_class(elsewhere, bench.site, bench.random.getrandbits(64) & ~0xFF, policy)
    bench._facts = [(0, 0, 0)] * len(bench.nodes)
    phase, halt = bench.run(), bench.conductor.halt
    require(phase is Phase.HALTED and halt is not None and halt.cause is Cause.ELSEWHERE, f"I7: not refused: {halt}")
    bench.records = records
    try:
        bench.new_host(bench.random.getrandbits(64) & ~0xFF)
    except InvalidInput as error:
        require(False, f"I10: the run before cannot go on: {error.message}")
    bench.finish()

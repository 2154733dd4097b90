"""When each node is polled: soon after a loss, seldom once it is lost, and never so many at once that stops wait.

Times are the host's; air times are those of a 32-byte frame and its answer, with what a library takes around them.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from curveline.drive_settings import MAX_NODES
from curveline.radio.host.actions import Policy
from curveline.radio.host.peer import Peer
from curveline.radio.interface import BATCH
from curveline.radio.protocol.codes import CLOCK_SHIFT

DEADMAN_LIMIT_MS = 5000
CYCLES = 10
"""Poll cycles without a word after which a node counts as lost."""
ANSWER_MS = {"250kbps": 4, "1Mbps": 2, "2Mbps": 2}
"""What an answered poll takes."""
LOSS_MS = {"250kbps": 14, "1Mbps": 6, "2Mbps": 4}
"""What a poll takes that is repeated to the end and never answered."""
LAG_CYCLES = 2
DOUBT_CYCLES = 4
"""Poll cycles of silence after which a node is doubted: on bad air one takes up to three times as long as it should."""
TICK_MS = 1 << CLOCK_SHIFT
BUSY_MS = 500
BUSY_CYCLES = 5
"""How long beyond the dead-man a node may go on calling itself busy: so many poll cycles, but at least `BUSY_MS`."""
LOST_SHARE = 10
"""All lost nodes together are given one part in so many of the air time."""
BATCH_MS = 32
"""What a batch takes if all answer at once; with 30 % of all packets lost it is three times that at worst."""
DOUBTFUL = 4
"""Nodes in a batch that may not answer: at 250 kbps a whole batch of them would keep a stop waiting for 0.1 s."""


def most_nodes(data_rate: str) -> int:
    """How many nodes a radio can ask so often that silence is told from a long row, however good the air is.

    A single display of the largest size is always one of these.
    """
    return max(MAX_NODES, DEADMAN_LIMIT_MS // (CYCLES * ANSWER_MS[data_rate]))


def shared_policy(policy: Policy, nodes: int, data_rate: str) -> Policy:
    """The policy of a run whose radio has so many nodes to ask, its own among them: none is polled sooner than all are.

    What follows from the time between two polls, such as the dead-man time, is then as for one run with all of them; a
    node is doubted, called late or given up for no shorter than it takes to hear of it.
    """
    cycle_ms = max(policy.poll_ms, ANSWER_MS[data_rate] * nodes)
    return replace(
        policy,
        poll_ms=cycle_ms,
        probe_ms=max(policy.probe_ms, DOUBT_CYCLES * cycle_ms),
        slack_ms=max(policy.slack_ms, CYCLES * cycle_ms),
        settle_ms=max(policy.settle_ms, CYCLES * cycle_ms),
    )


class Pace:
    """The rhythm of one run's polls.

    A node that has not been heard for `silence_ms` counts as lost. `deadman_ms` is how long a node obeys after what its
    host last heard of it: longer by what an answer and the frame after it take to get through.
    """

    def __init__(self, policy: Policy, count: int, data_rate: str) -> None:
        cycle_ms = max(policy.poll_ms, ANSWER_MS[data_rate] * count)
        self.silence_ms = min(DEADMAN_LIMIT_MS, max(policy.silence_ms, CYCLES * cycle_ms))
        self.deadman_ms = self.silence_ms + LAG_CYCLES * cycle_ms + TICK_MS
        self._busy_ms = self.deadman_ms + max(BUSY_MS, BUSY_CYCLES * cycle_ms)
        self._policy = policy
        self._loss_ms = LOSS_MS[data_rate]
        self._batch = min(BATCH, BATCH_MS // ANSWER_MS[data_rate])

    def is_lost(self, peer: Peer, now_ms: int) -> bool:
        """Whether a node has been polled long enough without a word from it."""
        return peer.unheard >= CYCLES and now_ms - peer.heard_ms > self.silence_ms

    def batch(self, peers: Sequence[Peer], now_ms: int) -> list[Peer]:
        """Those that are to be polled together now, the longest due first."""
        due = sorted((peer for peer in peers if peer.due_ms <= now_ms), key=_due)
        doubtful = [peer for peer in due if now_ms - peer.heard_ms > self._policy.probe_ms]
        late = {peer.number for peer in doubtful[DOUBTFUL:]}
        return [peer for peer in due if peer.number not in late][: self._batch]

    def patience_ms(self, missing: Sequence[Peer]) -> int:
        """How long to ask for nodes that are not ours yet: one with an owner keeps it, if that one is still alive."""
        owned = any(peer.busy for peer in missing)
        return self._busy_ms if owned else self._policy.budget_ms

    def after_answer(self, peer: Peer, now_ms: int) -> None:
        """The node answered."""
        peer.due_ms = now_ms + self._policy.poll_ms

    def after_loss(self, peers: Sequence[Peer], peer: Peer, now_ms: int) -> None:
        """Nothing came back: it is asked again at once, unless it is one of the lost ones among `peers`."""
        wait_ms = self._policy.retry_ms
        if self.is_lost(peer, now_ms):
            lost = sum(self.is_lost(each, now_ms) for each in peers)
            wait_ms = max(self._policy.lost_poll_ms, LOST_SHARE * self._loss_ms * lost)
        peer.due_ms = now_ms + wait_ms


def _due(peer: Peer) -> int:
    return peer.due_ms

"""The models that are searched to the end, and the mistakes that the search must find."""

from __future__ import annotations

from .world import Setup

MODELS = (
    Setup("3 nodes, 3 steps", nodes=3, steps=3),
    Setup("the host is killed and resumed in the only step", nodes=2, steps=1, lives=2),
    Setup("the host is killed and resumed twice", nodes=1, steps=2, lives=3),
    Setup("a node restarts", nodes=2, steps=2, restarts=1),
    Setup("a node restarts and the host is killed", nodes=1, steps=2, lives=2, restarts=1),
    Setup("the operator holds and goes on", nodes=2, steps=2, holds=1),
    Setup("the operator holds twice", nodes=2, steps=1, holds=2),
    Setup("silence", nodes=2, steps=2, silences=True),
    Setup("a stop broadcast to one node, for ever repeated", nodes=1, steps=2, stops=True),
    Setup("a second host asks", nodes=2, steps=1, hosts=2),
    Setup("a second host takes over one node", nodes=1, steps=2, hosts=2, takeover=True),
    Setup("a second host finds an owner silent in the only step", nodes=1, steps=1, hosts=2, silences=True),
    Setup("HELLOs replayed until there are no more offers", nodes=1, steps=2, lives=2, range=3),
    Setup("HELLOs replayed in two boots", nodes=1, steps=1, lives=2, restarts=1, range=2),
    Setup("two hosts' HELLOs replayed until there are no more offers", nodes=1, steps=1, hosts=2, range=3),
)

LARGE = (
    Setup("the host is killed and resumed", nodes=2, steps=2, lives=2),
    Setup("a stop broadcast, for ever repeated", nodes=2, steps=1, stops=True),
    Setup("a second host takes over", nodes=2, steps=1, hosts=2, takeover=True),
    Setup("a second host finds an owner silent", nodes=1, steps=2, hosts=2, silences=True),
    Setup("HELLOs replayed until there are no more of many offers", nodes=1, steps=2, lives=2, range=4),
)
"""Those of the campaign: each is above with fewer steps, nodes or offers."""

MISTAKES = (
    Setup("release is an edge", nodes=2, steps=2),
    Setup("done is a bare flag", nodes=2, steps=3),
    Setup("the barrier asks for started, not finished", nodes=2, steps=2),
    Setup("a step is released before its record", nodes=2, steps=1),
    Setup("staging before all nodes have switched", nodes=2, steps=1, hosts=2, takeover=True),
    Setup("no fencing", nodes=2, steps=1, hosts=2, takeover=True),
    Setup("hold does not keep a step from starting", nodes=2, steps=1, holds=1),
    Setup("newest hold wins", nodes=2, steps=2, holds=1),
    Setup("a pause is believed without an answer to it", nodes=2, steps=1, holds=1),
    Setup("the dead-man does not brake", nodes=1, steps=1, silences=True),
    Setup("being heard again lifts the dead-man", nodes=1, steps=1, silences=True),
    Setup("resume does not compare boot numbers", nodes=1, steps=2, lives=2, restarts=1),
    Setup("resume believes the journal, not the nodes", nodes=1, steps=2, lives=2),
    Setup("session key without the node's nonce", nodes=1, steps=1, restarts=1),
    Setup("offer numbers come again", nodes=1, steps=1, lives=2, range=1),
)
"""Each is named for the one mistake that is built into it."""

CAUGHT_BY = {
    "release is an edge": "I1",
    "done is a bare flag": "I1",
    "the barrier asks for started, not finished": "I1",
    "a step is released before its record": "I4",
    "staging before all nodes have switched": "I7",
    "no fencing": "I7",
    "hold does not keep a step from starting": "I3",
    "newest hold wins": "I3",
    "a pause is believed without an answer to it": "I3",
    "the dead-man does not brake": "I8",
    "being heard again lifts the dead-man": "I3",
    "resume does not compare boot numbers": "I2",
    "resume believes the journal, not the nodes": "I10",
    "session key without the node's nonce": "I2",
    "offer numbers come again": "I2",
}
"""Invariant of docs/radio-protocol.md that each mistake breaks first."""

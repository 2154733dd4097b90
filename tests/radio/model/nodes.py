"""The rules of a node without time, counters and tags: what it does with a frame, and what happens to it by itself.

Time is left out by letting arrivals and the dead-man happen at any moment. Counters, and the clocks by which frames
grow old, are left out by letting every frame that was ever sent come in at any moment, as often as it likes: they only
take some of that away. Tags are left out by giving sessions numbers that are never used twice; how a node keeps that
promise is a model of its own, in which it can make a few offers only.
"""

from __future__ import annotations

from typing import NamedTuple

from curveline.radio.protocol.codes import NodeState

HOLD_END = 254
IDLE, RUNNING, BRAKING = 0, 1, 2
SILENCE, RESTART = "has heard nothing for the dead-man time", "restarts"


class Violation(Exception):
    """An invariant that does not hold; the message begins with its name."""


class Frame(NamedTuple):
    """What a host sends: a HELLO (`session` is then the handshake), a DRIVE, or the broadcast STOP."""

    kind: str
    session: int = 0
    release: int = 0
    load: int = 0
    hold: int = 0


class Answer(NamedTuple):
    """What a node loads: an IDENT that offers `session`, or a STATUS in it."""

    kind: str
    session: int
    boot: int
    finished: int = 0
    started: int = 0
    staged: int = 0
    state: int = 0
    hold: int = 0
    at_start: bool = False
    busy: bool = False
    same_run: bool = False
    stopped: bool = False


class Node(NamedTuple):
    """The variables of a node, then what only the checker knows: `ran`, `did`, `top`, `owned`, `latched` and `place`.

    `ran` and `did` are the last steps begun and finished per run, whatever was forgotten in between; `top` is the
    largest hold generation heard in the session; `owned` the handshakes whose sessions have been live; `latched` is
    set by silence and by nothing else taken back than by a lifted hold or a new run.
    """

    boot: int = 1
    homed: bool = True
    fault: bool = False
    offers: frozenset[int] = frozenset()
    session: int = 0
    closed: bool = False
    pending: int = 0
    release: int = 0
    hold: int = 0
    started: int = 0
    finished: int = 0
    staged: int = 0
    silent: bool = False
    quiet: bool = False
    """The owner has not been heard for longer than the dead-man time."""
    lift: int = 0
    stopped: bool = False
    motion: int = IDLE
    run: int = 0
    owns: bool = False
    """Whether `run` is the session's: resumed, or begun by its first staged step."""
    halted: bool = False
    """Somebody has stopped the node since `pending` was offered."""
    made: int = 0
    """Offers in this boot, counted where they are limited."""
    ran: tuple[int, ...] = (0, 0, 0)
    did: tuple[int, ...] = (0, 0, 0)
    top: int = 0
    owned: frozenset[int] = frozenset()
    latched: bool = False
    place: int = 0
    restarts: int = 0
    """How many restarts are still to come."""

    @property
    def rebooted(self) -> bool:
        """Whether the node has forgotten what it did."""
        return self.boot > 1


def handshake_code(run: int, attempt: int, resumes: bool) -> int:
    """Number of a handshake: which run, which incarnation of its host, and whether it asks to resume."""
    return run * 16 + attempt * 2 + resumes


def run_of(code: int) -> int:
    """Run that a handshake or a session is for."""
    return (code & 63) >> 4


def session_code(node: Node, handshake: int, bugs: frozenset[str]) -> int:
    """Number of the session that a node offers: fresh for each boot and offer."""
    if "session key without the node's nonce" in bugs:
        return handshake
    count = node.made or sum(each & 63 == handshake for each in node.offers) + 1
    return (node.boot * 8 + count) * 64 + handshake


class Rules:
    """The node's part of the protocol, with `bugs` switched in; `places` tells where each run begins.

    A node answers each handshake with `offers` offers; or, if `range_` is given, it makes so many in a boot altogether.
    """

    def __init__(self, bugs: frozenset[str], places: tuple[int, ...], offers: int, range_: int = 0) -> None:
        self.bugs = bugs
        self.places = places
        self.offers = offers
        self.range = range_

    # Frames

    def receive(self, node: Node, frame: Frame) -> Node:
        """The node after a frame."""
        if frame.kind == "hello":
            return self._on_hello(node, frame.session)
        if frame.kind == "stop":
            lift = max(node.lift, node.hold + 2 & ~1 if node.session else 0)
            return self._brake(node._replace(stopped=True, lift=lift, halted=bool(node.pending)))
        return self._on_drive(node, frame)

    def _on_hello(self, node: Node, handshake: int) -> Node:
        if node.pending and node.pending & 63 == handshake:
            return node
        if self.range:
            return self._offer_counted(node, handshake)
        if sum(each & 63 == handshake for each in node.offers) >= self.offers:
            return node
        pending = session_code(node, handshake, self.bugs)
        return node._replace(pending=pending, halted=False, offers=node.offers | {pending})

    def _offer_counted(self, node: Node, handshake: int) -> Node:
        """The next offer of those that a boot has numbers for; after the last there is none."""
        if node.made == self.range and "offer numbers come again" not in self.bugs:
            return node
        node = node._replace(made=node.made % self.range + 1)
        return node._replace(pending=session_code(node, handshake, self.bugs), halted=False)

    def _on_drive(self, node: Node, frame: Frame) -> Node:
        if frame.session == node.session and not node.closed:
            pass
        elif frame.session == node.pending:
            if node.motion and not self._owner_gone(node):
                return node
            node = self._take_over(node)
        elif "no fencing" not in self.bugs or not node.session:
            return node
        hold = frame.hold if "newest hold wins" in self.bugs else max(node.hold, frame.hold)
        node = node._replace(quiet=False, hold=hold, top=max(node.top, frame.hold))
        if hold >= HOLD_END:
            late = node.started > node.finished
            return self._brake(node._replace(closed=True, silent=late, latched=late))
        return self._obey(node, frame)

    @staticmethod
    def _owner_gone(node: Node) -> bool:
        return not node.session or node.closed or node.quiet

    def _take_over(self, node: Node) -> Node:
        node = self._brake(node)
        session = node.pending
        resumes = bool(session & 1) and run_of(session) == node.run
        owned = node.owned | {session & 63}
        node = node._replace(session=session, pending=0, closed=False, owned=owned)
        node = node._replace(release=0, hold=0, top=0, lift=2 * node.halted, owns=resumes)
        if not resumes:
            node = node._replace(silent=False, stopped=node.halted, latched=False)
        return node._replace(halted=False)

    @staticmethod
    def _begin_run(node: Node) -> Node:
        run = run_of(node.session)
        return node._replace(run=run, owns=True, started=0, finished=0, staged=0)

    def _obey(self, node: Node, frame: Frame) -> Node:
        if node.hold & 1:
            node = self._brake(node)
        elif node.hold > node.lift:
            node = node._replace(silent=False, stopped=False, latched=False)
        elif "being heard again lifts the dead-man" in self.bugs:
            node = node._replace(silent=False)
        node = self._stage(node, frame)
        node = node._replace(release=max(node.release, frame.release))
        return self.go_on(self._start(node, frame))

    def _stage(self, node: Node, frame: Frame) -> Node:
        load = frame.load
        if load == 0:
            return node
        if not node.owns:
            node = self._begin_run(node)
        if load <= node.started:
            return node
        if node.staged > node.started and load == node.staged:
            return node
        if node.staged > node.started or load != node.started + 1:
            return self._brake(node._replace(fault=True))
        return node._replace(staged=load)

    def _start(self, node: Node, frame: Frame) -> Node:
        released = node.release >= node.staged
        if "release is an edge" in self.bugs:
            released = frame.release > 0
        ready = node.finished == node.started and node.staged == node.started + 1
        if not (ready and released and self._may_move(node)):
            return node
        if node.ran[node.run] + 1 != node.staged:
            raise Violation(f"I2: step {node.staged} of run {node.run} begins after step {node.ran[node.run]}")
        ran = tuple(node.staged if run == node.run else each for run, each in enumerate(node.ran))
        return node._replace(started=node.staged, ran=ran)

    @staticmethod
    def essence(node: Node, frame: Frame) -> Frame:
        """A frame that does the same to the node, now and ever: levels that it has passed are nothing new to it."""
        if frame.kind != "drive" or frame.session != node.session:
            return frame
        staged = max(node.staged, node.started) if node.owns else 0
        return frame._replace(
            release=frame.release if frame.release > node.release else 0,
            load=frame.load if frame.load > staged else 0,
            hold=frame.hold if frame.hold > node.hold else 0,
        )

    # Motion

    def _may_move(self, node: Node) -> bool:
        held = node.silent or node.stopped or node.hold & 1
        if "hold does not keep a step from starting" in self.bugs:
            held = node.silent
        return node.homed and not node.fault and node.session > 0 and node.owns and not node.closed and not held

    def go_on(self, node: Node) -> Node:
        """Set off for the started step's target, if nothing forbids it."""
        if node.motion or node.finished >= node.started or not self._may_move(node):
            return node
        if not node.homed or node.fault or not node.session or node.closed:
            raise Violation("I3: motion of a node that is unhomed, faulty or without a session")
        if node.top & 1 or node.stopped or node.latched:
            raise Violation("I3: motion of a node that was told to hold")
        return node._replace(motion=RUNNING, place=-1)

    def _brake(self, node: Node) -> Node:
        return node._replace(motion=BRAKING) if node.motion == RUNNING else node

    # What happens by itself

    def happenings(self, node: Node) -> list[tuple[str, Node]]:
        """All that may happen to a node without a frame, in words."""
        found = []
        if node.motion:
            found.append(("arrives", self._arrive(node)))
        if node.motion == BRAKING:
            found.append(("comes to rest on the way", self.go_on(node._replace(motion=IDLE))))
        if node.session and not node.closed and not (node.quiet and node.silent):
            found.append((SILENCE, self._fall_silent(node)))
        if node.restarts:
            found.append((RESTART, self._reboot(node)))
        return found

    def _arrive(self, node: Node) -> Node:
        if node.started == 0:  # a run that was abandoned while the motors still turned
            return node._replace(motion=IDLE)
        did = tuple(node.started if run == node.run else each for run, each in enumerate(node.did))
        place = 16 * node.run + node.started
        return node._replace(motion=IDLE, finished=node.started, did=did, place=place)

    def _fall_silent(self, node: Node) -> Node:
        lift = node.lift if node.silent else node.hold
        node = node._replace(quiet=True, silent=True, latched=True, lift=lift)
        if "the dead-man does not brake" in self.bugs:
            return node
        return self._brake(node)

    def _reboot(self, node: Node) -> Node:
        still = node.motion == IDLE
        return Node(
            boot=node.boot + 1,
            restarts=node.restarts - 1,
            homed=node.homed and still,
            ran=node.ran,
            did=node.did,
            owned=node.owned,
            place=node.place,
        )

    def check(self, node: Node) -> None:
        """What must be true of a node whatever it does."""
        if node.motion == RUNNING and (node.quiet or node.hold & 1 or node.stopped):
            raise Violation("I8: a node runs on although it is held or hears nobody")
        if not node.finished <= node.started <= node.finished + 1:
            raise Violation("I2: finished and started are more than a step apart")

    # Answers

    def state(self, node: Node) -> NodeState:
        """What the node would say it is doing."""
        if node.fault:
            return NodeState.FAULT
        if not node.homed:
            return NodeState.UNHOMED
        if node.motion:
            return NodeState.MOVING
        if node.stopped or (node.session and node.hold & 1):
            return NodeState.HOLD
        return NodeState.HOLD_LINK if node.silent else NodeState.READY

    def status(self, node: Node) -> Answer | None:
        """The STATUS that is loaded, None without a session."""
        if not node.session:
            return None
        facts = (node.finished, node.started, node.staged) if node.owns else (0, 0, 0)
        at_start = node.place == self.places[run_of(node.session)]
        return Answer("status", node.session, node.boot, *facts, self.state(node), node.hold, at_start)

    def ident(self, node: Node) -> Answer | None:
        """The IDENT that answers the HELLO of the pending session."""
        if not node.pending:
            return None
        same_run = node.run == run_of(node.pending)
        return Answer(
            "ident", node.pending, node.boot, busy=not self._owner_gone(node), same_run=same_run, stopped=node.stopped
        )

"""The rules of a host without time: what it concludes from an answer, what it writes down, and what it sends next."""

from __future__ import annotations

from typing import NamedTuple

from curveline.radio.protocol.codes import NodeState

from .nodes import HOLD_END, Answer, Frame, handshake_code

OFF, DISCOVER, PREFLIGHT, STAGING, RELEASED = "off", "discover", "preflight", "staging", "released"
PAUSING, PAUSED, CLOSING, DONE, HALTED = "pausing", "paused", "closing", "done", "halted"
WATCHED = (STAGING, RELEASED, PAUSING, PAUSED)
UNFIT = (NodeState.FAULT, NodeState.POSITION_LOST, NodeState.ESTOP, NodeState.BOOT, NodeState.UNHOMED, NodeState.HOMING)


class Peer(NamedTuple):
    """What a host knows of a node; the facts only grow.

    `told` means that the node has answered the present phase as the host wants it; `verdict` is what the answers
    before the first step say against beginning.
    """

    session: int = 0
    boot: int = 0
    finished: int = 0
    started: int = 0
    staged: int = 0
    told: bool = False
    verdict: str = ""
    heard: bool = False
    """Whether it has said anything in the session."""
    was_stopped: bool = False
    """Whether a STOP held it at its first offer."""


class Book(NamedTuple):
    """The journal: what survives the host."""

    boots: tuple[int, ...] = ()
    release: int = 0
    barrier: int = 0
    ended: bool = False


class Host(NamedTuple):
    """The variables of a host; `attempt` counts its lives, `writing` is set between a record and what it allows."""

    run: int
    peers: tuple[Peer, ...]
    attempt: int = 0
    phase: str = OFF
    step: int = 1
    released: int = 0
    hold: int = 0
    back: str = STAGING
    holds: int = 0
    writing: bool = False
    resumes: bool = False
    why: str = ""
    book: Book = Book()

    @property
    def code(self) -> int:
        """The present handshake."""
        return handshake_code(self.run, self.attempt, self.resumes)


class Limits(NamedTuple):
    """How large a model is: steps of a run, lives of a host, holds of the operator, and the steps a host starts at."""

    steps: int
    lives: int
    holds: int = 0
    takeover: bool = False


class HostRules:
    """The host's part of the protocol, with `bugs` switched in."""

    def __init__(self, bugs: frozenset[str], limits: Limits) -> None:
        self.bugs = bugs
        self.limits = limits

    def frame(self, host: Host, index: int) -> Frame | None:
        """What the host sends to a node as long as nothing changes."""
        peer = host.peers[index]
        if host.phase == DISCOVER:
            return None if peer.session else Frame("hello", host.code)
        if host.phase in (OFF, DONE) or not peer.session:
            return None
        if host.phase == PREFLIGHT:
            return Frame("drive", peer.session, 0, 0, host.hold)
        load = peer.started + 1 if host.phase in WATCHED and peer.started < self.limits.steps else 0
        return Frame("drive", peer.session, host.released, load, host.hold)

    # What an answer means

    def hear(self, host: Host, index: int, answer: Answer) -> Host:
        """The host after an answer of a node; the key of handshake or session rejects what is not meant for it."""
        peer = host.peers[index]
        if answer.kind == "ident":
            return self._identify(host, index, answer) if answer.session & 63 == host.code else host
        if not peer.session or answer.session != peer.session or host.phase in (OFF, DISCOVER, DONE, HALTED):
            return host
        peer = self._merge(host, peer, answer)
        host = self._with_peer(host, index, peer)
        why = self._judge(host, peer, answer) if host.phase in WATCHED else ""
        return self.halt(host, why) if why else host

    def _identify(self, host: Host, index: int, answer: Answer) -> Host:
        peer = host.peers[index]
        if host.phase == DISCOVER and not peer.session:
            if self._is_another(host, index, answer):
                return self.halt(host, "restart")
            if answer.busy and not self.limits.takeover:
                return host
            taken = peer._replace(session=answer.session, boot=answer.boot, was_stopped=answer.stopped)
            return self._with_peer(host, index, taken)
        if host.phase not in (*WATCHED, PREFLIGHT):
            return host
        if answer.boot != peer.boot:
            return self.halt(host, "restart")
        replaced = answer.session > peer.session and not answer.busy
        if host.phase == PREFLIGHT and not peer.heard and replaced:
            if answer.stopped and not peer.was_stopped:
                return self.halt(host, "stopped")
            return self._with_peer(host, index, peer._replace(session=answer.session))
        return host

    def _is_another(self, host: Host, index: int, answer: Answer) -> bool:
        """Whether a node has lost its power or its run since the journal was written."""
        if not host.resumes or "resume does not compare boot numbers" in self.bugs:
            return False
        return answer.boot != host.book.boots[index] or (host.book.release > 0 and not answer.same_run)

    def _merge(self, host: Host, peer: Peer, answer: Answer) -> Peer:
        finished = max(peer.finished, answer.finished)
        if "done is a bare flag" in self.bugs and answer.finished == answer.started > 0:
            finished = max(finished, host.step)
        return peer._replace(
            finished=finished,
            started=max(peer.started, answer.started),
            staged=max(peer.staged, answer.staged),
            told=peer.told or self._answers(host, answer),
            verdict=self._verdict(host, answer) if host.phase == PREFLIGHT else "",
            heard=True,
        )

    def _answers(self, host: Host, answer: Answer) -> bool:
        """Whether an answer is the one that the host's phase waits for."""
        if host.phase == PREFLIGHT:
            return answer.state != NodeState.MOVING
        if host.phase == PAUSING:
            heard = answer.hold == host.hold or "a pause is believed without an answer to it" in self.bugs
            return heard and answer.state != NodeState.MOVING
        return host.phase == CLOSING and answer.hold == HOLD_END

    @staticmethod
    def _verdict(host: Host, answer: Answer) -> str:
        if answer.state in UNFIT:
            return "unfit"
        return "" if answer.at_start or host.resumes else "elsewhere"

    @staticmethod
    def _judge(host: Host, peer: Peer, answer: Answer) -> str:
        if answer.state in UNFIT:
            return "unfit"
        if peer.started > host.released:
            return "ahead"
        if answer.state == NodeState.HOLD_LINK:
            return "held"
        if answer.state == NodeState.HOLD and not answer.hold & 1:
            return "stopped"
        return ""

    @staticmethod
    def halt(host: Host, why: str) -> Host:
        """Hold what can be held and end this life."""
        hold = HOLD_END if host.phase in (DISCOVER, PREFLIGHT) else host.hold | 1
        nobody = tuple(Peer() for _ in host.peers)
        peers = nobody if host.phase == DISCOVER else host.peers  # offers that were not taken up bind nobody
        return host._replace(phase=HALTED, hold=hold, why=why, writing=False, back=STAGING, peers=peers)

    @staticmethod
    def _with_peer(host: Host, index: int, peer: Peer) -> Host:
        return host._replace(peers=(*host.peers[:index], peer, *host.peers[index + 1 :]))

    # What the host does by itself

    def steps(self, host: Host) -> list[tuple[str, Host]]:
        """What the host does next if nothing comes between; at most one thing."""
        act = {
            OFF: self._begin,
            DISCOVER: self._discover,
            PREFLIGHT: self._preflight,
            STAGING: self._stage,
            RELEASED: self._await_barrier,
            PAUSING: self._await_rest,
            PAUSED: self._go_on,
            CLOSING: self._close,
            HALTED: self._begin,
        }.get(host.phase)
        return act(host) if act else []

    def troubles(self, host: Host) -> list[tuple[str, Host]]:
        """What may happen to a host: its end in the middle of anything, and the wishes of an operator."""
        found = []
        if host.phase not in (OFF, DONE, HALTED) and host.attempt < self.limits.lives:
            found.append(("is killed", self._forget(host)))
        if host.phase in (STAGING, RELEASED) and host.holds < self.limits.holds:
            held = self._enter(host, PAUSING)._replace(back=host.phase, hold=host.hold | 1, holds=host.holds + 1)
            found.append(("is asked to hold", held._replace(writing=False)))
        return found

    @staticmethod
    def _forget(host: Host) -> Host:
        nobody = tuple(Peer() for _ in host.peers)
        return Host(host.run, nobody, host.attempt, book=host.book, holds=host.holds)

    def gives_up(self, host: Host) -> list[tuple[str, Host]]:
        """A host that cannot get hold of all nodes stops trying after a while."""
        return [("gives up", self.halt(host, "busy"))] if host.phase in (DISCOVER, PREFLIGHT) else []

    def _begin(self, host: Host) -> list[tuple[str, Host]]:
        if host.attempt >= self.limits.lives or host.book.ended:
            return []
        resumes = bool(host.book.boots)
        fresh = self._forget(host)._replace(phase=DISCOVER, attempt=host.attempt + 1, resumes=resumes)
        fresh = fresh._replace(hold=int(resumes), step=host.book.barrier + 1)  # held until all is found in order
        return [("resumes the run" if resumes else "begins the run", fresh)]

    def _discover(self, host: Host) -> list[tuple[str, Host]]:
        if all(peer.session for peer in host.peers):
            return [("has an offer of every node", host._replace(phase=PREFLIGHT))]
        return []

    def _preflight(self, host: Host) -> list[tuple[str, Host]]:
        enough = any if "staging before all nodes have switched" in self.bugs else all
        if not enough(peer.told for peer in host.peers):
            return []
        if why := max(peer.verdict for peer in host.peers):
            return [(f"finds a node {why}", self.halt(host, why))]
        if host.resumes:
            return self._resume(host)
        boots = tuple(peer.boot for peer in host.peers)
        return self._write(host, Book(boots), "START", self._enter(host, STAGING))

    def _resume(self, host: Host) -> list[tuple[str, Host]]:
        book = host.book
        apart = any(peer.started > book.release or peer.finished < book.barrier for peer in host.peers)
        if apart and "resume does not compare boot numbers" not in self.bugs:
            return [("finds nodes and journal apart", self.halt(host, "apart"))]
        host = host._replace(released=book.release, hold=2)
        if "resume believes the journal, not the nodes" in self.bugs:
            peers = tuple(peer._replace(finished=book.release, started=book.release) for peer in host.peers)
            host = host._replace(peers=peers)
        if book.release > book.barrier:
            return [("goes on with a released step", self._enter(host, RELEASED))]
        return [("goes on after a barrier", self._enter(host, STAGING))]

    def _enter(self, host: Host, phase: str) -> Host:
        """Begin a phase: nobody has answered it yet."""
        early = "staging before all nodes have switched" in self.bugs
        peers = tuple(peer._replace(told=early and peer.told, verdict="") for peer in host.peers)
        return host._replace(phase=phase, peers=peers)

    def _write(self, host: Host, book: Book, name: str, after: Host) -> list[tuple[str, Host]]:
        """A record goes to disk first, what it allows happens after; a host may be killed in between."""
        if host.book == book and host.writing:
            return [(f"acts on {name}", after._replace(book=book, writing=False))]
        return [(f"writes {name}", host._replace(book=book, writing=True))]

    def _stage(self, host: Host) -> list[tuple[str, Host]]:
        if host.step > self.limits.steps:
            after = self._enter(host, CLOSING)._replace(hold=HOLD_END)
            return self._write(host, host.book._replace(ended=True), "END", after)
        known = host.peers
        if "staging before all nodes have switched" in self.bugs:
            known = tuple(peer for peer in host.peers if peer.told)
        if not all(peer.staged >= host.step for peer in known):
            return []
        after = self._enter(host, RELEASED)._replace(released=host.step)
        if "a step is released before its record" in self.bugs:
            return [("releases", after)]
        return self._write(host, host.book._replace(release=host.step), f"RELEASE {host.step}", after)

    def _await_barrier(self, host: Host) -> list[tuple[str, Host]]:
        level = 3 if "the barrier asks for started, not finished" in self.bugs else 2
        if not all(peer[level] >= host.step for peer in host.peers):
            return []
        after = self._enter(host, STAGING)._replace(step=host.step + 1)
        return self._write(host, host.book._replace(barrier=host.step), f"BARRIER {host.step}", after)

    def _await_rest(self, host: Host) -> list[tuple[str, Host]]:
        if not all(peer.told for peer in host.peers):
            return []
        return [("finds all nodes at rest", self._enter(host, PAUSED))]

    def _go_on(self, host: Host) -> list[tuple[str, Host]]:
        return [("goes on after the pause", self._enter(host, host.back)._replace(hold=host.hold + 1))]

    def _close(self, host: Host) -> list[tuple[str, Host]]:
        if all(peer.told for peer in host.peers):
            return [("is done", host._replace(phase=DONE))]
        return []

"""Hosts, nodes and a network that loses, repeats, delays and reorders for ever, as one graph of states.

Every frame that a host could send and every answer that a node has loaded stays in the network, and may come in at
any later moment any number of times. Loss is what happens when it does not come. A state is a tuple of small numbers:
one per host and one per station, which is a node with what is on the way to and from it.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import NamedTuple

from .hosts import CLOSING, DONE, HALTED, OFF, PAUSED, WATCHED, Host, HostRules, Limits, Peer
from .nodes import IDLE, RESTART, SILENCE, Answer, Frame, Node, Rules, Violation, run_of

State = tuple[int, ...]
Label = tuple[object, ...]


@dataclass(frozen=True)
class Setup:
    """One model: how many of what, which faults may happen, and which mistake is built in."""

    name: str
    nodes: int
    steps: int
    hosts: int = 1
    lives: int = 1
    restarts: int = 0
    """How often the first node may restart; which one it is makes no difference to the others."""
    holds: int = 0
    silences: bool = False
    stops: bool = False
    takeover: bool = False
    offers: int = 1
    """How often a node answers the same handshake with another offer; nothing limits that in truth."""
    range: int = 0
    """Offers for which a node has numbers in a boot; if it is given, every HELLO stays in the network for ever."""
    bugs: frozenset[str] = frozenset()

    unreduced: bool = False
    """Whether frames stay in the network as they are, though nothing new can come of them."""

    @property
    def exact(self) -> bool:
        """The reduction holds for the right rules only, so a model with a mistake in it does without."""
        return self.unreduced or bool(self.bugs)

    @property
    def calm(self) -> bool:
        """Whether nothing can happen that may end a run before its end."""
        return self.hosts == 1 and not (self.restarts or self.silences or self.stops or self.range)


class Station(NamedTuple):
    """A node, the frames that may still reach it, and the answers of it that may still reach a host."""

    node: Node
    net: frozenset[Frame]
    said: frozenset[Answer]


class Table:
    """Numbers for things, in order of appearance."""

    def __init__(self) -> None:
        self.things: list[object] = []
        self._numbers: dict[object, int] = {}

    def number(self, thing: object) -> int:
        """The number of a thing, a new one if it has none."""
        found = self._numbers.get(thing)
        if found is None:
            found = self._numbers[thing] = len(self.things)
            self.things.append(thing)
        return found


class World:
    """The states of a setup and what leads from one to the next."""

    def __init__(self, setup: Setup) -> None:
        self.setup = setup
        places = (0, 0, 16 + setup.steps // 2)  # the second run begins in the middle of the first
        self.rules = Rules(setup.bugs, places, setup.offers, setup.range)
        limits = Limits(setup.steps, setup.lives, setup.holds, setup.takeover)
        self.host_rules = HostRules(setup.bugs, limits)
        self.hosts = Table()
        self.stations = Table()
        self._own: dict[int, list[tuple[Label, int, Frame | None, int]]] = {}
        self._heard: dict[tuple[int, int, int], list[tuple[Label, int, bool]]] = {}
        self._acts: dict[int, list[tuple[Label, int, bool]]] = {}
        self._sent: dict[tuple[int, int, int], int] = {}
        self._frames: dict[int, tuple[Frame | None, ...]] = {}

    def start(self) -> State:
        """All nodes at rest at home, no host running, nothing sent."""
        nobody = tuple(Peer() for _ in range(self.setup.nodes))
        hosts = [self.hosts.number(Host(run, nobody)) for run in range(1, self.setup.hosts + 1)]
        net = frozenset({Frame("stop")}) if self.setup.stops else frozenset()
        nodes = [Node(restarts=self.setup.restarts if index == 0 else 0) for index in range(self.setup.nodes)]
        stations = [self.stations.number(Station(node, net, frozenset())) for node in nodes]
        return (*hosts, *stations)

    def moves(self, state: State) -> Iterator[tuple[Label, State, bool]]:
        """What can happen next: in words, the state after, and whether it takes no fault for it to happen."""
        count = self.setup.hosts
        for place in range(count, len(state)):
            for label, after, frame, starts in self._station_moves(state[place]):
                moved = (*state[:place], after, *state[place + 1 :])
                if starts:
                    self._check_start(state, place, starts)
                index = place - count
                fair = label[0] == "event"
                if label[0] == "hears":
                    fair = any(self._is_sent(frame, host, state[place], index) for host in state[:count])
                elif label[1] == SILENCE:
                    fair = not self._has_owner(state, place)
                    if not (fair or self.setup.silences):
                        continue
                yield (index + 1, *label), moved, fair
        for which in range(count):
            number = state[which]
            for label, after, fair in self._host_moves(number):
                yield ("host", which + 1, *label), self._send(state, which, after), fair
            for place in range(count, len(state)):
                for label, after, fair in self._hearings(number, state[place], place - count):
                    yield ("host", which + 1, *label), self._send(state, which, after), fair

    def _has_owner(self, state: State, place: int) -> bool:
        """Whether some host still sends to the node's session, so that only loss can make it fall silent."""
        session = self.stations.things[state[place]].node.session
        hosts = (self.hosts.things[number] for number in state[: self.setup.hosts])
        return any(host.code == session & 63 and host.phase not in (OFF, DONE, HALTED) for host in hosts)

    # Nodes

    def _station_moves(self, number: int) -> list[tuple[Label, int, Frame | None, int]]:
        found = self._own.get(number)
        if found is None:
            found = self._own[number] = list(self._find_station_moves(number))
        return found

    def _find_station_moves(self, number: int) -> Iterator[tuple[Label, int, Frame | None, int]]:
        station: Station = self.stations.things[number]
        seen = set()
        for frame in sorted(station.net):
            node = self.rules.receive(station.node, frame)
            starts = node.session if node.ran != station.node.ran else 0
            after = self._settled(station, node, frame)
            if after != number and after not in seen:
                seen.add(after)
                yield ("hears", frame), after, frame, starts
        for words, node in self.rules.happenings(station.node):
            fault = "fault" if words in (RESTART, SILENCE) else "event"
            after = self._settled(station, node, None)
            if after != number:
                yield (fault, words), after, None, 0

    def _settled(self, station: Station, node: Node, frame: Frame | None) -> int:
        """The station after its node has changed: what it now says is on the way, what cannot matter is not."""
        self.rules.check(node)
        said = station.said
        if frame is not None and frame.kind == "hello":
            answer = self.rules.ident(node)
            if answer is not None and answer.session & 63 == frame.session:
                said = said | {answer}
        if node != station.node and (answer := self.rules.status(node)) is not None:
            said = said | {answer}
        return self.stations.number(Station(node, self._on_the_way(node, station.net), said))

    def _on_the_way(self, node: Node, net: frozenset[Frame]) -> frozenset[Frame]:
        """The frames that can still do something to the node, each reduced to that; with a mistake built in, all."""
        if not self.setup.exact:
            alive = (node.session, node.pending)
            kept = (each for each in net if each.kind != "drive" or each.session in alive)
            net = frozenset(self.rules.essence(node, each) for each in kept)
        return net

    # Hosts

    def _host_moves(self, number: int) -> list[tuple[Label, int, bool]]:
        found = self._acts.get(number)
        if found is None:
            host: Host = self.hosts.things[number]
            found = self._acts[number] = [
                ((words,), self._checked(host, after), True) for words, after in self.host_rules.steps(host)
            ]
            if not self.setup.calm:
                found += [
                    ((words,), self._checked(host, after), True) for words, after in self.host_rules.gives_up(host)
                ]
            found += [((words,), self._checked(host, after), False) for words, after in self.host_rules.troubles(host)]
        return found

    def _hearings(self, host_number: int, station_number: int, index: int) -> list[tuple[Label, int, bool]]:
        key = (host_number, station_number, index)
        found = self._heard.get(key)
        if found is None:
            found = self._heard[key] = list(self._find_hearings(*key))
        return found

    def _find_hearings(self, host_number: int, station_number: int, index: int) -> Iterator[tuple[Label, int, bool]]:
        host: Host = self.hosts.things[host_number]
        if host.phase in (OFF, DONE, HALTED):
            return
        station: Station = self.stations.things[station_number]
        newest = (self.rules.status(station.node), self.rules.ident(station.node))
        for answer in sorted(station.said):
            after = self.host_rules.hear(host, index, answer)
            if after != host:
                yield ("hears", index + 1, answer), self._checked(host, after), answer in newest
        peer = host.peers[index]
        if not peer.session or station.node.session == peer.session:
            return
        if host.phase == CLOSING:
            told = tuple(each._replace(told=each.told or place == index) for place, each in enumerate(host.peers))
            yield ("asks no more of node", index + 1), self._checked(host, host._replace(peers=told)), True
        if host.phase in WATCHED:
            restarted = station.node.boot != peer.boot and "resume does not compare boot numbers" not in self.setup.bugs
            why = "restart" if restarted else "taken"
            yield (
                ("finds the session gone of node", index + 1),
                self._checked(host, self.host_rules.halt(host, why)),
                True,
            )

    def _checked(self, before: Host, after: Host) -> int:
        if after.released > after.book.release:
            raise Violation(f"I4: step {after.released} is released, the journal knows {after.book.release}")
        if after.attempt == before.attempt and after.phase in WATCHED and after.released < before.released:
            raise Violation("I4: release falls")
        if after.phase == HALTED and after.why and self.setup.calm:
            raise Violation(f"I10: the run is halted ({after.why}) although nothing has happened")
        for old, new in zip(before.peers, after.peers, strict=True):
            if after.attempt == before.attempt and new.session == old.session and new[2:5] < old[2:5]:
                raise Violation("I4: what the host knows of a node falls back")
        return self.hosts.number(after)

    def _sends(self, number: int) -> tuple[Frame | None, ...]:
        found = self._frames.get(number)
        if found is None:
            host: Host = self.hosts.things[number]
            frames = tuple(self.host_rules.frame(host, index) for index in range(self.setup.nodes))
            found = self._frames[number] = frames
        return found

    def _is_sent(self, frame: Frame | None, host_number: int, station_number: int, index: int) -> bool:
        """Whether a frame is what the host sends at present."""
        sent = self._sends(host_number)[index]
        if sent is None or frame is None or self.setup.exact:
            return sent == frame is not None
        return self.rules.essence(self.stations.things[station_number].node, sent) == frame

    def _send(self, state: State, which: int, number: int) -> State:
        """The state after a host has changed: what it sends now is on the way, what nobody can hear is not."""
        count = self.setup.hosts
        codes = [self.hosts.things[each].code for each in (*state[:which], number, *state[which + 1 : count])]
        stations = [
            self._with_frame(state[place], number, place - count, tuple(codes)) for place in range(count, len(state))
        ]
        return (*state[:which], number, *state[which + 1 : count], *stations)

    def _with_frame(self, station_number: int, host_number: int, index: int, codes: tuple[int, ...]) -> int:
        key = (station_number, host_number, index, codes)
        found = self._sent.get(key)
        if found is None:
            station: Station = self.stations.things[station_number]
            frame = self._sends(host_number)[index]
            net = station.net if frame is None else self._on_the_way(station.node, station.net | {frame})
            if not self.setup.range:
                net = frozenset(each for each in net if each.kind != "hello" or each.session in codes)
            said = frozenset(each for each in station.said if each.session & 63 in codes)
            found = self._sent[key] = self.stations.number(station._replace(net=net, said=said))
        return found

    # Invariants over several nodes

    def check(self, state: State) -> None:
        """I1 over all nodes that have not restarted, and what a pause promises."""
        count = self.setup.hosts
        nodes = [self.stations.things[number].node for number in state[count:]]
        sound = [node for node in nodes if not node.rebooted]
        for run in range(1, count + 1):
            if sound and max(node.ran[run] for node in sound) > min(node.did[run] for node in sound) + 1:
                raise Violation("I1: a node begins a step before all have finished the one before")
        for number in state[:count]:
            host: Host = self.hosts.things[number]
            pairs = zip(nodes, host.peers, strict=True)
            if host.book.ended and any(node.ran[host.run] < self.setup.steps for node in nodes):
                raise Violation("I11: the journal has an end, but not every node has done every step")
            if host.phase == PAUSED and any(node.motion and node.session == peer.session for node, peer in pairs):
                raise Violation("I3: a node moves although the host knows the display paused")

    def _check_start(self, state: State, place: int, session: int) -> None:
        """I7: when a node begins a step, all nodes are the host's, or were and have not moved for another since."""
        code = session & 63
        for other in range(self.setup.hosts, len(state)):
            node: Node = self.stations.things[state[other]].node
            if other == place:
                continue
            if code not in node.owned:
                raise Violation("I7: a host moves a node before all nodes are its own")
            if node.motion != IDLE and node.run != run_of(session):
                raise Violation("I7: two hosts move nodes at the same time")

    def ends(self, state: State) -> bool:
        """Whether nothing is left to do: every run is over."""
        hosts = [self.hosts.things[each] for each in state[: self.setup.hosts]]
        return all(host.phase in (DONE, HALTED) or (host.phase == OFF and host.book.ended) for host in hosts)

    @staticmethod
    def words(label: Label) -> str:
        """What happened, for a person."""
        parts = [_in_words(part) for part in label if part not in ("event", "fault", "host")]
        return " ".join(["host" if label[0] == "host" else "node", *parts])


def _in_words(part: object) -> str:
    if not isinstance(part, Frame | Answer):
        return str(part)
    fields = (f"{name} {value}" for name, value in part._asdict().items() if name != "kind" and value)
    return f"{part.kind.upper()}({', '.join(fields)})"

"""A model of the display behind a radio: nodes that move, motors, air that loses packets, and a clock.

It runs the node's own state machine. Its time is virtual unless `realtime` is asked for: an exchange takes the time it
would take in the air, and sleeping costs nothing. Nothing is computed between the frames; where an axis was at any
moment is known from the moves it made.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from hashlib import blake2s
from pathlib import Path

from curveline.drive_settings import DriveSettings
from curveline.errors import InvalidInput, LinkError
from curveline.radio.frame_tap import Tap, untapped
from curveline.radio.interface import Answer, check_frames
from curveline.radio.mock.board import Board, KeyRing
from curveline.radio.mock.chip import MockChip
from curveline.radio.mock.fault_injection import MishapStage, MockDisk, Packet, Troubles
from curveline.radio.mock.mock_node import Ear, Station
from curveline.radio.mock.spec import MockSpec, parse_spec
from curveline.radio.mock.store import MockState, Standing, Store, state_at_home
from curveline.radio.node.machine import NodeMachine
from curveline.radio.node.plant import PER_MILLE, MotorPlant
from curveline.radio.node.state import Memory
from curveline.radio.protocol.air_time import RATES_KBPS
from curveline.radio.protocol.band import CHANNELS
from curveline.radio.protocol.codes import Counts
from curveline.radio.protocol.keys import ZERO_MASTER, Site
from curveline.radio.protocol.node_settings import node_settings
from curveline.radio.site.key_file import hardware_site, keys_at_hand

SAMPLE_MS = 20
OTHER_GEAR = 2.98
"""How much further an axis goes per count with a gear of 100:1 in place of 298:1."""
LOOK_US = 1000
"""How long a channel is listened to for others, as by a dongle."""
REST_STEP_MS = 100
REOPEN_US = 50_000
"""How long it takes to find out that a radio is still away."""
REST_LIMIT_MS = 600_000
"""No move of any display takes longer than this to end or to be broken off by a dead-man."""

Motion = list[tuple[float, tuple[Counts, ...]]]
"""(seconds since the radio was opened, counts of every node), in order of time."""


def open_radio(settings: str, drive: DriveSettings, runs: Path) -> MockRadio:
    """The mock display of `drive`, locked for this process; `settings` is what follows `mock:`."""
    return _open(parse_spec(settings), drive, runs, None)


def open_together(settings: str, drives: Sequence[DriveSettings], runs: Path) -> list[MockRadio]:
    """Several mock displays behind one modelled radio: one chip and one clock. Faults befall the first of them."""
    spec = parse_spec(settings)
    chip = MockChip(spec, _checked_rate(drives[0]))
    opened: list[MockRadio] = []
    try:
        for drive in drives:
            opened.append(_open(replace(spec, mishaps=() if opened else spec.mishaps), drive, runs, chip))
    except BaseException:
        for radio in opened:
            radio.close()
        raise
    return opened


def _open(spec: MockSpec, drive: DriveSettings, runs: Path, chip: MockChip | None) -> MockRadio:
    count = drive.node_count
    if spec.nodes not in (None, count):
        raise InvalidInput(
            f"the mock radio was asked for {spec.nodes} nodes, but the display {drive.display!r} has {count}",
            hint="leave `nodes=` out, or name a display file with that many nodes",
        )
    if spec.hand is not None and not 1 <= spec.hand < count:
        raise InvalidInput(f"there is no segment {spec.hand} for 'hand': the display has {count - 1}")
    for mishap in spec.mishaps:
        if mishap.node > count:
            raise InvalidInput(f"there is no node {mishap.node} for {mishap.key!r}: the display has {count}")
    _checked_rate(drive)
    store = Store(runs, drive)
    store.open()
    try:
        is_new = spec.fresh or not store.path.exists()
        state = state_at_home(count, unhomed=spec.bare) if is_new else store.load(_ring(spec, drive))
        radio = MockRadio(spec, drive, state, store, chip)
        radio.save()
    except BaseException:
        store.close()
        raise
    return radio


def _ring(spec: MockSpec, drive: DriveSettings) -> KeyRing:
    own = hardware_site(drive).master if spec.keys else ZERO_MASTER
    return KeyRing(own, keys_at_hand())


def _checked_rate(drive: DriveSettings) -> str:
    if drive.data_rate not in RATES_KBPS:
        raise InvalidInput(f"data rate {drive.data_rate!r} is unknown; there are {', '.join(RATES_KBPS)}")
    return drive.data_rate


class MockRadio:
    """A `Radio` whose nodes are modelled in this process; `rod` names the states the segments were last seen in."""

    def __init__(
        self,
        spec: MockSpec,
        drive: DriveSettings,
        state: MockState,
        store: Store | None = None,
        chip: MockChip | None = None,
    ) -> None:
        self.site = hardware_site(drive) if spec.keys else mock_site(drive)
        self.tap: Tap = untapped
        self._rod, self._rod_at = state.rod, state.rod_at
        self._chip = chip or MockChip(spec, drive.data_rate)
        self.clamp, self.play, self.set_share = spec.clamp, spec.play, spec.set
        self.curvature, self.stiffness, self.hand = spec.curvature, spec.stiffness, spec.hand
        self.scatter = spec.scatter
        self._store = store
        self._rate, self._channel = drive.data_rate, drive.channel
        self._named = drive.display
        self._closed = False
        self._ears: dict[Ear, list[int]] = {}
        """Who listens where, empty if it has to be found out anew."""
        self._stations = self._build(drive, state, spec)
        if not spec.keys:
            self.site = self._open_site(drive)
        stage = MishapStage(self._stations, self._chip.air, self._chip.random)
        self._troubles = Troubles(spec.mishaps, stage)
        self.disk = MockDisk(stage)
        for station in self._stations:
            station.changed = self._ears.clear
            station.power_up(self._chip.random)
        self._restless = {station for station in self._stations if station.is_restless}
        self._saved = self._progress()

    @property
    def modelled(self) -> MockRadio:
        """This radio, as the display behind it, of which more is known than its nodes tell."""
        return self

    @property
    def nodes(self) -> list[NodeMachine]:
        """The nodes as they are now: one that restarts is another one."""
        self._catch_up()
        return [station.node for station in self._stations]

    @property
    def rod(self) -> list[str]:
        """States that the segments were last seen in, empty if that was never."""
        return self._rod

    @rod.setter
    def rod(self, states: list[str]) -> None:
        self._rod, self._rod_at = states, list(self.positions())

    # Radio

    def exchange(self, frames: Sequence[tuple[str, bytes]]) -> Sequence[Answer]:
        """See Radio; an address that nobody listens on costs as much time as a node that is off."""
        check_frames(frames)
        if self._closed:
            raise LinkError("the mock radio is closed")
        self._reach()
        answers = [self._exchange(address, payload) for address, payload in frames]
        self.tap(frames, answers)
        return answers

    def _exchange(self, address: str, payload: bytes) -> Answer:
        listening = self._listening(address)
        self._troubles.before(Packet(self._now_ms(), listening[0] if listening else 0, payload))
        self.sleep_until(1000 * self._troubles.asleep_until_ms)
        self._reach()
        begin_us = self.now_us()
        self._chip.air.channel = self._channel
        heard = self._chip.air.unheard()
        stations = [self._stations[number - 1] for number in self._listening(address)]
        if stations:
            loudest = stations[0] if len(stations) == 1 else self._chip.random.choice(stations)
            for station in stations:
                if station is not loudest:
                    station.intrude(begin_us // 1000, payload)
            heard = loudest.exchange(self._chip.air, payload, begin_us)
            self._restless.update(station for station in stations if station.is_restless)
        self.sleep_until(begin_us + heard.took_us)
        if self._progress() != self._saved:
            self.save()
        return Answer(heard.payload, heard.retries)

    def _listening(self, address: str) -> list[int]:
        """Numbers (from 1, left to right) of the boards that hear what is sent to an address now."""
        self._catch_up()
        if not self._ears:
            for number, station in enumerate(self._stations, start=1):
                self._ears.setdefault(station.ear, []).append(number)
        return self._ears.get(Ear(self._channel, self._rate, address.upper()), [])

    def _catch_up(self) -> None:
        """Let nodes start anew that want to, or whose trial is over."""
        now_ms = self._now_ms()
        for station in [each for each in self._restless if each.is_restless]:
            station.catch_up(now_ms, self._chip.random)
        self._restless = {station for station in self._restless if station.is_restless}

    def tune(self, drive: DriveSettings) -> None:
        """Send as to another display file of the same display from now on: channel, rate, whom it takes for whom."""
        if drive.display != self._named:
            raise InvalidInput(
                f"mock displays {self._named!r} and {drive.display!r} are two displays, not one with other settings",
                hint="give both display files the same name",
            )
        self._rate, self._channel = _checked_rate(drive), drive.channel
        self._chip.air.tune(drive.data_rate)
        self.site = self._open_site(drive)

    def listeners(self) -> dict[str, int]:
        """Which chip listens on which address."""
        return {station.ear.address: station.chip for station in reversed(self._stations)}

    def _open_site(self, drive: DriveSettings) -> Site:
        """Keys and chips of a display whose nodes hold the open key; it is known who listens where."""
        known = self.listeners()
        pairs = zip(drive.addresses, self._stations, strict=False)
        return Site(self.site.master, tuple(known.get(address.upper(), station.chip) for address, station in pairs))

    def close(self) -> None:
        """Let every node come to rest as it would without a host, remember all, and unlock the display."""
        self._closed = True
        if self._store is not None:
            self._settle()
            self.save()
            self._store.close()
            self._store = None

    def now_us(self) -> int:
        """See Radio."""
        return self._chip.now_us()

    def sleep_until(self, moment_us: int) -> None:
        """See Radio."""
        self._chip.sleep_until(moment_us)

    def carriers(self) -> Sequence[int]:
        """See Radio."""
        self._reach()
        self.sleep_until(self.now_us() + CHANNELS * LOOK_US)
        return self._chip.air.carriers()

    def set_power(self, power: str) -> None:
        """See Radio."""
        self._chip.air.power = power

    @property
    def is_virtual(self) -> bool:
        """Whether its time passes only as it is let pass."""
        return self._chip.is_virtual

    def _reach(self) -> None:
        """RadioGone while the radio is away; finding that out takes time."""
        gone = self._troubles.gone(self._now_ms())
        if gone is not None:
            self.sleep_until(self.now_us() + REOPEN_US)
            raise gone

    # The display

    def positions(self) -> tuple[Counts, ...]:
        """Counts of every node now."""
        return self._positions_at(self._now_ms())

    def motion(self) -> Motion:
        """Where all nodes were while anything moved: every 20 ms, and whenever a node set off or came to rest."""
        spans = sorted(span for station in self._stations for span in station.plant.spans())
        moments = {0, self._now_ms()}
        for begin, end in spans:
            moments.update(range(begin + -begin % SAMPLE_MS, end, SAMPLE_MS))
            moments.update((begin, end))
        return [(moment / 1000.0, self._positions_at(moment)) for moment in sorted(moments)]

    def ruler(self, number: int, axis: int, way: float) -> float:
        """What a ruler says [mm or degrees] where an axis (from 1) of a node has gone `way` by its counts."""
        is_other = self._stations[number - 1].plant.wiring.geared >> axis - 1 & 1
        return way * OTHER_GEAR if is_other else way

    def finger(self, number: int, axis: int, *, presses: bool) -> None:
        """Press the switch of an axis (from 1) of a node, or let it go."""
        station, switch = self._stations[number - 1], 1 << axis - 1
        wiring = station.plant.wiring
        if presses:
            station.pressed |= switch & ~(wiring.stuck_switches | station.dead_switches)
            wiring.stuck_switches |= station.pressed
        else:
            wiring.stuck_switches &= ~(station.pressed & switch)
            station.pressed &= ~switch

    def save(self) -> None:
        """Remember how the display stands now."""
        self._saved = self._progress()
        if self._store is not None:
            now_ms = self._now_ms()
            for node in self.nodes:
                node.advance(now_ms)
            self._store.save(self._state_at(now_ms))

    @property
    def known_rod(self) -> tuple[str, ...]:
        """As `rod`, but nothing if a node has moved since then."""
        return self._state_at(self._now_ms()).known_rod

    def _state_at(self, now_ms: int) -> MockState:
        pairs = zip(self._stations, self._positions_at(now_ms), strict=True)
        nodes = [
            Standing(counts, _left_at(station.node.memory, now_ms), station.lying(now_ms)) for station, counts in pairs
        ]
        return MockState(nodes, self._rod, self._rod_at)

    def _positions_at(self, now_ms: int) -> tuple[Counts, ...]:
        return tuple(station.plant.positions(now_ms) for station in self._stations)

    def _now_ms(self) -> int:
        return self.now_us() // 1000

    def _progress(self) -> Sequence[tuple[int, ...]]:
        """What a host that is killed now must find again: everything of a node that an answer may have told it."""
        pairs = [(station.node.memory, (station.flash.done, *station.program.progress)) for station in self._stations]
        return [
            (each.boot, *each.unhomed, each.estop, each.fault, each.run_tag, each.started, each.finished, *flash)
            for each, flash in pairs
        ]

    def _paces(self, spread: float) -> tuple[int, int, int]:
        x, y, z = (PER_MILLE - round(PER_MILLE * spread * self._chip.random.random()) for _ in range(3))
        return x, y, z

    def _build(self, drive: DriveSettings, state: MockState, spec: MockSpec) -> list[Station]:
        chips = mock_site(drive).chips
        stations = []
        for number, (node, chip) in enumerate(zip(state.nodes, chips, strict=True), start=1):
            board = node.board or Board.flashed(chip, node_settings(self.site.master, drive, number))
            memory = node.memory
            if spec.repower:
                memory = memory.restarted(rested=True)
                board = board.repowered()
            stations.append(Station(board, MotorPlant(node.counts, self._paces(spec.spread)), memory))
        return stations

    def _settle(self) -> None:
        now_ms = self._now_ms()
        for later_ms in range(now_ms, now_ms + REST_LIMIT_MS, REST_STEP_MS):
            for node in self.nodes:
                node.advance(later_ms)
            if not any(node.is_turning for node in self.nodes):
                break
        self._chip.skip_to(later_ms * 1000)


def _left_at(memory: Memory, now_ms: int) -> Memory:
    """What a node knows, for a display that is opened again with its clocks at 0."""
    return replace(memory, fault_ms=min(0, memory.fault_ms - now_ms), homing=0)


def mock_site(drive: DriveSettings) -> Site:
    """Keys and chip ids of a mock display: no secret, the same in every process."""
    chips = (
        int.from_bytes(blake2s(f"{drive.display}/{address}".encode(), digest_size=4).digest(), "little")
        for address in drive.addresses
    )
    return Site(ZERO_MASTER, tuple(chips))

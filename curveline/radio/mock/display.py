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
from curveline.radio.interface import Answer, check_frames
from curveline.radio.mock.chip import MockChip
from curveline.radio.mock.fault_injection import MishapStage, MockDisk, Packet, Troubles
from curveline.radio.mock.mock_node import Station
from curveline.radio.mock.spec import MockSpec, parse_spec
from curveline.radio.mock.store import MockState, Standing, Store, state_at_home
from curveline.radio.node.machine import NodeMachine
from curveline.radio.node.plant import PER_MILLE, MotorPlant
from curveline.radio.node.state import Identity, Memory
from curveline.radio.protocol.air_time import RATES_KBPS
from curveline.radio.protocol.codes import Counts
from curveline.radio.protocol.keys import ZERO_MASTER, Site
from curveline.radio.protocol.motion import axes_of
from curveline.radio.site.key_file import hardware_site

SAMPLE_MS = 20
OTHER_GEAR = 2.98
"""How much further an axis goes per count with a gear of 100:1 in place of 298:1."""
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
        state = state_at_home(count) if spec.fresh else store.load()
        radio = MockRadio(spec, drive, state, store, chip)
        radio.save()
    except BaseException:
        store.close()
        raise
    return radio


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
        self._rod, self._rod_at = state.rod, state.rod_at
        self._chip = chip or MockChip(spec, drive.data_rate)
        self.clamp, self.play, self.set_share = spec.clamp, spec.play, spec.set
        self.curvature, self.stiffness, self.hand = spec.curvature, spec.stiffness, spec.hand
        self.scatter = spec.scatter
        self._store = store
        self._channel = drive.channel
        self._closed = False
        self._stations = self._build(drive, state, spec)
        self._numbers = {address.upper(): number for number, address in enumerate(drive.addresses, start=1)}
        stage = MishapStage(self._stations, self._chip.air, self._chip.random)
        self._troubles = Troubles(spec.mishaps, stage)
        self.disk = MockDisk(stage)
        for station in self._stations:
            station.power_up(self._chip.random)
        self._saved = self._progress()

    @property
    def modelled(self) -> MockRadio:
        """This radio, as the display behind it, of which more is known than its nodes tell."""
        return self

    @property
    def nodes(self) -> list[NodeMachine]:
        """The nodes as they are now: one that restarts is another one."""
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
        return [self._exchange(address, payload) for address, payload in frames]

    def _exchange(self, address: str, payload: bytes) -> Answer:
        number = self._numbers.get(address.upper(), 0)
        self._troubles.before(Packet(self._now_ms(), number, payload))
        self.sleep_until(1000 * self._troubles.asleep_until_ms)
        self._reach()
        begin_us = self.now_us()
        station = self._stations[number - 1] if number else None
        listens = station is not None and station.channel in (None, self._channel)
        heard = station.exchange(self._chip.air, payload, begin_us) if station and listens else self._chip.air.unheard()
        self.sleep_until(begin_us + heard.took_us)
        if self._progress() != self._saved:
            self.save()
        return Answer(heard.payload, heard.retries)

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
        pairs = zip(self.nodes, self._positions_at(now_ms), strict=True)
        nodes = [Standing(counts, _left_at(node.memory, now_ms)) for node, counts in pairs]
        return MockState(nodes, self._rod, self._rod_at)

    def _positions_at(self, now_ms: int) -> tuple[Counts, ...]:
        return tuple(station.plant.positions(now_ms) for station in self._stations)

    def _now_ms(self) -> int:
        return self.now_us() // 1000

    def _progress(self) -> Sequence[tuple[int, ...]]:
        """What a host that is killed now must find again: everything of a node that an answer may have told it."""
        memories = [node.memory for node in self.nodes]
        return [
            (each.boot, *each.unhomed, each.estop, each.fault, each.run_tag, each.started, each.finished)
            for each in memories
        ]

    def _paces(self, spread: float) -> tuple[int, int, int]:
        x, y, z = (PER_MILLE - round(PER_MILLE * spread * self._chip.random.random()) for _ in range(3))
        return x, y, z

    def _build(self, drive: DriveSettings, state: MockState, spec: MockSpec) -> list[Station]:
        memories = [node.memory.restarted(rested=True) if spec.repower else node.memory for node in state.nodes]
        axes, site = axes_of(drive), Site(self.site.master, mock_site(drive).chips)
        return [
            Station(Identity(number, site), axes, MotorPlant(node.counts, self._paces(spec.spread)), memory)
            for number, (node, memory) in enumerate(zip(state.nodes, memories, strict=True), start=1)
        ]

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

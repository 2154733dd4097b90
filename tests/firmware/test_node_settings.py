"""The real image is given other settings over the air; power is cut at every word and in every erase meanwhile."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import replace
from itertools import pairwise
from pathlib import Path
from random import Random

import pytest

from curveline.drive_settings import DriveSettings
from curveline.radio.host.link import Halted, read_status
from curveline.radio.host.node_status import NodeStatus
from curveline.radio.host.settings_errand import SettingsErrand
from curveline.radio.interface import Answer
from curveline.radio.protocol.codes import SettingsOperation
from curveline.radio.protocol.keys import Site
from curveline.radio.protocol.node_settings import NodeSettings, node_settings
from curveline.radio.protocol.settings_frames import ALL_PIECES, SettingsFacts, pieces_of
from radio import chipbank as nrf

from .display import Rig
from .fleet import MASTER, ChipRadio
from .hand import Hand
from .image import Image
from .kl26 import RESET_PIN, RESET_WATCHDOG, PowerCut
from .machine import LAMP

STEADY_US = 100_000
"""After so long the supply counts as up."""
RESTART_US = 450_000
"""So long it takes at most from an order to the first answer of the restarted node."""
TRIAL_US = 30_000_000
NEW_MASTER = bytes(range(60, 76))
OTHER_CHANNEL = 90


class Desk:
    """A homed node, the settings that it has and those it is to get, and a host's radio for either."""

    def __init__(self, image: Image, flash: bytes, folder: Path) -> None:
        self.rig = Rig(image, flash, folder, count=1)
        self.fleet, (self.machine,) = self.rig.fleet, self.rig.machines
        self.old = self.rig.plan.drive
        self.new = replace(self.old, channel=OTHER_CHANNEL, data_rate="2Mbps", addresses=("D2D2D2D255",))
        self.fleet.run(STEADY_US)
        self.before = bytes(self.machine.flash)

    def settings(self, generation: int = 1, drive: DriveSettings | None = None) -> NodeSettings:
        return node_settings(NEW_MASTER, drive or self.new, 1, generation)

    @contextmanager
    def session(self, drive: DriveSettings, master: bytes) -> Iterator[ByHand]:
        """A session with the node, if it is under these settings."""
        before = self.fleet.drive, self.fleet.site
        self.fleet.drive, self.fleet.site = drive, Site(master, before[1].chips)
        yield ByHand(ChipRadio(self.fleet), drive)
        self.fleet.drive, self.fleet.site = before

    def under_old(self) -> SettingsFacts:
        with self.session(self.old, MASTER) as host:
            return host.standing()

    def under_new(self) -> SettingsFacts:
        with self.session(self.new, NEW_MASTER) as host:
            return host.standing()

    def status(self, drive: DriveSettings, master: bytes) -> list[NodeStatus]:
        with self.session(drive, master) as host:
            return read_status(host.radio, drive)

    def lamp_times(self, us: int) -> list[int]:
        """Times between changes of the lamp [us]."""
        changes: list[int] = []
        level = self.machine.chip.output(*LAMP)
        for _ in range(us // 2_000):
            self.fleet.run(2_000)
            now = self.machine.chip.output(*LAMP)
            changes += [self.fleet.now_us] if now != level else []
            level = now
        return [later - sooner for sooner, later in pairwise(changes)]

    def hurry(self, until_us: int) -> None:
        """Time passes at once: what the program has of it since its start is put forward."""
        self.machine.cpu.write(self.machine.image.symbols["ticks"], (until_us // 1000).to_bytes(8, "little"))

    @property
    def channel(self) -> int:
        """Where its radio listens."""
        return self.fleet.chips[0].command(bytes([nrf.RF_CH, 0]))[1]

    def offer(self, settings: NodeSettings) -> None:
        """Store and try."""
        with self.session(self.old, MASTER) as host:
            host.store(settings)
            host.attempt()
        self.fleet.run(RESTART_US)


class ByHand(SettingsErrand):
    """A session in which every frame is sent once."""

    def __init__(self, radio: ChipRadio, drive: DriveSettings) -> None:
        super().__init__(radio, drive, 1)
        self.radio = radio
        self.begin(0)

    def send_pieces(self, settings: NodeSettings) -> None:
        for number, piece in enumerate(pieces_of(settings.record())):
            self._tell(SettingsOperation.PIECE, number, piece)

    def order(self, operation: SettingsOperation) -> None:
        self._order += 1
        self._tell(operation, self._order)

    def pieces(self) -> int:
        return self.standing().pieces


@pytest.fixture
def desk(image: Image, homed_flash: bytes, tmp_path: Path) -> Desk:
    return Desk(image, homed_flash, tmp_path)


def test_other_settings_are_stored_tried_and_kept(desk: Desk) -> None:
    assert desk.rig.status()[0].state == "ready"
    assert desk.under_old() == SettingsFacts(0, False, 0, 0, 0)
    desk.machine.cpu.paint_stack()
    with desk.session(desk.old, MASTER) as host:
        host.send_pieces(desk.settings())
        assert host.pieces() == ALL_PIECES
        host.order(SettingsOperation.STORE)
        assert host.standing() == SettingsFacts(0, False, 0, 0, 1)
        host.attempt()
    desk.fleet.run(RESTART_US)
    assert desk.channel == OTHER_CHANNEL
    with desk.session(desk.new, NEW_MASTER) as host:
        found = host.standing()
        assert (found.on_trial, found.generation, found.stored) == (True, 1, 1)
        assert 28 <= found.left_s <= 30
        host.keep()
        assert host.standing() == SettingsFacts(0, False, 1, 0, 1)
        host.give_back()
    symbols = desk.machine.image.symbols
    used = desk.machine.cpu.stack_used()
    print(f"stack: {used} bytes")
    assert used <= 0.75 * (symbols["stack_end"] - symbols["stack_begin"]), "of the restart, too"
    for restart in (desk.machine.power_cycle, lambda: desk.machine.reset(RESET_WATCHDOG)):
        restart()
        desk.fleet.run(20_000)
        assert desk.under_new() == SettingsFacts(0, False, 1, 0, 1)
    (node,) = desk.status(desk.new, NEW_MASTER)
    assert (node.state, node.boot_cause) == ("ready", "watchdog")


def test_while_a_motor_trembles_the_node_is_busy_and_takes_them_later(desk: Desk) -> None:
    """Somebody has touched an axis: that is no fault of the flash, and soon over."""
    motor = desk.machine.motors[0]
    with desk.session(desk.old, MASTER) as host:
        host.send_pieces(desk.settings())
        motor.speed = 9000.0
        desk.fleet.run(20_000)
        with pytest.raises(Halted, match="it has something else to do"):
            host.store(desk.settings())
    desk.fleet.run(2_000_000)
    with desk.session(desk.old, MASTER) as host:
        host.store(desk.settings())
        assert host.standing().stored == 1


def test_a_node_that_is_about_to_start_anew_lets_go_of_its_motors(desk: Desk) -> None:
    """It hears nobody any more, so nothing of its own may keep its axes from coming to rest."""
    assert desk.machine.drivers_on
    with desk.session(desk.old, MASTER) as host:
        host.store(desk.settings())
        host.order(SettingsOperation.TRY)
    desk.fleet.run(50_000)
    assert desk.channel == desk.old.channel, "it has not started anew yet"
    assert not desk.machine.drivers_on
    desk.fleet.run(RESTART_US)
    assert desk.channel == OTHER_CHANNEL


def test_a_node_that_nobody_hears_goes_back_and_keeps_its_position(desk: Desk) -> None:
    desk.offer(desk.settings())
    assert desk.channel == OTHER_CHANNEL
    lamp = desk.lamp_times(4_000_000)
    assert [round(gap / 1e6, 2) for gap in lamp] == [1.0] * len(lamp), "a second on, a second off"
    desk.hurry(TRIAL_US - 200_000)
    desk.fleet.run(150_000)
    assert desk.channel == OTHER_CHANNEL
    desk.fleet.run(100_000 + RESTART_US)
    assert desk.channel == desk.old.channel
    assert desk.under_old() == SettingsFacts(0, False, 0, 0, 0)
    (node,) = desk.rig.status()
    assert (node.state, node.boot_cause) == ("ready", "software")


@pytest.mark.parametrize("restart", ["power", "pin", "watchdog", "drop"])
def test_whatever_restarts_it_ends_a_trial(desk: Desk, restart: str) -> None:
    desk.offer(desk.settings())
    assert desk.channel == OTHER_CHANNEL
    if restart == "power":
        desk.machine.power_cycle()
    elif restart == "drop":
        with desk.session(desk.new, NEW_MASTER) as host:
            host.drop()
        desk.fleet.run(RESTART_US)
    else:
        desk.machine.reset({"pin": RESET_PIN, "watchdog": RESET_WATCHDOG}[restart])
    desk.fleet.run(20_000)
    assert desk.channel == desk.old.channel
    assert desk.under_old() == SettingsFacts(0, False, 0, 0, 0)
    assert desk.rig.status()[0].state == "ready"


def test_on_trial_nothing_moves_and_an_emergency_stop_outlives_the_end(desk: Desk) -> None:
    desk.offer(desk.settings())
    with desk.session(desk.new, NEW_MASTER) as host:
        stand_in = Hand(desk.fleet, host.radio)
        stand_in.poll(release=1, load=(1, (4000, 0, 0), 0))
        stand_in.poll(release=1, load=(1, (4000, 0, 0), 0))
        desk.fleet.run(100_000)
        assert not any(motor.speed for motor in desk.machine.motors)
        stand_in.send(stand_in.peer.estop())
    desk.fleet.run(5_000)
    desk.hurry(TRIAL_US)
    desk.fleet.run(RESTART_US)
    assert desk.channel == desk.old.channel
    assert desk.rig.status()[0].state == "estop"
    desk.machine.power_cycle()
    desk.fleet.run(20_000)
    assert desk.rig.status()[0].state == "ready"


def test_other_limits_void_the_position_and_the_old_ones_do_not_bring_it_back(desk: Desk) -> None:
    bias = desk.old.axes[1]
    axes = (desk.old.axes[0], replace(bias, low=bias.low - 1.0), desk.old.axes[2])
    desk.new = replace(desk.new, axes=axes)
    desk.offer(desk.settings())
    assert desk.status(desk.new, NEW_MASTER)[0].state == "unhomed"
    desk.machine.power_cycle()
    desk.fleet.run(20_000)
    assert desk.rig.status()[0].state == "unhomed", "others were there"


def test_what_nobody_may_read_is_not_on_the_air(desk: Desk) -> None:
    seen: list[bytes] = []
    with desk.session(desk.old, MASTER) as host:
        send = host.radio.exchange

        def listen(frames: Sequence[tuple[str, bytes]]) -> Sequence[Answer]:
            seen.extend(payload for _, payload in frames)
            answers = send(frames)
            seen.extend(answer.payload or b"" for answer in answers)
            return answers

        host.radio.exchange = listen  # type: ignore[method-assign]
        host.send_pieces(desk.settings())
        host.order(SettingsOperation.STORE)
        assert host.standing().stored == 1
    air = b"".join(seen)
    assert not any(NEW_MASTER[at : at + 3] in air for at in range(13))


def test_a_sector_takes_a_change_after_the_other(desk: Desk) -> None:
    drives, masters = (desk.old, desk.new), (MASTER, NEW_MASTER)
    for generation in range(1, 4):
        now, then = (generation - 1) % 2, generation % 2
        with desk.session(drives[now], masters[now]) as host:
            host.store(node_settings(masters[then], drives[then], 1, generation))
            host.attempt()
        desk.fleet.run(RESTART_US)
        with desk.session(drives[then], masters[then]) as host:
            host.keep()
            assert host.standing().generation == generation


# Power cuts


def change(desk: Desk) -> None:
    """All of it, as quickly as can be."""
    with desk.session(desk.old, MASTER) as host:
        host.send_pieces(desk.settings())
        host.order(SettingsOperation.STORE)
        host.order(SettingsOperation.TRY)
    desk.fleet.run(RESTART_US)
    with desk.session(desk.new, NEW_MASTER) as host:
        host.order(SettingsOperation.KEEP)
        desk.fleet.run(5_000)


def cut_everywhere(desk: Desk, seed: int) -> tuple[int, int]:
    """Cut the power in every flash command of a change, each time on a node as it was; how many cuts, and left new."""
    chip = desk.machine.chip
    cuts = new = 0
    while True:
        desk.machine.write_flash(0, desk.before)
        desk.machine.power_cycle()
        desk.fleet.run(20_000)
        chip.chance, chip.cut_at = Random(seed + cuts), chip.flash_commands + cuts + 1
        try:
            change(desk)
        except PowerCut:
            cuts += 1
        else:
            chip.cut_at = 0
            return cuts, new
        desk.machine.power_cycle()
        desk.fleet.run(20_000)
        is_new = desk.channel == OTHER_CHANNEL
        found = desk.under_new() if is_new else desk.under_old()
        assert found == SettingsFacts(0, False, int(is_new), 0, int(is_new)), cuts
        desk.machine.power_cycle()
        desk.fleet.run(20_000)
        assert desk.channel == (OTHER_CHANNEL if is_new else desk.old.channel), cuts
        new += is_new


def test_power_may_fail_in_every_flash_command_of_a_change(desk: Desk) -> None:
    cuts, new = cut_everywhere(desk, 1)
    print(f"{cuts} cuts, {new} left the new settings")
    assert cuts == 32, "an erase, 21 words of a record, 3 marks, 7 words of the journal of boots"
    assert new <= 1, "only the word that keeps them"


@pytest.mark.campaign
def test_power_may_fail_in_every_flash_command_whatever_is_left(desk: Desk) -> None:
    found = [cut_everywhere(desk, 1000 * seed) for seed in range(50, 60)]
    print(found)
    assert 0 < sum(new for _, new in found) < len(found), "the word that keeps them is there or not"

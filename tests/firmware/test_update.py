"""A node's program replaced over the air, on the real loader: loss, cuts in the flash, wrong and damaged programs."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from random import Random

import pytest

from curveline.drive_settings import drive_settings
from curveline.driving.site_keys import new_keys, node_image, read_keys
from curveline.errors import InvalidInput
from curveline.radio.host import updating
from curveline.radio.host.link import Halted, read_status
from curveline.radio.host.service import home_axes
from curveline.radio.host.stop_causes import Cause
from curveline.radio.host.updating import LoaderLink, ProgramUpdate, update_node
from curveline.radio.protocol.codes import NodeState
from curveline.radio.protocol.keys import Site
from curveline.radio.site.intel_hex import flash_of
from curveline.radio.site.program_file import DESCRIPTION_AT, MARKS_AT, PROGRAM_AT, check_loader, program_in
from curveline.shapes.files import read_display

from .display import tied
from .fleet import STORE, ChipRadio, Fleet
from .hand import Hand
from .image import Image
from .kl26 import RESET_PIN, RESET_SOFTWARE, PowerCut
from .machine import BUTTON
from .updatable import BLANK, KEPT, TRIED, WHOLE, Updatable, build_updatable, little_program, mark, node_with, stored

LITTLE = little_program()


@pytest.fixture(scope="session")
def updatable(image_folder: Path, image: Image) -> Updatable:
    """The loader and the program behind it."""
    return build_updatable(image_folder)


def test_a_node_with_a_loader_works_like_one_without(updatable: Updatable) -> None:
    fleet, radio = node_with(updatable.image)
    (node,) = read_status(radio, fleet.drive)
    assert (node.state, node.boot) == ("unhomed", 1)
    (machine,) = fleet.machines
    assert machine.chip.protection == [0xE0, 0, 0, 0], "all but what programs write"
    assert machine.watchdog_resets == 0


@pytest.mark.parametrize("loss", [0.0, 0.3])
def test_a_little_program_arrives_whole(updatable: Updatable, loss: float) -> None:
    fleet, radio = node_with(updatable.image, loss=loss, lacks=(KEPT,))
    (machine,) = fleet.machines
    link = LoaderLink(radio, fleet.drive, 1)
    ident = link.greet()
    assert ident is not None
    assert ident.state is NodeState.BOOT
    link.send(LITTLE)
    assert stored(machine, LITTLE)
    assert mark(machine, WHOLE) == bytes(4)
    assert mark(machine, TRIED) == mark(machine, KEPT) == BLANK
    link.leave()
    fleet.run(500_000)
    assert link.greet() is None, "the program runs, and is not heard"
    fleet.run(1_500_000)
    ident = link.greet()
    assert ident is not None
    assert ident.state is NodeState.BOOT, "the watchdog brought the loader back"
    assert machine.watchdog_resets == 1


CUTS = (1, 2, 9, 10, 11, 241, 242, 243, 244)
"""Flash commands of an update of one sector: erase, 8 words, erase, 231 words, and three marks."""
LAST_CUT = 244


@pytest.mark.parametrize("at", CUTS)
def test_a_cut_in_the_flash_costs_time_and_no_more(updatable: Updatable, at: int) -> None:
    assert cuts_until_it_came(updatable, at, seed=at) == 1


@pytest.mark.campaign
@pytest.mark.parametrize("seed", range(3))
def test_a_cut_in_any_flash_operation_costs_time_and_no_more(updatable: Updatable, seed: int) -> None:
    for at in range(1, LAST_CUT + 1):
        assert cuts_until_it_came(updatable, at, seed=1000 * seed + at) == 1


def cuts_until_it_came(updatable: Updatable, at: int, seed: int) -> int:
    """Cut the power in a flash command of an update, and go on until the program has arrived; how often it was cut."""
    fleet, radio = node_with(updatable.image, loss=0.1, seed=seed, lacks=(KEPT,))
    (machine,) = fleet.machines
    chip, link, cuts = machine.chip, LoaderLink(radio, fleet.drive, 1), 0
    chip.chance, chip.cut_at = Random(seed), chip.flash_commands + at
    while mark(machine, TRIED) == BLANK or not stored(machine, LITTLE):
        try:
            if link.greet() is not None:
                link.send(LITTLE)
                link.leave()
            fleet.run(20_000)
        except PowerCut:
            cuts += 1
            machine.power_cycle()
        assert cuts <= 1
    assert mark(machine, WHOLE) != BLANK
    assert mark(machine, KEPT) == BLANK
    fleet.run(1_500_000)
    assert link.greet() is not None, "the loader is there, whatever the program does"
    return cuts


def test_what_was_there_is_not_sent_again(updatable: Updatable) -> None:
    """The whole program of which two sectors are missing, with noise in their place."""
    program, missing = updatable.program, (3, 17)
    fleet, radio = node_with(updatable.image, lacks=(WHOLE, TRIED, KEPT, *missing))
    (machine,) = fleet.machines
    link = LoaderLink(radio, fleet.drive, 1)
    assert link.greet() is not None
    machine.write_flash(DESCRIPTION_AT, program.description(radio.site.node_key(1)))
    for sector in missing:
        machine.write_flash(PROGRAM_AT + 1024 * sector, bytes(1024))
    link.send(program)
    assert stored(machine, program)
    assert 2 * 64 <= link.frames < 2 * 64 + 100
    link.leave()
    fleet.run(200_000)
    assert (mark(machine, TRIED), mark(machine, KEPT)) == (bytes(4), BLANK)
    assert read_status(radio, fleet.drive)[0].state == "unhomed"


def test_a_program_that_is_not_what_was_described_never_starts(updatable: Updatable) -> None:
    fleet, radio = node_with(updatable.image, lacks=(KEPT,))
    (machine,) = fleet.machines
    link = LoaderLink(radio, fleet.drive, 1)
    assert link.greet() is not None
    damaged = replace(LITTLE, data=LITTLE.data[:-1] + b"?")
    key = radio.site.node_key(1)
    object.__setattr__(damaged, "description", lambda node_key: LITTLE.description(key))
    with pytest.raises(Halted) as caught:
        link.send(damaged)
    assert caught.value.halt.cause is Cause.UNFLASHED
    assert mark(machine, WHOLE) == BLANK
    link.leave()
    fleet.run(300_000)
    assert link.greet() is not None
    link.send(LITTLE)
    assert stored(machine, LITTLE)


def test_a_program_for_other_settings_is_refused_before_anything_is_erased(updatable: Updatable) -> None:
    fleet, radio = node_with(updatable.image, lacks=(KEPT,))
    (machine,) = fleet.machines
    link = LoaderLink(radio, fleet.drive, 1)
    assert link.greet() is not None
    before = bytes(machine.flash)
    with pytest.raises(Halted) as caught:
        link.send(replace(LITTLE, settings=2))
    assert caught.value.halt.cause is Cause.UNFLASHED
    assert "settings" in caught.value.message
    assert bytes(machine.flash) == before


def test_a_worn_word_is_told_and_no_program_starts(updatable: Updatable, monkeypatch: pytest.MonkeyPatch) -> None:
    fleet, radio = node_with(updatable.image, lacks=(KEPT,))
    (machine,) = fleet.machines
    chip, worn = machine.chip, PROGRAM_AT + 400
    carry_out = chip._flash_command

    def wearily(bytes_: list[int]) -> None:
        if bytes_[0] == 0x09 or bytes_[1] << 16 | bytes_[2] << 8 | bytes_[3] != worn:
            carry_out(bytes_)

    monkeypatch.setattr(chip, "_flash_command", wearily)
    link = LoaderLink(radio, fleet.drive, 1)
    assert link.greet() is not None
    with pytest.raises(Halted) as caught:
        link.send(LITTLE)
    assert caught.value.halt.cause is Cause.UNFLASHED
    assert "sector 1" in caught.value.message
    link.leave()
    fleet.run(100_000)
    ident = link.greet()
    assert ident is not None
    assert ident.state is NodeState.BOOT


def test_frames_of_another_time_do_nothing(updatable: Updatable) -> None:
    fleet, radio = node_with(updatable.image, lacks=(KEPT,))
    (machine,) = fleet.machines
    recorded: list[tuple[str, bytes]] = []
    exchange = radio.exchange

    def listening(frames):  # type: ignore[no-untyped-def]
        recorded.extend(frames)
        return exchange(frames)

    radio.exchange = listening  # type: ignore[method-assign]
    link = LoaderLink(radio, fleet.drive, 1)
    assert link.greet() is not None
    link.send(LITTLE)
    radio.exchange = exchange  # type: ignore[method-assign]
    other = little_program(seed=2)
    assert link.greet() is not None
    link.send(other)
    before = bytes(machine.flash[:0xF800])
    for frame in recorded:
        exchange([frame])
    assert link.greet() is not None
    assert bytes(machine.flash[:0xF800]) == before
    assert stored(machine, other)


def test_a_stranger_cannot_begin(updatable: Updatable, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(updating, "SILENCE_US", 300_000)
    fleet, radio = node_with(updatable.image, lacks=(KEPT,))
    (machine,) = fleet.machines
    link = LoaderLink(radio, fleet.drive, 1)
    assert link.greet() is not None
    before = bytes(machine.flash)
    link._key = bytes(16)
    with pytest.raises(Halted):
        link.send(LITTLE)
    assert bytes(machine.flash) == before


def test_the_button_at_power_on_brings_the_loader_and_patience_the_program(updatable: Updatable) -> None:
    fleet, radio = node_with(updatable.image)
    (machine,) = fleet.machines
    machine.set_pin(BUTTON, 0)
    machine.power_cycle()
    fleet.run(20_000)
    machine.set_pin(BUTTON, 1)
    ident = LoaderLink(radio, fleet.drive, 1).greet()
    assert ident is not None
    assert ident.state is NodeState.BOOT
    assert not machine.drivers_on
    fleet.run(21_000_000)
    assert read_status(radio, fleet.drive)[0].state == "unhomed"


def test_a_node_that_waits_in_its_loader_says_so_to_whoever_asks(updatable: Updatable) -> None:
    fleet, radio = node_with(updatable.image, lacks=(WHOLE,))
    (machine,) = fleet.machines
    before = bytes(machine.flash)
    (node,) = read_status(radio, fleet.drive)
    assert (node.state, node.counts, node.boot_cause) == ("boot", None, "power-on")
    assert "in its loader" in node.obstacle
    with pytest.raises(Halted) as caught:
        home_axes(radio, fleet.drive, 1)
    assert caught.value.halt.cause is Cause.IN_LOADER
    assert bytes(machine.flash) == before


def test_a_node_flashed_with_an_image_of_its_own_runs_behind_its_loader(
    updatable: Updatable, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """As `curveline keys node 2 --hex firmware/build/updatable.hex` makes it."""
    monkeypatch.setenv("CURVELINE_KEYS", str(tmp_path / "site.json"))
    new_keys()
    made = node_image(2, updatable.path, tmp_path / "two.hex", "single")
    flash = flash_of(made.path.read_text(), str(made.path))
    drive = drive_settings(read_display("single"))
    fleet = Fleet(updatable.image, drive)
    machine = fleet.machines[1]
    machine.write_flash(0, flash)
    machine.power_cycle()
    fleet.run(100_000)
    radio = ChipRadio(fleet)
    radio.site = Site(read_keys().master, fleet.site.chips)
    assert [node.state for node in read_status(radio, drive)] == ["silent", "unhomed"], "the other one has another key"
    assert machine.chip.protection == [0xE0, 0, 0, 0]
    assert (mark(machine, WHOLE), mark(machine, KEPT)) == (bytes(4), bytes(4))


@pytest.mark.parametrize(
    ("at", "length", "why"),
    [
        (0, 0x2800, "no loader in front"),
        (PROGRAM_AT, 0x400, "no program behind"),
        (DESCRIPTION_AT, 0x400, "not told that there is a program"),
        (DESCRIPTION_AT, 4, "not told"),
        (MARKS_AT + 4 * 5, 4, "not told"),
        (MARKS_AT + 4 * WHOLE, 4, "not told"),
    ],
)
def test_half_of_an_image_with_a_loader_is_no_image_for_a_node(
    updatable: Updatable, at: int, length: int, why: str
) -> None:
    flash = bytearray(updatable.image.flash)
    flash[at : at + length] = b"\xff" * length
    if at == 0:
        flash[:8] = flash[PROGRAM_AT : PROGRAM_AT + 8]
    with pytest.raises(InvalidInput, match=why):
        check_loader(hex_of(flash), "half.hex")


def test_an_image_without_a_loader_needs_none(image_folder: Path, updatable: Updatable) -> None:
    assert check_loader(updatable.path.read_text(), "updatable.hex")
    assert not check_loader((image_folder / "node.hex").read_text(), "node.hex")


def hex_of(flash: bytes | bytearray) -> str:
    """As Intel HEX, with what is not blank."""
    rows = [(at, bytes([16, at >> 8, at & 0xFF, 0]) + flash[at : at + 16]) for at in range(0, len(flash), 16)]
    whole = [fields for at, fields in rows if fields[4:] != b"\xff" * 16]
    return "".join(f":{fields.hex()}{-sum(fields) & 0xFF:02x}\n" for fields in whole) + ":00000001FF\n"


def test_only_a_program_behind_a_loader_can_be_sent(image_folder: Path, updatable: Updatable) -> None:
    path = image_folder / "node.hex"
    with pytest.raises(InvalidInput, match="no program behind a loader"):
        program_in(path.read_text(), str(path))
    assert program_in(updatable.path.read_text(), str(updatable.path)).number == 4


# From one program to the next


def test_a_node_gets_another_program_and_keeps_its_position(updatable: Updatable, homed_flash: bytes) -> None:
    """As a user does it."""
    fleet, radio = node_with(updatable.image, loss=0.1)
    (machine,) = fleet.machines
    machine.write_flash(STORE, tied(homed_flash, 1))
    machine.power_cycle()
    fleet.run(200_000)
    assert read_status(radio, fleet.drive)[0].state == "ready"
    before = (mark(machine, WHOLE), mark(machine, KEPT))
    assert before == (bytes(4), bytes(4))
    parts: list[float] = []
    done = update_node(radio, fleet.drive, 1, ProgramUpdate(updatable.program, seen=parts.append))
    assert (done.was, done.firmware) == (4, 4)
    assert parts[-1] == 1.0
    assert stored(machine, updatable.program)
    assert mark(machine, KEPT) == bytes(4)
    (node,) = read_status(radio, fleet.drive)
    assert (node.state, node.boot_cause) == ("ready", "software")
    again = update_node(radio, fleet.drive, 1, ProgramUpdate(updatable.program))
    assert again.frames < 20 < 64 * 40 < done.frames, "it has it already"
    assert read_status(radio, fleet.drive)[0].state == "ready"
    assert machine.watchdog_resets == 0


@pytest.mark.parametrize("cause", [RESET_PIN, RESET_SOFTWARE])
def test_a_stop_outlives_resets_behind_a_loader_and_ends_with_the_power(
    updatable: Updatable, homed_flash: bytes, cause: int
) -> None:
    fleet, radio = node_with(updatable.image)
    (machine,) = fleet.machines
    machine.write_flash(STORE, tied(homed_flash, 1))
    machine.power_cycle()
    fleet.run(100_000)
    hand = Hand(fleet, radio)
    hand.status()
    hand.send(hand.peer.estop())
    fleet.run(600_000)
    with pytest.raises(Halted):
        update_node(radio, fleet.drive, 1, ProgramUpdate(updatable.program))
    machine.set_pin(BUTTON, 0)
    machine.reset(cause)
    fleet.run(50_000)
    machine.set_pin(BUTTON, 1)
    assert LoaderLink(radio, fleet.drive, 1).greet() is not None, "the button has brought the loader"
    machine.reset(cause)
    fleet.run(100_000)
    assert read_status(radio, fleet.drive)[0].state == "estop"
    machine.set_pin(BUTTON, 0)
    machine.power_cycle()
    fleet.run(50_000)
    machine.set_pin(BUTTON, 1)
    machine.reset(RESET_SOFTWARE)
    fleet.run(100_000)
    assert read_status(radio, fleet.drive)[0].state == "ready", "the loader has seen that the power was away"


@pytest.mark.campaign
@pytest.mark.parametrize("loss", [0.0, 0.1, 0.3])
def test_the_whole_program_arrives(updatable: Updatable, loss: float) -> None:
    lacks = (*range(len(updatable.program.sectors)), WHOLE, TRIED, KEPT)
    fleet, radio = node_with(updatable.image, loss=loss, lacks=lacks)
    (machine,) = fleet.machines
    machine.write_flash(PROGRAM_AT, b"\xff" * (DESCRIPTION_AT - PROGRAM_AT))
    begin_us = fleet.now_us
    link = LoaderLink(radio, fleet.drive, 1)
    assert link.greet() is not None
    link.send(updatable.program)
    print(f"{len(updatable.program.data)} bytes, loss {loss:.0%}: {(fleet.now_us - begin_us) / 1e6:.1f} s")
    assert stored(machine, updatable.program)
    done = update_node(radio, fleet.drive, 1, ProgramUpdate(updatable.program))
    assert (done.was, done.firmware) == (None, 4)
    assert mark(machine, KEPT) == bytes(4)
    assert machine.watchdog_resets == 0

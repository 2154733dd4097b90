"""Other settings for nodes over the air: what will change, carried out node by node, and what came of each."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any

from curveline._version import __version__
from curveline.drive_settings import AXES, DEFAULT_DISPLAY, MAX_CHANNEL, DriveSettings, drive_settings
from curveline.driving.tuning import RadioTuner, is_open_mock
from curveline.errors import InvalidInput
from curveline.listening import SILENT, Listener
from curveline.notebook import html_of
from curveline.radio.host.link import Halted
from curveline.radio.host.resettling import NodeFound, NodeSeat, Resettling
from curveline.radio.host.stop_causes import display_option
from curveline.radio.protocol.keys import ZERO_MASTER, Site
from curveline.radio.protocol.node_settings import NodeSettings
from curveline.radio.site import key_file
from curveline.radio.site.key_file import UNKNOWN_CHIP, SiteFile, default_path, fingerprint_of
from curveline.scene import Display
from curveline.system.files import AnyPath

HEAD = ("node", "setting", "now", "then")
LIMITS = ("low", "high", "speed", "acceleration")


@dataclass(frozen=True)
class Formerly:
    """Where nodes listen that get other settings, as far as it is not where the display file says."""

    display: AnyPath | Display | None = None  # whose channel, data rate and addresses they have
    channel: int | None = None  # if only that is another one
    number: int | None = None  # of a single node, in its row, from 1
    keys: AnyPath | None = None  # the key file for which they were flashed


@dataclass(frozen=True)
class Setting:
    """A setting that a node will have another value of; limits in counts, counts/s and counts/s^2."""

    name: str  # such as channel, or translate high
    old: object  # what the node has said, or proven by answering
    new: object  # what it is to be


@dataclass(frozen=True)
class NodeChange:
    """What one node is to get; nothing of it is done yet."""

    node: int  # in the row of the new display, from 1
    address: str  # on which it will listen
    settings: tuple[Setting, ...]  # that change, none if it holds them all
    on_trial: bool  # it runs under them already, and has to be told to keep them
    moved: bool  # what it counted from is not what it will count from
    homed: bool  # it is now

    @property
    def is_due(self) -> bool:
        """Whether there is anything to be done."""
        return bool(self.settings) or self.on_trial

    @property
    def must_home(self) -> bool:
        """Whether it has to be homed before it can be driven."""
        return self.moved or not self.homed

    def document(self) -> dict[str, Any]:
        """The same as plain data."""
        return {**asdict(self), "must_home": self.must_home}


@dataclass(frozen=True)
class Resettled:
    """What came of a node."""

    node: int  # in the row, from 1
    changed: bool  # False if it held these settings before
    generation: int  # how often its settings were changed over the air since it was flashed
    must_home: bool  # before it can be driven

    def document(self) -> dict[str, Any]:
        """The same as plain data."""
        return asdict(self)


class SettingsChange:
    """Other settings for some nodes of a display: look at `nodes`, then `carry_out`, or `close` it and nothing happens.

    It can be broken off anywhere and begun again: a node is under the old or the new settings half a minute later.
    """

    def __init__(self, tuner: RadioTuner, seats: Sequence[tuple[NodeSeat, NodeSeat]], site: SiteFile | None) -> None:
        """`seats` are where each node is to be and where it was, `site` the key file that will know them."""
        self.tuner = tuner
        self.site = site
        self.named = DEFAULT_DISPLAY
        """How advice names the display."""
        self._told: Callable[[str], None] = SILENT.note
        self._ways = [Resettling(tuner, new, old, self._note) for new, old in seats]
        self._nodes: tuple[NodeChange, ...] = ()

    def __enter__(self) -> SettingsChange:
        return self

    def __exit__(self, *error: object) -> None:
        self.close()

    def close(self) -> None:
        """Give the radio back."""
        self.tuner.close()

    def survey(self) -> None:
        """Find the nodes and fill in what will change; LinkError if one cannot be found, or is not alone there."""
        found = []
        for way in self._ways:
            with self._naming():
                found.append(way.find())
                way.check_places(found[-1])
        self._nodes = tuple(map(_change_of, self._ways, found))

    @property
    def nodes(self) -> tuple[NodeChange, ...]:
        """What each node is to get."""
        return self._nodes

    @property
    def is_due(self) -> bool:
        """Whether any node is to get anything."""
        return any(each.is_due for each in self.nodes)

    def carry_out(self, listener: Listener = SILENT) -> list[Resettled]:
        """Change one node after the other; each is recorded in the key file as soon as it has its settings.

        `listener` is told what is done, and which node may still return to its old settings if this is broken off.
        """
        done = []
        for way, change in zip(self._ways, self.nodes, strict=True):
            self._told = _of_node(listener, change.node)
            with self._naming(), self._told_of_trials(way):
                found = way.carry_out()
            self._adopt(way)
            generation = found.standing.generation
            done.append(Resettled(change.node, change.is_due, generation, any(found.report.axes)))
        return done

    @contextmanager
    def _naming(self) -> Iterator[None]:
        try:
            yield
        except Halted as error:
            raise Halted(replace(error.halt, display=self.named)) from None

    @contextmanager
    def _told_of_trials(self, way: Resettling) -> Iterator[None]:
        try:
            yield
        except BaseException:
            if way.may_be_on_trial:
                self._note("it may be trying its new settings: half a minute later it is back under the old ones")
                self._note("the same again finds out how it is, and goes on from there")
            raise

    def _adopt(self, way: Resettling) -> None:
        """Record on which address the device listens now."""
        address, chip = way.new.address, way.new.site.chips[way.new.number - 1]
        if self.site is not None and self.site.chips.get(address) != chip:
            before = self.site.chips.get(address)
            self.site = key_file.adopt(self.site, {address: chip})
            instead = "" if before is None else f", in place of chip {before:08x}"
            self._note(f"chip {chip:08x} on {address} is recorded in {self.site.path}{instead}")

    def rows(self) -> list[tuple[str, str, str, str]]:
        """A row of every setting that changes, as `HEAD` names them."""
        return [(str(each.node), row.name, str(row.old), str(row.new)) for each in self.nodes for row in each.settings]

    def document(self) -> list[dict[str, Any]]:
        """What is to change, as plain data."""
        return [each.document() for each in self.nodes]

    def _repr_html_(self) -> str:
        return html_of("settings that change", [HEAD, *self.rows()])

    def _note(self, text: str) -> None:
        self._told(text)


def told_settings(drive: DriveSettings, spec: str, done: Sequence[Resettled], change: SettingsChange) -> dict[str, Any]:
    """A change and what came of it as plain data; `done` is empty if it was not carried out."""
    head = {"curveline": __version__, "display": drive.display, "radio": spec}
    return {**head, "changes": change.document(), "done": [each.document() for each in done]}


def settings_change(
    tuner: RadioTuner, drive: DriveSettings, numbers: Sequence[int], was: Formerly, named: str = DEFAULT_DISPLAY
) -> SettingsChange:
    """What some nodes of a display (from 1, all if none are named) are to get: see `Session.new_settings`.

    `named` is how advice names the display.
    """
    wanted = list(dict.fromkeys(numbers)) or list(range(1, drive.node_count + 1))
    for number in wanted:
        drive.check_node(number)
    if was.number is not None and len(wanted) != 1:
        raise InvalidInput("an old number is that of a single node", "name the node by its number in the display file")
    old = _old_drive(drive, was)
    before = {number: number if was.number is None else was.number for number in wanted}
    for number in wanted:
        _check_old(old, before[number])
    known, books = _books(tuner, was)
    advised = _old_name(was, named)
    seats = [_seats((drive, old), (number, before[number]), known, books, advised) for number in wanted]
    change = SettingsChange(tuner, seats, books[0])
    change.named = named
    return change


def _old_name(was: Formerly, named: str) -> str:
    """How advice names the display as the nodes are told of it now."""
    if was.display is None:
        return named
    return was.display.path or was.display.name if isinstance(was.display, Display) else os.fspath(was.display)


Books = tuple[SiteFile | None, SiteFile | None]
"""The key files of a change: for the new settings, and for the old ones; None for the open key of a mock display."""


def _old_drive(drive: DriveSettings, was: Formerly) -> DriveSettings:
    """The display as the nodes are told of it now."""
    old = drive
    if was.display is not None:
        from curveline.shapes.files import given_display

        old = drive_settings(was.display if isinstance(was.display, Display) else given_display(was.display))
    if was.channel is not None:
        if not 0 <= was.channel <= MAX_CHANNEL:
            raise InvalidInput(f"there is no channel {was.channel}", f"there are 0 to {MAX_CHANNEL}")
        old = replace(old, channel=was.channel)
    return old


def _check_old(old: DriveSettings, number: int) -> None:
    if not 1 <= number <= old.node_count:
        there = "node 1" if old.node_count == 1 else f"nodes 1 to {old.node_count}"
        hint = f"it has {there}: name only such, or a single one, and with --old-number which one it is there"
        raise InvalidInput(f"display {old.display!r}, where the nodes listen now, has no node {number}", hint)


def _books(tuner: RadioTuner, was: Formerly) -> tuple[Mapping[str, int], Books]:
    """Who listens where, as far as a mock display knows, and the key files."""
    if is_open_mock(tuner.spec):
        if was.keys is not None:
            hint = "`--radio mock:keys` is a mock display whose nodes hold the key of a key file"
            raise InvalidInput("the nodes of a mock display hold its open key", hint)
        return tuner.listeners(), (None, None)
    new = key_file.read_site(default_path())
    old = new if was.keys is None else key_file.read_site(Path(os.fspath(was.keys)))
    tuner.masters = (new.master, old.master)
    return {}, (new, old)


def _seats(
    drives: tuple[DriveSettings, DriveSettings],
    numbers: tuple[int, int],
    known: Mapping[str, int],
    books: Books,
    old_name: str,
) -> tuple[NodeSeat, NodeSeat]:
    """Where a node is to be, and where it was; both with the chip that it has."""
    there, here = (drive.addresses[number - 1].upper() for drive, number in zip(drives, numbers, strict=True))
    new_book, old_book = ({} if book is None else book.chips for book in books)
    chip = known.get(here) or old_book.get(here) or known.get(there) or new_book.get(there) or new_book.get(here)
    if chip is None:
        raise InvalidInput(
            f"it is not known which device is node {numbers[0]}: none was adopted on {here}",
            f"`curveline keys adopt --radio ...{display_option(old_name)}` asks the nodes and records them; then "
            "change their settings",
        )
    pairs = zip(drives, numbers, books, strict=True)
    new, old = (NodeSeat(drive, _site(drive, number, chip, book), number) for drive, number, book in pairs)
    return new, old


def _site(drive: DriveSettings, number: int, chip: int, book: SiteFile | None) -> Site:
    known: Mapping[str, int] = {} if book is None else book.chips
    chips = [known.get(address.upper(), UNKNOWN_CHIP) for address in drive.addresses]
    chips[number - 1] = chip
    return Site(ZERO_MASTER if book is None else book.master, tuple(chips))


def _change_of(way: Resettling, found: NodeFound) -> NodeChange:
    seat, wanted = found.seat, way.new.settings
    held = replace(seat.settings, axes=found.axes)
    on_trial = way.is_as_wanted(found) and found.standing.on_trial
    homed = not any(found.report.axes)
    moved = held.place != wanted.place
    return NodeChange(way.new.number, way.new.address, tuple(_differences(held, wanted)), on_trial, moved, homed)


def _differences(old: NodeSettings, new: NodeSettings) -> Iterator[Setting]:
    """What two settings do not have in common; of keys their short names."""
    for name in ("number", "address", "channel", "data_rate"):
        if getattr(old, name) != getattr(new, name):
            yield Setting(name.replace("_", " "), getattr(old, name), getattr(new, name))
    if old.master != new.master:
        yield Setting("key", fingerprint_of(old.master), fingerprint_of(new.master))
    for axis, before, after in zip(AXES, old.axes, new.axes, strict=True):
        for limit in LIMITS:
            if getattr(before, limit) != getattr(after, limit):
                yield Setting(f"{axis} {limit}", getattr(before, limit), getattr(after, limit))


def _of_node(listener: Listener, number: int) -> Callable[[str], None]:
    return lambda text: listener.note(f"node {number}: {text}")

"""What is to be sent to several displays: a plan or a shape for each, from a folder, and whether they go together."""

from __future__ import annotations

import os
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

from curveline.drive_settings import DriveSettings, drive_settings
from curveline.driving.lines.naming import errors_of
from curveline.driving.live import same_radio
from curveline.driving.tours import Tour, home_of
from curveline.driving.wishes import wish_of
from curveline.errors import InvalidInput
from curveline.phrases import lines_in_words
from curveline.plan_file import Plan, sealed
from curveline.radio.host.polling import most_nodes
from curveline.radio.host.preflight import check_targets
from curveline.radio.host.stop_causes import named_display
from curveline.radio.interface import check_radio
from curveline.radio.mock.store import file_label

if TYPE_CHECKING:
    from curveline.shapes.lines_file import LineEntry
    from curveline.system.files import AnyPath

NO_RADIO = "add `radio` to the line in lines.toml, or name one for all: --radio SPEC"


@dataclass(frozen=True)
class LineWish:
    """One display among others: what it is to do, through which radio, and what it draws meanwhile."""

    name: str
    wish: Plan | Tour
    radio: str  # as of `connect`
    current: float | None = None  # [A] while it moves, None if nobody said

    @property
    def drive(self) -> DriveSettings:
        """The display as its nodes see it."""
        return self.wish.drive if isinstance(self.wish, Plan) else drive_settings(self.wish.display)


@dataclass(frozen=True)
class LinesWish:
    """Lines that are to be driven together, and what all that move at the same time may draw [A], None for any."""

    name: str
    lines: tuple[LineWish, ...]  # front to back
    current_limit: float | None = None


@dataclass(frozen=True)
class LinesRadio:
    """Over which radio lines are sent: over one `for_all`, or else as the manifest says, or else over `otherwise`.

    Only a dry run needs none.
    """

    for_all: str = ""
    otherwise: str = ""
    is_needed: bool = True

    def of(self, entry: LineEntry) -> str:
        """The radio of a line; InvalidInput if it needs one and nobody named it, or there is no such radio."""
        radio = self.for_all or entry.radio or self.otherwise
        if radio:
            check_radio(radio)
        elif self.is_needed:
            raise InvalidInput("no radio was named", NO_RADIO)
        return radio


def read_lines(folder: AnyPath, radio: LinesRadio) -> LinesWish:
    """What a folder with a manifest says is to be sent.

    InvalidInput for what cannot be sent, or not together; no radio is opened for that.
    """
    from curveline.shapes.lines_file import read_lines_file

    manifest = read_lines_file(folder)
    lines = tuple(_line(entry, radio) for entry in manifest.lines)
    wish = LinesWish(manifest.name, lines, manifest.current_limit)
    check_together(wish)
    return wish


def going_home(wish: LinesWish) -> LinesWish:
    """The same lines, which are to go home, whatever they show; InvalidInput if the file of a display is gone."""
    lines = []
    for line in wish.lines:
        with errors_of(line.name):
            display = named_display(line.wish) if isinstance(line.wish, Plan) else line.wish.display
            home = home_of(display) if isinstance(display, str) else Tour(display, ends_home=True)
            lines.append(replace(line, wish=home))
    return replace(wish, lines=tuple(lines))


def _line(entry: LineEntry, radio: LinesRadio) -> LineWish:
    with errors_of(entry.name):
        wish = wish_of([entry.plan])
        if entry.display:
            _check_display(wish, entry.display)
            wish = _found_there(wish, entry.display)
        if isinstance(wish, Plan):
            check_targets(wish)
        spec = radio.of(entry)
    return LineWish(entry.name, wish, spec, entry.current)


def _check_display(wish: Plan | Tour, display: str) -> None:
    """InvalidInput unless a plan or a shape is for a display."""
    from curveline.shapes.files import given_display

    wanted = drive_settings(given_display(display))
    found = wish.drive if isinstance(wish, Plan) else drive_settings(wish.display)
    if found != wanted:
        how = "is of" if found.display != wanted.display else "was made for another file of"
        raise InvalidInput(
            f"what is to be sent {how} display {found.display}, not as {display} describes {wanted.display}",
            "plan again for this display, or name the display that the plan is for",
        )


def _found_there(wish: Plan | Tour, display: str) -> Plan | Tour:
    """The same, with its display found where it is now: a folder may have been moved since its plans were made."""
    if isinstance(wish, Tour):
        return wish
    where = os.path.abspath(display) if display.endswith(".toml") else display
    return sealed(replace(wish, provenance={**wish.provenance, "display": where}))


def radio_groups(specs: Sequence[str]) -> list[list[int]]:
    """Which of some radio specs mean the same device, as their places: two models are one if they are named alike."""
    groups: list[list[int]] = []
    for place, spec in enumerate(specs):
        group = next((each for each in groups if _is_one(specs[each[0]], spec)), None)
        if group is None:
            groups.append([place])
        else:
            group.append(place)
    return groups


def _is_one(one: str, other: str) -> bool:
    return one.strip() == other.strip() if one.startswith("mock") else same_radio(one, other)


def check_together(wish: LinesWish) -> None:
    """InvalidInput for lines that cannot be driven in one run."""
    lines = wish.lines
    drives = [line.drive for line in lines]
    for group in radio_groups([line.radio for line in lines]):
        first = group[0]
        for place in group[1:]:
            _check_channels((lines[first], drives[first]), (lines[place], drives[place]))
        _check_number([lines[place] for place in group], [drives[place] for place in group])
    names: dict[str, LineWish] = {}
    for line, drive in zip(lines, drives, strict=True):
        other = names.setdefault(file_label(drive.display).casefold(), line)
        if other is not line:
            raise InvalidInput(
                f"lines {other.name} and {line.name} are of the same display, {drive.display}",
                "each line is a display of its own, with a name and addresses of its own in its display file",
            )
    for (line_of_one, address), (line_of_other, _) in _shared_addresses(lines, drives):
        raise InvalidInput(
            f"lines {line_of_one} and {line_of_other} both have a node with the address {address} on one channel",
            "give every node an address of its own in the display files, and plan again",
        )


def _check_channels(one: tuple[LineWish, DriveSettings], other: tuple[LineWish, DriveSettings]) -> None:
    (first, drive), (line, its) = one, other
    if (drive.channel, drive.data_rate) != (its.channel, its.data_rate):
        raise InvalidInput(
            f"lines {first.name} and {line.name} share the radio {line.radio}, but are on channel {drive.channel} at "
            f"{drive.data_rate} and channel {its.channel} at {its.data_rate}",
            "put their displays on one channel at one data rate, or give each its own radio",
        )


def _check_number(lines: Sequence[LineWish], drives: Sequence[DriveSettings]) -> None:
    nodes, rate = sum(drive.node_count for drive in drives), drives[0].data_rate
    if nodes > (most := most_nodes(rate)):
        who = lines_in_words([line.name for line in lines])
        raise InvalidInput(
            f"{who} put {nodes} nodes behind one radio, {lines[0].radio}, which can ask {most} of them often enough at "
            f"{rate}",
            "give some of them another radio, on another channel, or a higher data rate",
        )


def _shared_addresses(
    lines: Sequence[LineWish], drives: Sequence[DriveSettings]
) -> Iterator[tuple[tuple[str, str], tuple[str, str]]]:
    """Pairs of (line, address) that are one in the air: radios of any number that send on a channel reach all nodes."""
    seen: dict[tuple[int, str, str], tuple[str, str]] = {}
    for line, drive in zip(lines, drives, strict=True):
        for address in drive.addresses:
            here = (line.name, address.upper())
            other = seen.setdefault((drive.channel, drive.data_rate, address.upper()), here)
            if other != here:
                yield other, here


def is_folder(path: AnyPath) -> bool:
    """Whether a path is a folder, whose manifest is to be looked for."""
    return os.path.isdir(path)

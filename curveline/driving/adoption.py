"""Learning which devices are the nodes of a display: who answers, whether they fit, and what the key file will say."""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import closing
from dataclasses import dataclass
from pathlib import Path

from curveline.drive_settings import DriveSettings
from curveline.driving.stray import stray_channel
from curveline.errors import InvalidInput, LinkError
from curveline.listening import SILENT, Listener
from curveline.notebook import html_of
from curveline.radio.host.scan import ScannedNode, problems, scan
from curveline.radio.interface import open_radio
from curveline.radio.mock.spec import parse_spec
from curveline.radio.site import key_file
from curveline.radio.site.key_file import UNKNOWN_CHIP, SiteFile

HEAD = ("node", "address", "chip", "")


@dataclass(frozen=True)
class Adoption:
    """The devices that answered on the addresses of a display, and the key file that is to record them."""

    found: Sequence[ScannedNode]  # left to right
    site: SiteFile  # as it is

    def rows(self) -> list[tuple[str, str, str, str]]:
        """A row of every device, as `HEAD` names them; the last is what the key file says of its address so far."""
        return [(str(each.node), each.address, f"{each.chip:08x}", self._before(each)) for each in self.found]

    def _before(self, node: ScannedNode) -> str:
        known = self.site.chips.get(node.address.upper())
        return "new" if known is None else "as before" if known == node.chip else f"was {known:08x}"

    def _repr_html_(self) -> str:
        return html_of(f"to be recorded in {self.site.path}", [HEAD, *self.rows()])

    def record(self) -> SiteFile:
        """Write them down: from then on only these are obeyed and believed."""
        return key_file.adopt(self.site, {each.address: each.chip for each in self.found})


def check_adoptable(spec: str) -> None:
    """InvalidInput for a mock display whose nodes hold the mock's own key, as they do unless it is told otherwise."""
    name, _, settings = spec.partition(":")
    if name == "mock" and not parse_spec(settings).keys:
        trial = "CURVELINE_KEYS=trial.json"
        raise InvalidInput(
            "the nodes of a mock display are known already, and need no keys: there is nothing to adopt",
            f"to try how adopting goes: `{trial} curveline keys new`, then "
            f"`{trial} curveline keys adopt --radio {name}:{','.join(filter(None, [settings, 'keys']))}`",
        )


@dataclass(frozen=True)
class AdoptionPlace:
    """Where devices are looked for."""

    spec: str  # of the radio
    drive: DriveSettings  # the display as nodes see it
    runs: Path  # folder of the records of runs
    listener: Listener = SILENT  # told of what takes time


def find_devices(place: AdoptionPlace, site: SiteFile, numbers: Sequence[int] = ()) -> Adoption:
    """Ask the addresses of the nodes with some `numbers` (from 1), of all without any.

    LinkError unless exactly one fitting device answers on each; InvalidInput for a node that the display has not.
    """
    check_adoptable(place.spec)
    for number in numbers:
        place.drive.check_node(number)
    with key_file.lenient(), closing(open_radio(place.spec, place.drive, place.runs)) as radio:
        found = scan(radio, place.drive, numbers=sorted(set(numbers)))
    silent = [each for each in found if not each.link.answered]
    wrong = [text for each in found for text in (_silent(place, each) if [each] == silent else _wrong(place, each))]
    if wrong:
        raise LinkError("; ".join(wrong), "nothing was recorded; put that right, then adopt again")
    if len({each.chip for each in found}) < len(found):
        raise LinkError("one device answers on two addresses", "see which node was flashed with a wrong address")
    return Adoption(found, site)


def _wrong(place: AdoptionPlace, found: ScannedNode) -> list[str]:
    """What is wrong with what one address answered."""
    return problems(found, UNKNOWN_CHIP, place.drive, checks_limits=False)


def _silent(place: AdoptionPlace, found: ScannedNode) -> list[str]:
    """Where the only node listens that does not answer, if anywhere."""
    own, number = place.drive.channel, found.node
    place.listener.note(f"node {number} does not answer on channel {own}; looking on the others")
    channel = stray_channel(place.spec, place.drive, place.runs, number)
    if channel is None:
        return [f"node {number}: no answer from {found.address} on any channel; check its power, radio and settings"]
    where = f"node {number} does not answer on channel {own}, which the display file names, but on {channel}"
    cable = f"write the display's settings to it by a cable (`curveline keys node {number}`)"
    return [f"{where}: {cable}, or correct the channel in the display file"]

"""Lines behind dongles: several displays share one, or each has its own, in real time."""

from __future__ import annotations

import json
from collections.abc import Iterator, Sequence
from contextlib import ExitStack
from pathlib import Path

import pytest

import curveline
from curveline.drive_settings import drive_settings
from curveline.radio.mock.air import Air, Weather
from curveline.radio.ports.dongle import SendOutcome
from curveline.radio.protocol.keys import Site
from curveline.radio.site.key_file import adopt, new_site
from curveline.shapes.files import read_display
from driving.lines_folder import display_file, made, quick_lines
from radio.dongle_host import DongleHost, Pull, Room, dongle_host

from .conftest import Run

LINES = (1, 2, 3)


class Hall(Room):
    """The nodes of several displays on one channel."""

    def __init__(self, rooms: Sequence[Room]) -> None:
        self._rooms = rooms

    @property
    def airs(self) -> list[Air]:
        """See Room."""
        return [each.air for each in self._rooms]

    @property
    def now_us(self) -> int:
        """See Room."""
        return self._rooms[0].now_us

    def transmit(self, address: str, payload: bytes) -> tuple[SendOutcome, bytes, int]:
        """See Room."""
        room = next((each for each in self._rooms if address in each.antennas), self._rooms[0])
        return room.transmit(address, payload)


@pytest.fixture
def rooms(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> list[Room]:
    """The displays of three lines, whose nodes hold the keys of one site."""
    path = tmp_path / "site.json"
    monkeypatch.setenv("CURVELINE_KEYS", str(path))
    folder = made(tmp_path / "roof")
    drives = [drive_settings(read_display(display_file(folder, line, 2))) for line in LINES]
    addresses = [address for drive in drives for address in drive.addresses]
    file = adopt(new_site(path), {address: 0x2000 + number for number, address in enumerate(addresses)})
    return [Room(drive, file.site(drive), Weather(loss=0.1)) for drive in drives]


@pytest.fixture
def hosts(rooms: list[Room], tmp_path: Path) -> Iterator[list[DongleHost]]:
    """Two dongles: lines 1 and 3 are behind the first."""
    with ExitStack() as opened:
        yield [
            opened.enter_context(dongle_host(tmp_path / "first", Hall([rooms[0], rooms[2]]))),
            opened.enter_context(dongle_host(tmp_path / "second", rooms[1])),
        ]


def test_lines_share_a_dongle_and_have_their_own(
    run: Run, hosts: list[DongleHost], rooms: list[Room], tmp_path: Path
) -> None:
    specs = [f"serial:{hosts[line % 2 == 0].path}" for line in LINES]
    folder = quick_lines(tmp_path / "roof", specs, [2] * 3)
    code, out, err = run("send", folder, "--yes", "--json")
    assert code == 0, err
    lines = json.loads(out)["lines"]
    assert [line["radio"] for line in lines] == specs
    for line, room in zip(lines, rooms, strict=True):
        assert line["outcome"] == "done"
        assert room.positions() == [(443, 0, 0)] * 2


def test_a_dongle_that_is_pulled_and_plugged_goes_on_with_all_its_lines(
    hosts: list[DongleHost], rooms: list[Room], tmp_path: Path
) -> None:
    specs = [f"serial:{hosts[line % 2 == 0].path}" for line in LINES]
    folder = quick_lines(tmp_path / "roof", specs, [4] * 3, seconds=0.3)
    hosts[0].pull = Pull(frames=60, gap_s=1.5)
    result = curveline.send_lines(folder, runs=tmp_path / "runs")
    assert [line.outcome for line in result] == ["done"] * 3
    assert hosts[0].gone_at > 0.0
    # The line that has a dongle of its own does not wait for the others.
    assert result[1].run.report.seconds < result[0].run.report.seconds


def test_a_dongle_that_is_not_there_is_told_of_with_its_lines(
    hosts: list[DongleHost], rooms: list[Room], tmp_path: Path
) -> None:
    folder = quick_lines(tmp_path / "roof", [f"serial:{hosts[line % 2 == 0].path}" for line in LINES])
    hosts[0].unplug()
    with pytest.raises(curveline.CurvelineError, match="lines L1 and L3: ") as caught:
        curveline.send_lines(folder, runs=tmp_path / "runs")
    assert caught.value.exit_code == 3
    assert [room.positions() for room in rooms] == [[(0, 0, 0)] * 2] * 3


def test_a_site_that_does_not_know_a_node_of_a_line_moves_none(
    hosts: list[DongleHost], rooms: list[Room], tmp_path: Path
) -> None:
    folder = quick_lines(tmp_path / "roof", [f"serial:{hosts[line % 2 == 0].path}" for line in LINES])
    strangers = Site(bytes(16), (1, 2))
    rooms[2].site = strangers
    rooms[2].nodes = [rooms[2]._new_node(index, node.memory) for index, node in enumerate(rooms[2].nodes)]
    for antenna, node in zip(rooms[2].antennas.values(), rooms[2].nodes, strict=True):
        antenna.node = node
    with pytest.raises(curveline.CurvelineError, match="line L3: "):
        curveline.send_lines(folder, runs=tmp_path / "runs")
    assert [room.positions() for room in rooms] == [[(0, 0, 0)] * 2] * 3

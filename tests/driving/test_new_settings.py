"""Other settings over the air, from the host to the boards of a mock display: broken off anywhere, it ends well."""

from __future__ import annotations

import contextlib
import json
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from random import Random

import pytest

from campaign import only
from curveline.drive_settings import DriveSettings
from curveline.driving import new_settings, tuning
from curveline.driving.new_settings import Formerly, Resettled, SettingsChange, settings_change, told_settings
from curveline.driving.tuning import RadioTuner
from curveline.errors import CurvelineError, InvalidInput, LinkError
from curveline.listening import Listener
from curveline.radio.host.link import Halted, read_status
from curveline.radio.host.resettling import TRIES
from curveline.radio.host.service import home_axes
from curveline.radio.host.stop_causes import Cause
from curveline.radio.interface import Answer, RadioGone
from curveline.radio.mock.display import MockRadio, open_radio
from curveline.radio.node import plant
from curveline.radio.node.settings_flash import SettingsFlash
from curveline.radio.protocol.codes import ErrandOutcome, FrameKind, NodeState, SettingsOperation
from curveline.radio.protocol.envelope import kind_of
from curveline.radio.protocol.keys import ZERO_MASTER
from curveline.radio.protocol.node_settings import NodeSettings, node_settings
from curveline.radio.protocol.settings_frames import TRIAL_MS
from curveline.radio.site import key_file
from curveline.radio.site.key_file import adopt, new_site, read_site
from radio.bench import drive_table

OLD = drive_table(2)
ELSEWHERE = replace(OLD, channel=90, data_rate="250kbps", addresses=("A1A1A1A101", "A1A1A1A102"))
SLOWER = replace(OLD, axes=(replace(OLD.axes[0], speed=10.0), *OLD.axes[1:]))
LOWER = replace(ELSEWHERE, axes=(*OLD.axes[:2], replace(OLD.axes[2], high=50.0)))


@dataclass
class Notes(Listener):
    """What was told."""

    told: list[str] = field(default_factory=list)

    def note(self, text: str) -> None:
        self.told.append(text)


class Killed(BaseException):
    """The process is gone."""


Meddle = Callable[[MockRadio, int, Sequence[tuple[str, bytes]]], Sequence[Answer] | None]
"""Told of every exchange, with its number; what it gives back comes instead of an answer."""


class Lab:
    """A mock display of two nodes in a folder, and a host that is told where its nodes were."""

    def __init__(self, runs: Path, spec: str = "mock") -> None:
        self.runs = runs
        self.spec = spec
        self.sent: list[bytes] = []
        self.notes = Notes()
        self.exchanges = 0
        open_radio(spec.partition(":")[2].split(",cut")[0], OLD, runs).close()

    @contextlib.contextmanager
    def change(
        self, new: DriveSettings, numbers: Sequence[int] = (1,), was: Formerly | None = None, old: DriveSettings = OLD
    ) -> Iterator[SettingsChange]:
        tuner = RadioTuner(self.spec, new, self.runs)
        with pytest.MonkeyPatch.context() as patch:
            patch.setattr(new_settings, "_old_drive", lambda drive, was: old)
            try:
                change = settings_change(tuner, new, numbers, was or Formerly())
                change.survey()
                yield change
            except Killed:
                self._kill(tuner)
                raise
            finally:
                tuner.close()

    def carry_out(
        self, new: DriveSettings, numbers: Sequence[int] = (1,), was: Formerly | None = None, old: DriveSettings = OLD
    ) -> list[Resettled]:
        with self.change(new, numbers, was, old) as change:
            return change.carry_out(self.notes)

    def boards(self) -> list[tuple[NodeSettings, bool]]:
        """What every board runs under, and whether on trial; nothing is sent."""
        radio = open_radio(self.spec.partition(":")[2].split("cut")[0].strip(","), OLD, self.runs)
        found = [
            (station.settings, station.node.on_trial or station.keeper.standing().on_trial)
            for station in radio._stations
        ]
        radio.close()
        return found

    def rest(self, seconds: float) -> None:
        """Nobody sends anything for so long."""
        radio = open_radio("", OLD, self.runs)
        radio.sleep_until(int(1e6 * seconds))
        assert all(not node.on_trial for node in radio.nodes) or seconds < TRIAL_MS / 1000
        radio.close()

    def _kill(self, tuner: RadioTuner) -> None:
        """A killed process closes nothing, but its locks are gone; boards go on as the file has them."""
        radio = tuner._radio
        assert isinstance(radio, MockRadio)
        assert radio._store is not None
        radio._store.close()
        tuner._radio = None


@contextlib.contextmanager
def meddled(meddle: Meddle) -> Iterator[None]:
    """Within this, somebody meddles with what is sent; what was meant goes on unless an answer is given instead."""
    honest, number = MockRadio.exchange, 0

    def exchange(self: MockRadio, frames: Sequence[tuple[str, bytes]]) -> Sequence[Answer]:
        nonlocal number
        number += 1
        instead = meddle(self, number, frames)
        return honest(self, frames) if instead is None else instead

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(MockRadio, "exchange", exchange)
        yield


def settled(drive: DriveSettings, number: int, generation: int) -> NodeSettings:
    return node_settings(ZERO_MASTER, drive, number, generation)


def is_one_of(found: NodeSettings, *drives: DriveSettings) -> bool:
    return any(replace(found, generation=0) == settled(drive, found.number, 0) for drive in drives)


# What changes


@pytest.mark.parametrize(
    ("new", "names", "must_home"),
    [
        (replace(OLD, channel=90), ["channel"], False),
        (ELSEWHERE, ["address", "channel", "data rate"], False),
        (SLOWER, ["extrude speed"], False),
        (LOWER, ["address", "channel", "data rate", "translate high"], True),
    ],
)
def test_a_node_gets_what_the_display_file_says(
    tmp_path: Path, new: DriveSettings, names: list[str], *, must_home: bool
) -> None:
    lab = Lab(tmp_path)
    with lab.change(new, (1, 2)) as change:
        assert [[each.name for each in node.settings] for node in change.nodes] == [names, names]
        assert [node.must_home for node in change.nodes] == [must_home] * 2
        assert lab.notes.told == [], "looking changes nothing"
        assert change.carry_out(lab.notes) == [Resettled(number, True, 1, must_home) for number in (1, 2)]
    assert lab.boards() == [(settled(new, 1, 1), False), (settled(new, 2, 1), False)]
    again = lab.carry_out(new, (1, 2), old=OLD)
    assert [each.changed for each in again] == [False, False]
    back = lab.carry_out(OLD, (1, 2), old=new)
    assert [(each.changed, each.generation) for each in back] == [(True, 2), (True, 2)]


def test_a_node_really_listens_elsewhere_afterwards(tmp_path: Path) -> None:
    lab = Lab(tmp_path)
    lab.carry_out(ELSEWHERE, (2,))
    for drive, states in ((OLD, ["ready", "silent"]), (ELSEWHERE, ["silent", "ready"])):
        radio = open_radio("", drive, tmp_path)
        assert [each.state for each in read_status(radio, drive)] == states
        radio.close()


def test_numbers_can_be_exchanged_over_a_third_place(tmp_path: Path) -> None:
    """Nodes 1 and 2 change places: the first must go elsewhere before, for two on one address are refused."""
    lab = Lab(tmp_path)
    crossed = replace(OLD, addresses=OLD.addresses[::-1])
    with pytest.raises(Halted) as caught:
        lab.carry_out(crossed, (1,))
    assert caught.value.halt.cause is Cause.TAKEN_PLACE
    lab.carry_out(ELSEWHERE, (1,))
    lab.carry_out(OLD, (1,), Formerly(number=2), old=OLD)
    done = lab.carry_out(OLD, (2,), Formerly(number=1), old=ELSEWHERE)
    assert done == [Resettled(2, True, 2, True)], "its number has changed: its position counts no more"
    assert [found.number for found, _ in lab.boards()] == [2, 1]


def test_a_shared_address_is_refused(tmp_path: Path) -> None:
    lab = Lab(tmp_path, "mock:twin=1")
    with pytest.raises(Halted) as caught:
        lab.carry_out(SLOWER)
    assert caught.value.halt.cause is Cause.TWIN
    assert lab.boards()[0] == (settled(OLD, 1, 0), False)


@pytest.mark.parametrize(
    ("mishap", "cause"),
    [
        ("firmware=1", Cause.OLDER),
        ("version=1", Cause.VERSION),
        ("key=1", Cause.UNTRUSTED),
        ("channel=1", Cause.STRAYED),
        ("busy=1", Cause.BUSY),
        ("estop=1", Cause.LATCHED),
    ],
)
def test_what_cannot_be_changed_is_refused_with_its_reason(tmp_path: Path, mishap: str, cause: Cause) -> None:
    lab = Lab(tmp_path, f"mock:{mishap}")
    with pytest.raises(Halted) as caught:
        lab.carry_out(SLOWER)
    assert caught.value.halt.cause is cause
    assert caught.value.hint
    lab.spec = "mock"
    assert lab.boards()[0] == (settled(OLD, 1, 0), False)


def test_a_stray_node_is_brought_back_by_its_channel(tmp_path: Path) -> None:
    lab = Lab(tmp_path, "mock:channel=1")
    assert lab.carry_out(OLD, old=replace(OLD, channel=23))[0].changed
    lab.spec = "mock"
    assert lab.boards()[0] == (settled(OLD, 1, 1), False)


def test_senseless_wishes_are_refused(tmp_path: Path) -> None:
    tuner = RadioTuner("mock", OLD, tmp_path)
    for numbers, was in (
        ([3], Formerly()),
        ([0], Formerly()),
        ([], Formerly(number=1)),
        ([1], Formerly(number=3)),
        ([1], Formerly(number=0)),
        ([1], Formerly(channel=126)),
        ([1], Formerly(channel=-1)),
        ([1], Formerly(keys="site.json")),
    ):
        with pytest.raises(InvalidInput):
            settings_change(tuner, OLD, numbers, was)
    tuner.close()


def test_a_larger_display_is_told_which_nodes_the_old_one_has(tmp_path: Path) -> None:
    """A row grows: those that were there get their settings by naming them, and that is what is advised."""
    tuner, was = RadioTuner("mock", OLD, tmp_path), Formerly(display="single")
    with pytest.raises(InvalidInput, match="has no node 3") as caught:
        settings_change(tuner, replace(OLD, addresses=(*OLD.addresses, "C1C1C1C1A3")), [], was)
    tuner.close()
    assert "it has nodes 1 to 2: name only such" in caught.value.hint


# Broken off


def exchanges_of(lab: Lab, new: DriveSettings) -> int:
    count = 0

    def meddle(radio: MockRadio, number: int, frames: Sequence[tuple[str, bytes]]) -> None:
        nonlocal count
        count = number

    with meddled(meddle):
        lab.carry_out(new)
    return count


def kill_at(last: int) -> Meddle:
    def meddle(radio: MockRadio, number: int, frames: Sequence[tuple[str, bytes]]) -> None:
        if number > last:
            raise Killed

    return meddle


def broken_off(lab: Lab, new: DriveSettings, meddle: Meddle) -> None:
    with meddled(meddle), contextlib.suppress(Killed, CurvelineError, KeyboardInterrupt):
        lab.carry_out(new)


@pytest.mark.parametrize("part", [0, *only(range(1, 7))])
@pytest.mark.parametrize("new", [SLOWER, LOWER])
def test_a_host_killed_at_any_frame_can_begin_again(tmp_path: Path, new: DriveSettings, part: int) -> None:
    """At once, or after a minute; until then the board is under exactly one set, and it is the old or the new one."""
    total = exchanges_of(Lab(tmp_path / "whole"), new)
    for last in range(part, total, 7):
        lab = Lab(tmp_path / f"{last}")
        broken_off(lab, new, kill_at(last))
        found, on_trial = lab.boards()[0]
        assert is_one_of(found, OLD, new)
        if last % 2:
            lab.rest(60.0)
            again, still = lab.boards()[0]
            assert not still
            assert is_one_of(again, OLD) if on_trial else again == found
        done = lab.carry_out(new)
        assert lab.boards()[0] == (settled(new, 1, done[0].generation), False)


@pytest.mark.parametrize("word", [*range(1, 27, 5), 24, 25, *only(range(1, 27))])
def test_a_power_cut_at_any_word_ends_well(tmp_path: Path, word: int) -> None:
    lab = Lab(tmp_path, f"mock:cut=1@word{word}")
    with contextlib.suppress(LinkError):
        lab.carry_out(LOWER)
    lab.spec = "mock"
    found, on_trial = lab.boards()[0]
    assert is_one_of(found, OLD, LOWER)
    assert not on_trial
    done = lab.carry_out(LOWER)
    assert lab.boards()[0] == (settled(LOWER, 1, done[0].generation), False)


def test_a_trial_that_no_host_ends_is_over_after_half_a_minute(tmp_path: Path) -> None:
    lab = Lab(tmp_path)

    def meddle(radio: MockRadio, number: int, frames: Sequence[tuple[str, bytes]]) -> None:
        if radio._channel == ELSEWHERE.channel and radio._stations[0].node.on_trial:
            raise Killed

    broken_off(lab, ELSEWHERE, meddle)
    assert lab.boards()[0] == (settled(ELSEWHERE, 1, 1), True)
    assert any("half a minute later it is back" in text for text in lab.notes.told)
    lab.rest(29.0)
    assert lab.boards()[0] == (settled(ELSEWHERE, 1, 1), True)
    lab.rest(2.0)
    assert lab.boards()[0] == (settled(OLD, 1, 0), False)


def test_a_node_that_is_not_heard_under_its_new_settings_is_reported_back(tmp_path: Path) -> None:
    lab = Lab(tmp_path)

    def meddle(radio: MockRadio, number: int, frames: Sequence[tuple[str, bytes]]) -> Sequence[Answer] | None:
        if radio._channel != ELSEWHERE.channel:
            return None
        radio.sleep_until(radio.now_us() + 5000 * len(frames))
        return [Answer(None)] * len(frames)

    with meddled(meddle), pytest.raises(Halted) as caught:
        lab.carry_out(ELSEWHERE)
    assert caught.value.halt.cause is Cause.UNHEARD
    assert "back under the old ones" in caught.value.message
    assert not any("may be trying" in text for text in lab.notes.told), "it is known that it is back"
    assert lab.boards()[0] == (settled(OLD, 1, 0), False)


def test_a_radio_that_goes_away_leaves_word(tmp_path: Path) -> None:
    lab = Lab(tmp_path)

    def meddle(radio: MockRadio, number: int, frames: Sequence[tuple[str, bytes]]) -> None:
        if radio._stations[0].node.on_trial:
            raise RadioGone("unplugged", "plug it in", may_return=False)

    with meddled(meddle), pytest.raises(RadioGone):
        lab.carry_out(LOWER)
    assert any("may be trying" in text for text in lab.notes.told)
    assert lab.carry_out(LOWER)[0].changed, "what is on trial is kept"
    assert lab.boards()[0] == (settled(LOWER, 1, 1), False)


def test_another_trial_is_dropped_first(tmp_path: Path) -> None:
    """Somebody tries other limits at the same place, and dies; the wanted ones come after that."""
    lab = Lab(tmp_path)

    def meddle(radio: MockRadio, number: int, frames: Sequence[tuple[str, bytes]]) -> None:
        if radio._stations[0].node.on_trial:
            raise Killed

    broken_off(lab, SLOWER, meddle)
    assert lab.boards()[0][1]
    other = replace(OLD, axes=(OLD.axes[0], OLD.axes[1], replace(OLD.axes[2], high=50.0)))
    assert lab.carry_out(other)[0].changed
    assert lab.boards()[0] == (settled(other, 1, 1), False)


def test_a_run_is_refused_while_a_node_is_on_trial(tmp_path: Path) -> None:
    lab = Lab(tmp_path)

    def meddle(radio: MockRadio, number: int, frames: Sequence[tuple[str, bytes]]) -> None:
        if radio._stations[0].node.on_trial:
            raise Killed

    broken_off(lab, SLOWER, meddle)
    radio = open_radio("", SLOWER, tmp_path)
    first, second = read_status(radio, SLOWER)
    assert (first.can_move, "tries other settings" in first.obstacle) == (False, True)
    assert "curveline node settings 1" in first.advice
    assert second.obstacle == ""
    with pytest.raises(Halted) as caught:
        home_axes(radio, SLOWER, 1)
    assert caught.value.halt.cause is Cause.TRIAL
    radio.close()


# Bad air, and somebody in it


@pytest.mark.parametrize("seed", [1, *only(range(50_000, 50_030))])
@pytest.mark.parametrize(
    "weather", ["loss=0.3", "loss=0.3,dup=0.2,stale=0.3", "stranger=0.5,replay=0.5", "corrupt=0.2"]
)
def test_bad_air_changes_nothing_but_the_time(tmp_path: Path, weather: str, seed: int) -> None:
    lab = Lab(tmp_path, f"mock:{weather},seed={seed}")
    done = lab.carry_out(LOWER, (1, 2))
    assert [each.changed for each in done] == [True, True]
    assert [found for found, _ in lab.boards()] == [
        settled(LOWER, number, each.generation) for number, each in enumerate(done, start=1)
    ]


class Middle:
    """Somebody who hears all and can hold back, repeat, reorder and change frames, but has no key."""

    def __init__(self, seed: int) -> None:
        self.random = Random(seed)
        self.heard: list[tuple[str, bytes]] = []
        self.spares = self.random.choice(list(SettingsOperation))

    def __call__(self, radio: MockRadio, number: int, frames: Sequence[tuple[str, bytes]]) -> Sequence[Answer] | None:
        self.heard += frames
        chance = self.random.random
        for station in radio._stations:
            if self.heard and chance() < 0.2:
                station.intrude(radio.now_us() // 1000, self.random.choice(self.heard)[1])
            if self.heard and chance() < 0.1:
                spoilt = bytearray(self.random.choice(self.heard)[1])
                spoilt[self.random.randrange(32)] ^= 1 << self.random.randrange(8)
                station.intrude(radio.now_us() // 1000, bytes(spoilt))
        is_settings = kind_of(frames[0][1]) is FrameKind.SETTINGS
        if is_settings and frames[0][1][8] == self.spares and chance() < 0.8:
            radio.sleep_until(radio.now_us() + 3000)
            return [Answer(None)] * len(frames)
        return None


@pytest.mark.parametrize("seed", [3, 4, *only(range(50_000, 50_100))])
def test_somebody_in_between_can_only_make_it_fail(tmp_path: Path, seed: int) -> None:
    lab = Lab(tmp_path)
    with meddled(Middle(seed)), contextlib.suppress(LinkError):
        lab.carry_out(LOWER)
    found, _ = lab.boards()[0]
    assert is_one_of(found, OLD, LOWER)
    assert is_one_of(lab.boards()[1][0], OLD)
    done = lab.carry_out(LOWER)
    assert lab.boards()[0] == (settled(LOWER, 1, done[0].generation), False)


def test_recorded_frames_of_one_change_do_nothing_later(tmp_path: Path) -> None:
    lab = Lab(tmp_path)
    heard: list[bytes] = []

    def listen(radio: MockRadio, number: int, frames: Sequence[tuple[str, bytes]]) -> None:
        heard.extend(payload for _, payload in frames)

    with meddled(listen):
        lab.carry_out(SLOWER)
        lab.carry_out(OLD, old=SLOWER)
    radio = open_radio("", OLD, tmp_path)
    for payload in heard:
        radio._stations[0].intrude(radio.now_us() // 1000, payload)
        radio.sleep_until(radio.now_us() + 1000)
    assert not any(node.on_trial or node.leaves for node in radio.nodes)
    radio.close()
    assert lab.boards()[0] == (settled(OLD, 1, 2), False)


# Anything at all


@pytest.mark.parametrize("seed", [5, 6, *only(range(51_000, 51_060))])
def test_whatever_is_done_in_whatever_order_a_board_has_one_whole_set(tmp_path: Path, seed: int) -> None:
    random = Random(seed)
    lab = Lab(tmp_path)
    tables = [OLD, SLOWER, LOWER, replace(OLD, channel=90)]
    at = OLD
    for _ in range(6):
        new = random.choice(tables)
        last, word = random.randrange(400), random.randrange(1, 60)
        lab.spec = f"mock:cut=1@word{word}" if random.random() < 0.5 else "mock"
        with meddled(kill_at(last)), contextlib.suppress(Killed, LinkError):
            lab.carry_out(new, old=at)
        lab.spec = "mock"
        if random.random() < 0.5:
            lab.rest(40.0)
        found, on_trial = lab.boards()[0]
        assert is_one_of(found, at, new)
        if on_trial:
            lab.rest(40.0)
            found, on_trial = lab.boards()[0]
            assert is_one_of(found, at)
        at = next(table for table in tables if is_one_of(found, table))
    assert lab.carry_out(LOWER, old=at)[0].node == 1
    assert is_one_of(lab.boards()[0][0], LOWER)


# Keys


@dataclass
class Sites:
    """Two key files, the first of which the nodes hold."""

    old: Path
    new: Path


@pytest.fixture
def sites(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Sites:
    both = Sites(tmp_path / "old.json", tmp_path / "new.json")
    new_site(both.old)
    new_site(both.new)
    monkeypatch.setenv("CURVELINE_KEYS", str(both.old))
    with tuning.lenient():
        radio = open_radio("keys", OLD, tmp_path)
    adopt(read_site(both.old), {each.ear.address: each.chip for each in radio._stations})
    radio.close()
    monkeypatch.setenv("CURVELINE_KEYS", str(both.new))
    return both


class KeyedLab(Lab):
    def __init__(self, runs: Path) -> None:
        self.runs, self.spec, self.notes = runs, "mock:keys", Notes()


def test_a_whole_display_gets_another_key_node_by_node(tmp_path: Path, sites: Sites) -> None:
    lab = KeyedLab(tmp_path)
    was = Formerly(keys=sites.old)
    with lab.change(OLD, (1, 2), was) as change:
        (row,) = change.nodes[0].settings
        assert (row.name, row.old, row.new) == (
            "key",
            read_site(sites.old).fingerprint,
            read_site(sites.new).fingerprint,
        )
        assert [node.must_home for node in change.nodes] == [False, False]
    assert lab.carry_out(OLD, (1,), was)[0].changed
    assert list(read_site(sites.new).chips) == ["C1C1C1C101"]
    done = lab.carry_out(OLD, (1, 2), was)
    assert [each.changed for each in done] == [False, True]
    assert read_site(sites.new).chips == read_site(sites.old).chips
    with lab.change(OLD, (1, 2)) as change:
        assert not change.is_due, "the old key file is not needed any more"


def test_no_key_is_seen_anywhere(tmp_path: Path, sites: Sites) -> None:
    lab = KeyedLab(tmp_path)
    heard: list[bytes] = []

    def listen(radio: MockRadio, number: int, frames: Sequence[tuple[str, bytes]]) -> None:
        heard.extend(payload for _, payload in frames)

    with meddled(listen), lab.change(LOWER, (1,), Formerly(keys=sites.old)) as change:
        texts = [repr(change), repr(change.nodes), str(change.rows()), change._repr_html_(), repr(change.tuner)]
        done = change.carry_out(lab.notes)
        texts += [json.dumps(told_settings(LOWER, "mock", done, change)), repr(done), *lab.notes.told]
        texts += [repr(way.__dict__) for way in change._ways]
        radio = change.tuner._radio
        assert isinstance(radio, MockRadio)
        texts += [repr(station.__dict__) for station in radio._stations]
        texts += [repr(node.__dict__) for node in radio.nodes]
    texts += [path.read_text() for path in tmp_path.glob("mock-*")]
    for master in (read_site(sites.old).master, read_site(sites.new).master):
        for text in texts:
            assert master.hex() not in text
            assert repr(master)[2:-1] not in text
        for piece in (master[:4], master[4:8], master[8:12], master[12:]):
            assert not any(piece in payload for payload in heard)


def test_a_node_that_nobody_adopted_is_not_changed(
    tmp_path: Path, sites: Sites, monkeypatch: pytest.MonkeyPatch
) -> None:
    lab = KeyedLab(tmp_path)
    with pytest.raises(InvalidInput, match="it is not known which device is node 1") as caught:
        lab.carry_out(OLD)
    assert "curveline keys adopt" in caught.value.hint


def test_where_nobody_was_adopted_the_advice_leads_on(tmp_path: Path, sites: Sites) -> None:
    """It names the file of the old display; and who is adopted for the new key is known there by the old address."""
    lab, new = KeyedLab(tmp_path), replace(OLD, addresses=("C1C1C1C1A1", OLD.addresses[1]))
    chips = dict(read_site(sites.old).chips)
    forgotten = replace(read_site(sites.old), chips={})
    sites.old.unlink()
    key_file._create(sites.old, forgotten)
    tuner = RadioTuner("mock:keys", new, tmp_path)
    with pytest.raises(InvalidInput) as caught:
        settings_change(tuner, new, [1], Formerly(keys=sites.old), "a lab.toml")
    tuner.close()
    assert "`curveline keys adopt --radio ... --display 'a lab.toml'`" in caught.value.hint
    adopt(read_site(sites.new), chips)
    assert lab.carry_out(new, (1,), Formerly(keys=sites.old))[0].changed


def test_a_device_that_is_recorded_in_place_of_another_is_told(tmp_path: Path, sites: Sites) -> None:
    lab = KeyedLab(tmp_path)
    adopt(read_site(sites.new), {OLD.addresses[0]: 0x12345678})
    assert lab.carry_out(OLD, (1,), Formerly(keys=sites.old))[0].changed
    assert any("in place of chip 12345678" in each for each in lab.notes.told)


def test_two_nodes_trade_numbers_by_an_address_in_between(tmp_path: Path, sites: Sites) -> None:
    lab, chips = KeyedLab(tmp_path), dict(read_site(sites.old).chips)
    assert [each.changed for each in lab.carry_out(OLD, (1, 2), Formerly(keys=sites.old))] == [True, True]
    aside = replace(OLD, addresses=("C1C1C1C1A1", OLD.addresses[1]))
    assert lab.carry_out(aside, (1,))[0].changed
    assert lab.carry_out(OLD, (1,), Formerly(number=2))[0].changed
    assert lab.carry_out(OLD, (2,), Formerly(number=1), old=aside)[0].changed
    first, second = OLD.addresses
    now = read_site(sites.new).chips
    assert (now[first], now[second]) == (chips[second], chips[first])


def test_the_wrong_old_key_is_told(tmp_path: Path, sites: Sites) -> None:
    lab = KeyedLab(tmp_path)
    adopt(read_site(sites.new), dict(read_site(sites.old).chips))
    with pytest.raises(Halted) as caught:
        lab.carry_out(OLD)
    assert caught.value.halt.cause is Cause.UNTRUSTED
    assert "--old-keys" in caught.value.hint


def test_a_node_whose_motors_tremble_is_asked_again(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Each refusal costs a round, and none of them the few tries that a node has which is not heard."""
    refusals = iter([ErrandOutcome.OCCUPIED] * (TRIES + 2))
    store = SettingsFlash.store
    monkeypatch.setattr(SettingsFlash, "store", lambda self, record: next(refusals, None) or store(self, record))
    assert Lab(tmp_path).carry_out(SLOWER)[0].changed
    assert next(refusals, None) is None


def test_a_moving_node_is_left_alone(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Somebody has pressed its button: it finds its zeros, and takes nothing meanwhile."""
    monkeypatch.setattr(plant, "SEEK_LEAST_MS", 60_000)
    lab = Lab(tmp_path, "mock:unhomed=1")
    with lab.change(SLOWER) as change:
        radio = change.tuner._radio
        assert isinstance(radio, MockRadio)
        node = radio.nodes[0]
        node.start_homing(radio.now_us() // 1000, 7)
        with pytest.raises(Halted) as caught:
            change.carry_out(lab.notes)
        assert caught.value.halt.cause is Cause.REFUSED
        assert "its motors turn" in caught.value.message
        assert node.state is NodeState.HOMING

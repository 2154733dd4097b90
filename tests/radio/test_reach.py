"""How well a node is heard: what is counted, what it means, and that the radio is left as it was."""

from __future__ import annotations

import csv
import io
import json
from collections.abc import Sequence
from contextlib import closing
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from curveline.errors import InvalidInput, LinkError
from curveline.radio.host.link import Halted
from curveline.radio.host.polling import CYCLES
from curveline.radio.interface import Answer, RadioGone
from curveline.radio.measuring import reach
from curveline.radio.measuring.reach import LevelResult, LevelSlot, RangeTest, RangeWish, checked_levels, measure_reach
from curveline.radio.mock.air import Weather
from curveline.radio.mock.display import MockRadio, open_radio
from curveline.radio.protocol.air_time import RETRIES

from .bench import drive_table

DRIVE = drive_table(2)


def measured(folder: Path, settings: str, number: int = 2, wish: RangeWish | None = None) -> RangeTest:
    with closing(open_radio(settings, DRIVE, folder)) as radio:
        found = measure_reach(radio, "mock", DRIVE, number, wish or RangeWish(20.0))
        assert radio._chip.air.power == "max"
        return found


def level_of(lost: int, polls: int = 1000, **other: Any) -> LevelResult:
    """A power with so many losses, none of them in a row unless it says so."""
    made = LevelResult("max", (LevelSlot(0.5, polls, lost, 3 * lost),), {1: lost} if lost else {}, 0.02)
    return replace(made, **other)


@pytest.mark.parametrize("margin", [30.0, 10.0, 3.0])
def test_losses_are_those_of_the_air_at_each_power(tmp_path: Path, margin: float) -> None:
    """A poll is lost if all attempts of the chip are, each of which goes there and, at the node's full power, back."""
    found = measured(tmp_path, f"fresh,weak={margin},seed=8", wish=RangeWish(60.0))
    assert [(each.level, each.dbm) for each in found.levels] == [("max", 0), ("high", -6), ("low", -12), ("min", -18)]
    back = Weather(margin=margin).lost(76, 0)
    for each in found.levels:
        fails = 1.0 - (1.0 - Weather(margin=margin).lost(76, each.dbm)) * (1.0 - back)
        low, high = each.between
        assert low - 0.02 <= fails ** (1 + RETRIES) <= high + 0.02, each.level
        low, high = each.failed_between
        assert low - 0.02 <= fails <= high + 0.02, each.level
        assert each.polls > 1000


def test_every_power_has_as_many_turns_and_all_the_time_is_used(tmp_path: Path) -> None:
    found = measured(tmp_path, "fresh", wish=RangeWish(40.0))
    assert [len(each.slots) for each in found.levels] == [10, 10, 10, 10]
    moments = sorted(slot.at for each in found.levels for slot in each.slots)
    assert moments == pytest.approx([0.5 + index for index in range(40)], abs=0.05)
    short = measured(tmp_path, "fresh", wish=RangeWish(0.2))
    assert [len(each.slots) for each in short.levels] == [1, 1, 1, 1]
    assert all(each.polls >= 1 for each in short.levels)
    one = measured(tmp_path, "fresh", wish=RangeWish(5.0, ("low",)))
    assert [(each.level, len(each.slots)) for each in one.levels] == [("low", 5)]


def test_nothing_changes_in_the_node(tmp_path: Path) -> None:
    with closing(open_radio("fresh", DRIVE, tmp_path)) as radio:
        before = [replace(node.memory) for node in radio.nodes]
        radio.site = replace(radio.site, master=bytes(range(16)))
        measure_reach(radio, "mock", DRIVE, 1, RangeWish(4.0))
        assert [node.memory for node in radio.nodes] == before
        assert all(node.tally.bad_tags == 0 for node in radio.nodes), "it needs no key"


def test_what_is_good_enough() -> None:
    assert level_of(0).is_good
    assert level_of(75).is_good
    assert not level_of(95).is_good, "as many as 11 % may be lost"
    assert not level_of(0, polls=20).is_good, "too few to tell"
    assert level_of(9, misses={CYCLES - 1: 1}).is_good
    assert not level_of(10, misses={CYCLES: 1}).is_good
    assert not level_of(3, silence=0.4).is_good


def result_of(*levels: LevelResult) -> RangeTest:
    return RangeTest("mock", DRIVE, 1, 60.0, levels, ())


@pytest.mark.parametrize(
    ("losses", "spare", "words"),
    [
        ((0, 0, 0, 0), 18, "so it is with 18 dB less: there is much to spare"),
        ((0, 20, 400, 900), 6, "with 6 dB less it still is, with more than that not"),
        ((0, 300, 700, 900), 0, "with less power it is not: little is to spare"),
        ((0, 300, 0, 900), 0, "little is to spare"),
        ((300, 700, 900, 1000), 0, "30% of the polls are lost, 10% are the most"),
        ((300, 310, 290, 300), 0, "less power made no difference, so it is noise or a supply"),
        ((95, 0, 0, 0), 0, "11% of the polls may be lost, 10% are enough: measure for longer"),
    ],
)
def test_what_is_said_of_it(losses: Sequence[int], spare: int, words: str) -> None:
    powers = zip(("max", "high", "low", "min"), losses, strict=True)
    found = result_of(*(level_of(lost, level=name) for name, lost in powers))
    assert (found.spare_db, found.is_well) == (spare, level_of(losses[0]).is_good)
    assert words in " ".join(found.advice())
    assert ("10 uF" in " ".join(found.advice())) is not found.is_well


def test_of_polls_that_were_all_answered_nothing_is_to_blame() -> None:
    said = " ".join(result_of(*(level_of(0, polls=1, level=name) for name in ("max", "min"))).advice())
    assert said.endswith("measure for longer")
    assert "nothing was heard" in " ".join(result_of(level_of(0, silence=0.4)).advice())
    assert "10 uF" in " ".join(result_of(level_of(0, silence=0.4)).advice())


def test_packets_that_are_repeated_whatever_the_power_speak_of_noise(tmp_path: Path) -> None:
    text = " ".join(measured(tmp_path, "fresh,noise=13@0.2,seed=1").advice())
    assert "of all packets are lost, whatever the power: see `curveline radio scan`" in text
    assert "whatever the power" not in " ".join(measured(tmp_path, "fresh,weak=12,seed=1").advice())


def test_a_silence_is_counted_in_polls_and_in_time(tmp_path: Path) -> None:
    with closing(open_radio("fresh", DRIVE, tmp_path)) as radio:
        deaf_ms = radio.now_us() // 1000 + 1400
        exchange = radio.exchange

        def falls_deaf(frames: Sequence[tuple[str, bytes]]) -> Sequence[Answer]:
            now_ms = radio.now_us() // 1000
            if deaf_ms <= now_ms < deaf_ms + 500:
                radio.sleep_until(radio.now_us() + 4000)
                return [Answer(None, RETRIES) for _ in frames]
            return exchange(frames)

        radio.exchange = falls_deaf  # type: ignore[method-assign]
        (level,) = measure_reach(radio, "mock", DRIVE, 1, RangeWish(4.0, ("max",))).levels
    assert level.silence == pytest.approx(0.5, abs=0.03)
    assert level.misses == {level.longest: 1}
    assert level.longest == level.lost == pytest.approx(50, abs=3)
    assert not level.is_good


@pytest.mark.parametrize("broken_by", [KeyboardInterrupt(), RadioGone("gone", may_return=False)])
def test_full_power_is_back_however_it_ends(
    tmp_path: Path, broken_by: BaseException, monkeypatch: pytest.MonkeyPatch
) -> None:
    with closing(open_radio("fresh", DRIVE, tmp_path)) as radio:
        exchange, powers = MockRadio.exchange, []

        def breaks(self: MockRadio, frames: Sequence[tuple[str, bytes]]) -> Sequence[Answer]:
            powers.append(self._chip.air.power)
            if powers[-1] == "low":
                raise broken_by
            return exchange(self, frames)

        monkeypatch.setattr(MockRadio, "exchange", breaks)
        with pytest.raises(type(broken_by)):
            measure_reach(radio, "mock", DRIVE, 1, RangeWish(4.0))
        assert radio._chip.air.power == "max"


def test_a_radio_with_one_power_is_not_told_any(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def cannot(self: MockRadio, power: str) -> None:
        raise LinkError("cannot")

    monkeypatch.setattr(MockRadio, "set_power", cannot)
    assert measured(tmp_path, "fresh", wish=RangeWish(2.0, ("max",))).is_well
    with pytest.raises(LinkError, match="cannot"):
        measured(tmp_path, "fresh", wish=RangeWish(2.0))


def test_a_node_that_is_not_there_and_powers_that_are_none(tmp_path: Path) -> None:
    with pytest.raises(Halted, match="node 2 does not answer"):
        measured(tmp_path, "fresh,channel=2")
    with pytest.raises(InvalidInput, match="there is no node 3"):
        measured(tmp_path, "fresh", number=3)
    with pytest.raises(InvalidInput, match="there is no power 'most'") as caught:
        checked_levels(["max", "most"])
    assert caught.value.hint == "there are min, low, high, max"
    assert checked_levels(["low", "max", "low"]) == ("max", "low")


@pytest.mark.parametrize(("wrong", "words"), [("twin=2", "2 devices answer"), ("chip=2", "which the site knows")])
def test_who_answers_in_its_place_is_named(tmp_path: Path, wrong: str, words: str) -> None:
    found = measured(tmp_path, f"fresh,{wrong}", wish=RangeWish(4.0))
    assert not found.is_well
    assert words in " ".join(found.advice())


def test_what_is_kept_says_the_same_in_all_forms(tmp_path: Path) -> None:
    found = measured(tmp_path, "fresh,weak=8,seed=4")
    document = json.loads(reach.to_json(found))
    assert document == json.loads(json.dumps(found.document()))
    rows = list(csv.DictReader(io.StringIO(reach.to_csv(found).decode())))
    for level, told in zip(found.levels, document["levels"], strict=True):
        own = [row for row in rows if row["level"] == level.level]
        for key in ("polls", "lost", "retries"):
            assert sum(int(row[key]) for row in own) == told[key] == getattr(level, key)
        assert sum(int(length) * count for length, count in told["runs"].items()) == told["lost"]

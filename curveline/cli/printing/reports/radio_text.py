"""What was found out about the air, as text for terminals of 80 columns."""

from __future__ import annotations

from collections.abc import Iterator

from curveline.cli.printing import screen
from curveline.phrases import counted, wrapped
from curveline.radio.measuring.channels import ChannelNoise, ChannelScan
from curveline.radio.measuring.reach import RangeTest
from curveline.radio.protocol.band import mhz, wlan_at


def describe_channels(found: ChannelScan) -> Iterator[str]:
    """The display's channel and the best ones, and what to do."""
    yield f"display {found.drive.display} over {found.spec}"
    yield f"{counted(found.looks, 'look')} at each of 126 channels in {found.seconds:g} s, and nothing sent"
    rows: list[tuple[str, ...]] = [("", "channel", "MHz", "in use", "at most", "within WLAN channels")]
    rows.append(_channel("present", found.present))
    rows += [_channel("best" if index == 0 else "", each) for index, each in enumerate(found.best)]
    yield from screen.table(rows, frozenset({0, 5}))
    for number, share in found.wlans:
        yield f"others send where WLAN channel {number} is, for {share:.0%} of the time"
    for sentence in found.advice():
        yield from wrapped(sentence, 0)


def _channel(name: str, each: ChannelNoise) -> tuple[str, ...]:
    within = ", ".join(map(str, wlan_at(each.channel))) or "-"
    return name, str(each.channel), str(mhz(each.channel)), f"{each.share:.1%}", f"{each.high:.1%}", within


def describe_range(found: RangeTest) -> Iterator[str]:
    """A row for each power, and what it means."""
    yield f"node {found.node} of display {found.drive.display} over {found.spec}, for {found.seconds:g} s"
    rows: list[tuple[str, ...]] = [
        ("power", "dBm", "polls", "lost", "95 % from", "to", "repeats", "in a row", "longest")
    ]
    for each in found.levels:
        low, high = each.between
        shares = (f"{each.loss:.1%}", f"{low:.1%}", f"{high:.1%}")
        counts = (str(each.retries), str(each.longest), f"{each.silence:.2f} s")
        rows.append((each.level, str(each.dbm), str(each.polls), *shares, *counts))
    yield from screen.table(rows)
    for sentence in found.advice():
        yield from wrapped(sentence, 0)

"""Which channel is quiet: for what part of the time others send on each, and what that means for a display."""

from __future__ import annotations

import json
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

from curveline._version import __version__
from curveline.drive_settings import DriveSettings
from curveline.notebook import html_of, svg_of
from curveline.radio.interface import Radio
from curveline.radio.measuring.carriers import count_carriers, share_between
from curveline.radio.protocol.band import (
    ALLOWED,
    CHANNELS,
    REACH,
    USUAL_WLANS,
    WLAN_CHANNELS,
    mhz,
    wlan_at,
    wlan_middle,
)

QUIET = 0.02
"""Others may send for this part of the time: as much as costs a packet in fifty, which the chip then repeats."""
UNSURE = 0.05
"""While others may send for more than this part of the time, by the interval of 95 %, no channel counts as quiet."""
ALIKE = 0.005
"""Channels that differ by less are as good as each other; the one farthest from what is busy is better."""
BEST = 5
APART = 4
"""Channels between two that are named as the best ones: neighbours are as good, and no news."""
WLAN_CORE = 8
"""MHz on either side of its middle within which WLAN is as strong as there."""


@dataclass(frozen=True)
class ChannelNoise:
    """How busy one channel is: the worst of it and of the neighbours that a receiver hears, too."""

    channel: int  # 0 to 125
    share: float  # part of the looks on which somebody sent
    low: float  # end of the interval of 95 % for it
    high: float  # its other end

    @property
    def is_quiet(self) -> bool:
        """Whether it costs a run next to nothing."""
        return self.share <= QUIET


@dataclass(frozen=True)
class ChannelScan:
    """All channels of the band, looked at again and again while nothing was sent."""

    spec: str  # of the radio
    drive: DriveSettings  # the display as nodes see it
    seconds: float  # for how long [s]
    looks: int  # at each channel
    hits: tuple[int, ...]  # looks on which somebody sent, by channel

    def share(self, channel: int) -> float:
        """For what part of the looks somebody sent on a channel."""
        return self.hits[channel] / self.looks

    def noise(self, channel: int) -> ChannelNoise:
        """How busy a channel is for a display that uses it."""
        reach = REACH[self.drive.data_rate]
        worst = max(self.hits[max(0, channel - reach) : channel + reach + 1])
        return ChannelNoise(channel, worst / self.looks, *share_between(worst, self.looks))

    @property
    def present(self) -> ChannelNoise:
        """The channel of the display file."""
        return self.noise(self.drive.channel)

    @cached_property
    def best(self) -> tuple[ChannelNoise, ...]:
        """Some of the quietest other channels that are allowed, the best first, far from each other.

        Of those that are alike, one that common WLAN channels leave free is better, and then one far from what is busy.
        """
        busy = [channel for channel in range(CHANNELS) if self.share(channel) > QUIET]

        def rank(found: ChannelNoise) -> tuple[int, int, int]:
            away = min((abs(found.channel - other) for other in busy), default=0)
            common = any(number in USUAL_WLANS for number in wlan_at(found.channel))
            return round(found.share / ALIKE), common, -away

        chosen: list[ChannelNoise] = []
        for found in sorted(map(self.noise, ALLOWED), key=rank):
            if found.channel != self.drive.channel and all(
                abs(found.channel - other.channel) > APART for other in chosen
            ):
                chosen.append(found)
        return tuple(chosen[:BEST])

    @property
    def is_well(self) -> bool:
        """Whether the display can stay on its channel: it is quiet, or no other one is less than half as busy."""
        return self.present.is_quiet or self.best[0].share > 0.5 * self.present.share

    @property
    def advised(self) -> int:
        """The channel to take, which may be the present one."""
        return self.drive.channel if self.is_well else self.best[0].channel

    @cached_property
    def wlans(self) -> tuple[tuple[int, float], ...]:
        """WLAN channels in which others send, the busiest first, and for what part of the time.

        Of some that overlap one is named. What sends there need not be WLAN: the chip tells that there is something,
        not what it is.
        """
        left, found = list(self.hits), list[tuple[int, float]]()
        while True:
            number, hits = max(((each, _core(left, each)) for each in WLAN_CHANNELS), key=lambda pair: pair[1])
            if hits <= QUIET * self.looks:
                return tuple(found)
            found.append((number, hits / self.looks))
            left = [
                0 if abs(channel - wlan_middle(number)) <= 2 * WLAN_CORE else each for channel, each in enumerate(left)
            ]

    def _repr_html_(self) -> str:
        rows = [
            (name, each.channel, mhz(each.channel), f"{each.share:.1%}", f"{each.high:.1%}")
            for name, each in [("present", self.present), *(("best", each) for each in self.best)]
        ]
        title = f"channels around display {self.drive.display}, over {self.spec}"
        table = [("", "channel", "MHz", "in use", "at most"), *rows]
        return html_of(title, table, svg_of("curveline.figures.channels:draw", self), remarks=tuple(self.advice()))

    def advice(self) -> Iterator[str]:
        """What to do about it, in sentences."""
        present = self.present
        if present.channel not in ALLOWED:
            yield (
                f"channel {present.channel}, {mhz(present.channel)} MHz, is outside of {mhz(ALLOWED[0])} to "
                f"{mhz(ALLOWED[-1])} MHz, which most countries leave free"
            )
        if present.is_quiet and present.high > UNSURE:
            yield (
                f"nobody can say yet whether channel {present.channel} is quiet: {self.looks} looks show only that "
                f"others send for at most {present.high:.0%} of the time; listen for longer, such as for 120 s"
            )
            return
        if present.is_quiet:
            yield f"the display can stay on channel {present.channel}: it is quiet"
            return
        yield f"channel {present.channel} is noisy: others send there for {present.share:.0%} of the time{self._whom()}"
        if self.is_well:
            yield "no other channel is much better: see what sends, and move it or switch it off"
            return
        best = self.best[0]
        yield f"take channel {best.channel}, where others send for {best.share:.1%} of the time"
        yield (
            f"write `channel = {best.channel}` into [radio] of the display file; then `curveline node settings "
            f"--display FILE --old-channel {present.channel}` gives it to the nodes, over the air"
        )

    def _whom(self) -> str:
        there = [number for number, _ in self.wlans if number in wlan_at(self.drive.channel)]
        return f", as WLAN does on its channel {there[0]}" if there else ""

    def document(self) -> dict[str, Any]:
        """The result as plain data."""
        return {
            "curveline": __version__,
            "display": self.drive.display,
            "radio": self.spec,
            "seconds": self.seconds,
            "looks": self.looks,
            "present": _plain(self.present),
            "advised": self.advised,
            "best": [_plain(each) for each in self.best],
            "wlan": [{"channel": number, "in_use": share} for number, share in self.wlans],
            "channels": [self._row(channel) for channel in range(CHANNELS)],
        }

    def _row(self, channel: int) -> dict[str, Any]:
        low, high = share_between(self.hits[channel], self.looks)
        return {"channel": channel, "mhz": mhz(channel), "in_use": self.share(channel), "low": low, "high": high}


def measure_channels(radio: Radio, spec: str, drive: DriveSettings, seconds: float) -> ChannelScan:
    """Look at all channels for `seconds`; nothing is sent. LinkError as for any use of the radio."""
    looks, hits = count_carriers(radio, seconds)
    return ChannelScan(spec, drive, seconds, looks, hits)


def _core(hits: Sequence[int], number: int) -> float:
    """Looks on which somebody sent in the middle of a WLAN channel, in the mean over it."""
    middle = wlan_middle(number)
    part = hits[middle - WLAN_CORE : middle + WLAN_CORE + 1]
    return sum(part) / len(part)


def _plain(found: ChannelNoise) -> dict[str, Any]:
    numbers = {"in_use": found.share, "low": found.low, "high": found.high}
    return {"channel": found.channel, "mhz": mhz(found.channel), **numbers}


def to_json(found: ChannelScan) -> bytes:
    """All of it, as a file."""
    return (json.dumps(found.document(), indent=2) + "\n").encode()


def to_csv(found: ChannelScan) -> bytes:
    """A row for each channel."""
    lines = ["channel,mhz,looks,in_use,share,low,high"]
    for channel, hits in enumerate(found.hits):
        ends = ",".join(f"{end:.6f}" for end in share_between(hits, found.looks))
        lines.append(f"{channel},{mhz(channel)},{found.looks},{hits},{found.share(channel):.6f},{ends}")
    return ("\n".join(lines) + "\n").encode()

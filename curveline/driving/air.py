"""The air between a host and its nodes, measured over a radio that nobody else uses meanwhile."""

from __future__ import annotations

from contextlib import closing
from dataclasses import replace
from math import isfinite
from pathlib import Path

from curveline.drive_settings import DriveSettings
from curveline.driving.one_node import refuse_while_sending
from curveline.errors import InvalidInput
from curveline.radio.host.link import Halted
from curveline.radio.interface import open_radio
from curveline.radio.measuring.channels import ChannelScan, measure_channels
from curveline.radio.measuring.reach import RangeTest, RangeWish, checked_levels, measure_reach
from curveline.radio.site.key_file import lenient

MOST_SECONDS = 86_400.0


def scan_channels(spec: str, display: tuple[DriveSettings, str], runs: Path, seconds: float) -> ChannelScan:
    """Look at all channels for `seconds`; nothing is sent, and no key is needed.

    `display` is what must be known of it, and how advice names it. InvalidInput for a time that is none, LinkError as
    for any use of the radio.
    """
    check_seconds(seconds)
    drive, named = display
    refuse_while_sending(drive, named, spec, runs)
    with lenient(without_file=True), closing(open_radio(spec, drive, runs)) as radio:
        return measure_channels(radio, spec, drive, seconds)


def range_of(spec: str, display: tuple[DriveSettings, str], runs: Path, number: int, wish: RangeWish) -> RangeTest:
    """Poll node `number` (from 1), power by power; else as `scan_channels`."""
    check_seconds(wish.seconds)
    checked_levels(wish.levels)
    drive, named = display
    refuse_while_sending(drive, named, spec, runs)
    try:
        with lenient(without_file=True), closing(open_radio(spec, drive, runs)) as radio:
            return measure_reach(radio, spec, drive, number, wish)
    except Halted as error:
        raise Halted(replace(error.halt, display=named)) from None


def check_seconds(seconds: float) -> None:
    """InvalidInput unless the air can be measured for so long."""
    if not isfinite(seconds) or not 0.0 < seconds <= MOST_SECONDS:
        raise InvalidInput(f"the air cannot be measured for {seconds:g} s", f"from above 0 s to {MOST_SECONDS:g} s")

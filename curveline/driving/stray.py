"""Where a node listens that does not answer: channels are tried one by one, as nobody may know which it was given."""

from __future__ import annotations

from contextlib import closing
from dataclasses import replace
from pathlib import Path

from curveline.drive_settings import MAX_CHANNEL, DriveSettings
from curveline.radio.host.scan import ScannedNode, scan_one
from curveline.radio.interface import open_radio
from curveline.radio.site.key_file import lenient

PROBES = 3


def stray_channel(spec: str, drive: DriveSettings, runs: Path, number: int) -> int | None:
    """The channel, other than the display's, on which somebody answers on the address of node `number` (from 1)."""
    address = drive.addresses[number - 1]
    for channel in range(MAX_CHANNEL + 1):
        if channel == drive.channel:
            continue
        found = ScannedNode(number, address)
        with lenient(without_file=True), closing(open_radio(spec, replace(drive, channel=channel), runs)) as radio:
            scan_one(radio, found, PROBES)
        if found.pages:
            return channel
    return None

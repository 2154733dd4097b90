"""The band of the nRF24L01+: its channels, those of WLAN among them, and the powers that it sends with."""

from __future__ import annotations

CHANNELS = 126
"""Of 1 MHz, from 2400 MHz on."""
FIRST_MHZ = 2400
ALLOWED = range(2, 82)
"""Channels on which also 2 Mbps stay within 2400 to 2483.5 MHz, the part that is free to use in most countries."""
WLAN_CHANNELS = range(1, 14)
USUAL_WLANS = (1, 6, 11)
"""Those that most networks use, as they do not overlap."""
WLAN_REACH = 10
"""MHz from the middle of a WLAN channel to its ends."""
POWERS_DBM = {"min": -18, "low": -12, "high": -6, "max": 0}
"""What the chip sends with, weakest first; a run always sends with the most."""
FULL_POWER = "max"
REACH = {"250kbps": 1, "1Mbps": 1, "2Mbps": 2}
"""Neighbours on either side whose noise a receiver hears, too."""


def mhz(channel: int) -> int:
    """Where a channel is."""
    return FIRST_MHZ + channel


def wlan_middle(number: int) -> int:
    """The channel of ours in the middle of a WLAN channel, from 1."""
    return 7 + 5 * number


def wlan_span(number: int) -> range:
    """Our channels within a WLAN channel of 20 MHz."""
    return range(wlan_middle(number) - WLAN_REACH, wlan_middle(number) + WLAN_REACH + 1)


def wlan_at(channel: int) -> list[int]:
    """The WLAN channels that one of ours lies in."""
    return [number for number in WLAN_CHANNELS if channel in wlan_span(number)]

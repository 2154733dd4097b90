"""How busy the channels are: every one of them looked at again and again, while nothing is sent."""

from __future__ import annotations

from math import sqrt

from curveline.radio.interface import Radio
from curveline.radio.protocol.band import CHANNELS

NORMAL_95 = 1.96
"""Standard deviations of a normal distribution, either way, that have 95 % within them."""


def share_between(hits: int, looks: int) -> tuple[float, float]:
    """The ends of Wilson's interval of 95 % for the chance of what came so often; (0, 1) for no looks at all."""
    if not looks:
        return 0.0, 1.0
    share, square = hits / looks, NORMAL_95**2
    middle = (share + square / (2 * looks)) / (1 + square / looks)
    reach = NORMAL_95 * sqrt(share * (1 - share) / looks + square / (4 * looks**2)) / (1 + square / looks)
    return max(0.0, middle - reach) if hits else 0.0, min(1.0, middle + reach) if hits < looks else 1.0


def count_carriers(radio: Radio, seconds: float) -> tuple[int, tuple[int, ...]]:
    """Look at all channels for so long, and at least once: how often that was, and on how many looks each was in use.

    LinkError as from `Radio.carriers`.
    """
    hits, looks = [0] * CHANNELS, 0
    end_us = radio.now_us() + round(1e6 * seconds)
    while not looks or radio.now_us() < end_us:
        for channel in radio.carriers():
            hits[channel] += 1
        looks += 1
    return looks, tuple(hits)

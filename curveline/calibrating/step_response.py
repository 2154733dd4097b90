"""A gear motor that is given a duty at once: the first-order lag that fits its counts, and the gains that suit it.

v = G (duty - friction), with a time constant. Turns at two duties, both ways, tell these three; the gains that follow
keep the loop as quick, for the motor that is there, as the shipped ones make it for the motor that was reckoned with.
"""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from math import exp
from typing import Any

from curveline.errors import LinkError

SAMPLE_S = 0.004
"""Between two counts."""
PWM_FULL = 2400
BINARY_PLACES = 256
TIME_CONSTANTS = tuple(0.001 * half / 2 for half in range(8, 241))
"""From which the best is taken [s]."""
SHIPPED = {"proportional": 3072, "integral": 12, "damping": 384, "forward": 88, "lead_ms": 30, "kick": 192}
"""GAINS of firmware/core/servo.c, in its units."""
LOOP = 12.0 * 6953.0 / PWM_FULL * 0.030
"""Quickness of the shipped loop by the time constant of its motor; damping is 0.5 by it."""
BOUNDS = {
    "proportional": (1536, 4608),
    "integral": (4, 18),
    "damping": (192, 576),
    "forward": (44, 132),
    "lead_ms": (10, 60),
    "kick": (0, 240),
}
"""Within which gains are suggested: half and one and a half of the shipped ones, a kick of a tenth of full duty."""


@dataclass(frozen=True)
class StepResponse:
    """A motor that was given a duty at once: counts 4 ms apart, and the first-order lag that fits them."""

    duty: float  # share of full duty, with its sign
    counts: tuple[int, ...]  # from where it stood, every 4 ms
    speed: float  # that it tends to [counts/s]
    time_constant: float  # [s]
    error: float  # root mean square of the fit [counts]

    def fitted(self, time: float) -> float:
        """Counts by the fit [s]."""
        return self.speed * _lagged(time, self.time_constant)


@dataclass(frozen=True)
class Tuning:
    """What the turns of one motor say of it, and the gains that suit it, in the units of firmware/core/servo.c."""

    node: int  # in the row, from 1
    axis: str  # its name
    responses: tuple[StepResponse, ...]  # of the turns
    gain: float  # counts/s per full duty
    friction: float  # share of full duty that goes into it
    time_constant: float  # [s]
    gains: dict[str, int]  # suggested
    cut: tuple[str, ...]  # names of those that would lie outside of the bounds

    def document(self) -> dict[str, Any]:
        """The same as plain data."""
        return {**asdict(self), "shipped": SHIPPED, "bounds": {name: list(ends) for name, ends in BOUNDS.items()}}


def tuning_of(node: int, name: str, responses: Sequence[StepResponse]) -> Tuning:
    """The motor and its gains by the responses to two duties, each both ways."""
    duties = [abs(each.duty) for each in responses]
    speeds = [abs(each.speed) for each in responses]
    mean_duty, mean_speed = sum(duties) / len(duties), sum(speeds) / len(speeds)
    spread = sum((duty - mean_duty) ** 2 for duty in duties)
    gain = sum((duty - mean_duty) * (speed - mean_speed) for duty, speed in zip(duties, speeds, strict=True)) / spread
    if gain <= 0.0:
        raise LinkError(f"the {name} motor of node {node} is no quicker with more duty", "is its supply weak?", node)
    friction = max(0.0, mean_duty - mean_speed / gain)
    constant = sum(each.time_constant for each in responses) / len(responses)
    wanted = _gains(gain, friction, constant)
    gains = {key: min(max(wanted[key], low), high) for key, (low, high) in BOUNDS.items()}
    cut = tuple(key for key, value in gains.items() if value != wanted[key])
    return Tuning(node, name, tuple(responses), gain, friction, constant, gains, cut)


def _gains(gain: float, friction: float, constant: float) -> dict[str, int]:
    """Gains by what a motor is: the same loop times time constant as the shipped ones have."""
    proportional = LOOP * PWM_FULL / (gain * constant)
    share = proportional * BINARY_PLACES / SHIPPED["proportional"]
    return {
        "proportional": round(proportional * BINARY_PLACES),
        "integral": round(SHIPPED["integral"] * share),
        "damping": round(SHIPPED["damping"] * share),
        "forward": round(PWM_FULL / gain * BINARY_PLACES),
        "lead_ms": round(1000.0 * constant),
        "kick": round(friction * PWM_FULL),
    }


def _lagged(time: float, constant: float) -> float:
    return time - constant * (1.0 - exp(-time / constant))


def fitted_response(duty: float, counts: tuple[int, ...]) -> StepResponse:
    """The lag that is nearest to counts 4 ms apart, from the moment on at which a share of full duty was given."""
    best: StepResponse | None = None
    times = [SAMPLE_S * index for index in range(len(counts))]
    for constant in TIME_CONSTANTS:
        basis = [_lagged(time, constant) for time in times]
        weight = sum(each * each for each in basis)
        speed = sum(each * count for each, count in zip(basis, counts, strict=True)) / weight
        square = sum((speed * each - count) ** 2 for each, count in zip(basis, counts, strict=True)) / len(counts)
        if best is None or square**0.5 < best.error:
            best = StepResponse(duty, counts, speed, constant, square**0.5)
    assert best is not None
    return best


def to_json(found: Tuning) -> bytes:
    """All of it, as a file."""
    return (json.dumps(found.document(), indent=2) + "\n").encode()

"""Whether the switch at an axis's lower end works: somebody presses it and lets it go, and what came of that."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import asdict, dataclass
from typing import Any

from curveline.drive_settings import AXES
from curveline.driving.node_check import SWITCH_PIN, Finding
from curveline.driving.node_errands import NodePlace
from curveline.errors import InvalidInput
from curveline.radio.host.errands import Errand

AXIS = "translate"
"""The one axis that has such a switch."""
SPARE = "extrude"
"""The axis with the other switch, that of the rod's end."""
LONGEST_S = 600.0
LOOK_S = 0.02
SETTLED = 2
"""A switch that bounces is in a state once it was seen there so often in a row."""
MODEL_PRESSES_S = 0.5
MODEL_RELEASES_S = 1.0
"""When the finger on a model's switch comes and goes."""


@dataclass(frozen=True)
class SwitchCheck:
    """What a switch did while somebody pressed it and let it go."""

    axis: str  # its axis
    closed: tuple[bool, ...]  # the states that it was in, one after the other
    findings: tuple[Finding, ...]  # none if it works

    @property
    def is_well(self) -> bool:
        """Whether it works."""
        return not self.findings

    def document(self) -> dict[str, Any]:
        """The same as plain data."""
        return {"well": self.is_well, **asdict(self)}


def check_switch(place: NodePlace, seconds: float, told: Callable[[str], None]) -> SwitchCheck:
    """Wait until the lower end's switch was pressed and let go, so long at most; the motors are let alone.

    `told` hears a word for each state that it is seen in.
    """
    if not 1.0 <= seconds <= LONGEST_S:
        raise InvalidInput(f"nobody presses a switch within {seconds:g} s", f"say 1 to {LONGEST_S:g} seconds")
    own, spare = _States(), _States()
    with place.tried() as errand:
        for switches in _looks(place, errand, seconds):
            if own.see(closed=switches[AXES.index(AXIS)]):
                told("closed" if own.settled[-1] else "open")
            spare.see(closed=switches[AXES.index(SPARE)])
            if own.has_worked:
                break
    return SwitchCheck(AXIS, tuple(own.settled), tuple(_judged(own, spare)))


class _States:
    """The states that a switch was in, without its bouncing."""

    def __init__(self) -> None:
        self.settled: list[bool] = []
        self._newest = False
        self._times = 0

    def see(self, *, closed: bool) -> bool:
        """Take a look; whether it has come to another state."""
        self._times = self._times + 1 if closed == self._newest else 1
        self._newest = closed
        if self._times < SETTLED or self.settled[-1:] == [closed]:
            return False
        self.settled.append(closed)
        return True

    @property
    def has_worked(self) -> bool:
        """Open, closed, open again."""
        return self.settled[-3:] == [False, True, False]


def _looks(place: NodePlace, errand: Errand, seconds: float) -> Iterator[tuple[bool, bool, bool]]:
    """The switches again and again, for so long; on a model a finger presses."""
    radio = place.radio
    finger: Callable[..., None] | None = getattr(radio, "finger", None)
    begin_us, axis = radio.now_us(), AXES.index(AXIS) + 1
    while (at_s := 1e-6 * (radio.now_us() - begin_us)) < seconds:
        if finger is not None and at_s > MODEL_PRESSES_S:
            finger(place.number, axis, presses=at_s < MODEL_RELEASES_S)
        yield errand.motors().switches
        errand.rest(LOOK_S)


def _judged(own: _States, spare: _States) -> Iterator[Finding]:
    if own.has_worked:
        return
    name, seen = AXIS, own.settled
    if seen == [False] and len(spare.settled) > 1:
        text = f"{name}'s switch stays open, and the one of the rod's end changes instead"
        yield Finding("switch", text, f"their wires are exchanged: {name}'s belongs to {SWITCH_PIN}")
    elif seen == [False]:
        text = f"{name}'s switch stays open, pressed or not"
        hint = (
            f"pressed it must connect {SWITCH_PIN} to ground: look for an open wire, or for the wrong two of its "
            f"three contacts (C and NO); if nobody pressed it, try again"
        )
        yield Finding("switch", text, hint)
    elif seen == [True]:
        text = f"{name}'s switch stays closed, pressed or not"
        yield Finding("switch", text, f"it is stuck, or {SWITCH_PIN} is shorted to ground")
    elif seen == [True, False, True]:
        text = f"{name}'s switch is closed, and opens when it is pressed"
        yield Finding("switch", text, "an opener where a closer belongs: take the contacts C and NO instead of NC")
    else:
        text = f"{name}'s switch was {' and then '.join('closed' if each else 'open' for each in seen)}"
        yield Finding("switch", text, "leave it alone, begin again, press it once, and let it go")

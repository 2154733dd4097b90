"""What a radio with a modelled display behind it knows beyond what its nodes tell: where they are, and the rod."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Protocol

from curveline.radio.host.journal import Disk
from curveline.radio.interface import Radio
from curveline.radio.protocol.codes import Counts


class ModelledDisplay(Protocol):
    """A display that is modelled; `rod` names the states that its segments were last seen in, `disk` may be full.

    `clamp` [N mm/deg] and `play` [deg] are how its bearings give in truth; None for what its file says. `set_share` is
    the part of a curvature that its rod has kept: see `replay.monte_carlo.Setup.kept`; `curvature` [1/m] is what the
    free rod is bent besides, and `stiffness` the part by which its EI exceeds that of the file. In a picture its nodes
    are `scatter` times as far off as those of a good display. A `hand` will snap the rod of that segment over, from 1,
    at the end of the next run; None if none will.
    """

    rod: list[str]
    disk: Disk
    clamp: float | None
    play: float | None
    set_share: float
    curvature: float
    stiffness: float
    scatter: float
    hand: int | None

    @property
    def known_rod(self) -> tuple[str, ...]:
        """As `rod`, but nothing if a node has moved since then."""
        ...

    def positions(self) -> tuple[Counts, ...]:
        """Counts of every node now."""
        ...

    def motion(self) -> list[tuple[float, tuple[Counts, ...]]]:
        """Seconds since the radio was opened and counts of every node, while anything moved, in order of time."""
        ...


def modelled(radio: Radio) -> ModelledDisplay | None:
    """The display behind a radio, if it is a model."""
    display: ModelledDisplay | None = getattr(radio, "modelled", None)
    return display


def known_rod(radio: Radio) -> Sequence[str] | None:
    """The states of the rod where somebody knows them; None behind a real radio."""
    display = modelled(radio)
    return None if display is None else display.known_rod

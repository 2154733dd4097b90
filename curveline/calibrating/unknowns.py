"""What is unknown of a display, in a row of numbers: of the rod, of its bearings and nodes, and of the camera's frame.

Weight and stiffness of a rod are one number to its shape, w / EI, the third power of one over the gravity length; so
are the stiffness k of a bearing and that of the rod, as the length EI / k of rod that gives as much. Both are written
such that nothing is 0.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from curveline.scene import Display, Offsets
from curveline.trial import Array
from curveline.units import deg, mm

WEIGHT, GIVE, ASYMMETRY, ANGLE, LENGTH = "weight", "give", "asymmetry", "angle", "length"
SHIFT_X, SHIFT_Y, TURN, SCALE = "shift_x", "shift_y", "turn", "scale"
FRAME = SHIFT_X, SHIFT_Y, TURN, SCALE
"""Of the camera: where it sees the display's frame, beside where that is."""


class Unknown(NamedTuple):
    """A number of a display that is not known: its kind, and of which node or segment, from 0."""

    kind: str
    number: int = 0


STEPS = {
    WEIGHT: 0.2,
    GIVE: mm(0.2),
    ASYMMETRY: 0.01,
    ANGLE: deg(0.05),
    LENGTH: mm(0.1),
}
"""By how much each is changed to see what moves, in SI: 1/m^3 for the weight over EI."""
LIFT = mm(0.2)
"""By how much the right node is lifted to see what that moves."""
LIKELY = {
    WEIGHT: 30.0,
    GIVE: mm(30.0),
    ASYMMETRY: 0.3,
    ANGLE: deg(5.0),
    LENGTH: mm(10.0),
    SHIFT_X: mm(0.5),
    SHIFT_Y: mm(0.5),
    TURN: deg(0.1),
    SCALE: 0.0015,
}
"""Standard deviations by which each number may be off what its file says, as an observation beside those of trials: so
wide that they only matter where no trial tells; but of a camera's frame, that of tags that were put up by hand."""
BOUNDS = {
    WEIGHT: (0.0, 1e6),
    GIVE: (0.0, 0.5),
    ASYMMETRY: (-0.5, 0.5),
    ANGLE: (-deg(10.0), deg(10.0)),
    LENGTH: (-mm(20.0), mm(20.0)),
}
"""What a display file can have, and a rod."""
FIRST_GIVE = mm(5.0)
"""Where the search begins for bearings that the file has as rigid."""


@dataclass(frozen=True)
class Unknowns:
    """All that may be unknown of a display, in the order of the numbers."""

    nodes: int

    @property
    def all(self) -> tuple[Unknown, ...]:
        """Each of them."""
        return (
            Unknown(WEIGHT),
            Unknown(GIVE),
            Unknown(ASYMMETRY),
            *(Unknown(ANGLE, node) for node in range(self.nodes)),
            *(Unknown(LENGTH, segment) for segment in range(self.nodes - 1)),
            *map(Unknown, FRAME),
        )

    @property
    def size(self) -> int:
        """How many there are."""
        return 3 + self.nodes + self.nodes - 1 + len(FRAME)

    def places(self, segment: int) -> list[int]:
        """Where those are that bend the rod of a segment: weight, give, asymmetry, both angles, its length."""
        return [0, 1, 2, 3 + segment, 4 + segment, 3 + self.nodes + segment]

    @property
    def frame(self) -> slice:
        """Where those of the camera are."""
        return slice(self.size - len(FRAME), self.size)

    def of_display(self, display: Display) -> Array:
        """The numbers that a display file has, bearings that give a little where it has rigid ones."""
        numbers = np.zeros(self.size)
        numbers[0] = weight_of(display)
        numbers[1] = display.rod.bending_stiffness / display.clamp_stiffness or FIRST_GIVE
        numbers[3 : 3 + self.nodes] = display.offsets.angles or 0.0
        numbers[3 + self.nodes : 2 + 2 * self.nodes] = display.offsets.lengths or 0.0
        return numbers

    def offsets(self, numbers: Array) -> Offsets:
        """Those that the numbers say."""
        angles, lengths = numbers[3 : 3 + self.nodes], numbers[3 + self.nodes : 2 + 2 * self.nodes]
        return Offsets(tuple(angles.tolist()), tuple(lengths.tolist()))

    def clipped(self, numbers: Array) -> Array:
        """The numbers within what a display can be."""
        out = numbers.copy()
        for place, unknown in enumerate(self.all):
            if unknown.kind in BOUNDS:
                low, high = BOUNDS[unknown.kind]
                out[place] = min(max(out[place], low), high)
        return out


def weight_of(display: Display) -> float:
    """Weight of a display's rod over its bending stiffness [1/m^3]; 0 without gravity."""
    return display.rod.weight_per_length / display.rod.bending_stiffness if display.gravity else 0.0

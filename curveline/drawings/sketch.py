"""What readers of files find: lines, in the units of the file, before anybody asked which of them is meant."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NoReturn

from curveline.drawings.drawing import Array
from curveline.errors import Diagnostic, InvalidInput
from curveline.units import mm

ERROR = mm(0.01)
"""How far points may be off the curves that they stand for, and ends of pieces apart that are joined."""
OF_WIDTH = 1e-5
"""The same as a part of the width, where nobody knows yet how large a unit is."""
MOST_PIECES = 200_000


@dataclass(frozen=True, eq=False)
class Piece:
    """A line through `points (k, 2)` in units of the file, y upwards; it goes by each of its `names`.

    The first name is its own, the others are those of groups or layers, from the innermost on. `line` is that of the
    file, from 1.
    """

    points: Array
    names: tuple[str, ...] = ()
    line: int = 1


@dataclass(frozen=True, eq=False)
class Sketch:
    """All lines of a file, and how large its unit is.

    `unit` is in metres, 0 where the file does not say; `said` is what was understood so far. Where `is_joined`, pieces
    that meet end to end are one curve, whatever their names.
    """

    pieces: tuple[Piece, ...]
    unit: float
    said: str
    is_joined: bool = True


@dataclass(frozen=True)
class HowToRead:
    """What a file does not say, or says more than once.

    `unit` is what a unit of the file is; `curve` names one of several; `edge`, "upper" or "lower", is the side of an
    outline or of a silhouette; `width_mm` is how wide the curve is, whatever the file says. InvalidInput for what makes
    no sense.
    """

    unit: str = ""
    curve: str = ""
    edge: str = ""
    width_mm: float | None = None

    def __post_init__(self) -> None:
        from curveline.drawings.lengths import metres_of

        if self.unit:
            metres_of(self.unit)
        if self.edge not in ("", UPPER, LOWER):
            raise InvalidInput(f"there is no edge {self.edge!r} of a drawing", "choose upper or lower")
        if self.width_mm is None:
            return
        if not 0.0 < self.width_mm <= WIDEST_MM:
            raise InvalidInput(f"no drawing is {self.width_mm:g} mm wide", f"choose up to {WIDEST_MM:g} mm")
        if self.unit:
            raise InvalidInput(
                "a unit and a width are two scales of one drawing", "say one of them: --unit or --width-mm"
            )


UPPER, LOWER = "upper", "lower"
WIDEST_MM = 1e6


def refuse_line(name: str, line: int, code: str, message: str, hint: str) -> NoReturn:
    """Raise InvalidInput about a line of a file."""
    raise InvalidInput(f"{name}: {message}", hint, [Diagnostic(name, line, 1, code, message, hint)])

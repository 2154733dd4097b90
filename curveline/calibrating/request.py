"""What is asked of a calibration."""

from __future__ import annotations

from dataclasses import dataclass

from curveline.calibrating.droop import Droop
from curveline.errors import InvalidInput
from curveline.scene import Scene

AUTO, FITTED, NONE = "auto", "fit", "none"
ASYMMETRIES = AUTO, FITTED, NONE
"""Whether a rod may bend harder to one side: if the trials tell that it does, in any case, never."""


@dataclass(frozen=True)
class CalibrationRequest:
    """How a rod is calibrated; InvalidInput for what makes no sense."""

    asymmetry: str = AUTO  # one of `ASYMMETRIES`
    droop: Droop | None = None  # a rod that was hung over an edge
    candidates: tuple[Scene, ...] = ()  # shapes beside the built-in ones, of which one may be measured next

    def __post_init__(self) -> None:
        if self.asymmetry not in ASYMMETRIES:
            hint = f"choose {', '.join(ASYMMETRIES[:-1])} or {ASYMMETRIES[-1]}"
            raise InvalidInput(f"there is no asymmetry {self.asymmetry!r}", hint)

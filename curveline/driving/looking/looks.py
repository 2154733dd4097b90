"""A look at a display: a picture, and the states that it shows, kept in the record of the run before it."""

from __future__ import annotations

import time
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from curveline.cameras.outcomes import TrialOutcome
from curveline.comparing.naming import model_curves, named
from curveline.comparing.photographed import CameraUse, trial_in
from curveline.phrases import in_words
from curveline.radio.host.journal import LOOK, Disk, ReopenedJournal
from curveline.scene import Scene
from curveline.system.files import printable
from curveline.trial import Trial


@dataclass(frozen=True)
class Look:
    """What a picture of a display shows, and what was wanted."""

    picture: Path  # that was looked at
    trial: Trial  # what came of it
    wanted: tuple[str, ...]  # states, left to right

    @property
    def states(self) -> tuple[str, ...]:
        """The states of all segments; none if the picture does not tell them."""
        return tuple(curve.state for curve in self.trial.curves)

    @property
    def is_wanted(self) -> bool:
        """Whether the display shows what is wanted."""
        return self.states == self.wanted

    @property
    def is_told(self) -> bool:
        """Whether the picture tells what the display shows."""
        return self.trial.outcome is TrialOutcome.SEEN

    def line(self) -> str:
        """What was seen, in a sentence."""
        if not self.is_told:
            return f"cannot tell what the display shows, {self.trial.outcome.value}: {printable(self.trial.reason)}"
        if self.is_wanted:
            return f"the display shows {in_words(self.states)}, as wanted"
        return f"the display shows {in_words(self.states)}, not the wanted {in_words(self.wanted)}"

    def document(self) -> dict[str, Any]:
        """The look as plain data."""
        return {
            "picture": str(self.picture),
            "outcome": self.trial.outcome.value,
            "reason": self.trial.reason or None,
            "states": list(self.states),
            "wanted": list(self.wanted),
            "as_wanted": self.is_wanted,
        }


def look_at(picture: Path, scene: Scene, camera: CameraUse) -> Look:
    """What a picture shows of a display that was sent the shape of `scene`."""
    seen = named(trial_in(picture, scene, camera), model_curves(scene), scene.display.span)
    return Look(picture, seen, tuple(segment.state for segment in scene.segments))


BYTES = 20_000
"""Of a record of a look, at most."""


def keep_look(run: Path, look: Look, disk: Disk | None = None) -> None:
    """Add what was seen after a run to its record."""
    journal = ReopenedJournal(run, disk)
    try:
        journal.reserve(BYTES)
        journal.append({"type": LOOK, "at": time.time(), **look.document()})
    finally:
        journal.close()

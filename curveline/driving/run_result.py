"""How a run ended, as data."""

from __future__ import annotations

from dataclasses import asdict, dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from curveline._version import __version__
from curveline.driving.promises import Promise
from curveline.driving.status import node_document, node_rows
from curveline.notebook import html_of
from curveline.phrases import in_words
from curveline.plan_file import Plan
from curveline.radio.host.link import OperatorRequest, RunReport

if TYPE_CHECKING:
    from curveline.replay.playback import Playback
    from curveline.replay.tour_checks import ShapeCheck


@dataclass(frozen=True)
class RunResult:
    """How a run through the radio `spec` ended, and the folder of its record.

    `playback` and `shapes`, what the rod showed on the way, are known of modelled displays only.
    """

    plan: Plan  # what was sent
    spec: str
    report: RunReport  # what the nodes did
    request: OperatorRequest  # what an operator asked for, if anything
    playback: Playback | None
    shapes: tuple[ShapeCheck, ...]
    folder: Path  # of the record
    promise: Promise  # what the plan says of the rod there

    @property
    def is_interrupted(self) -> bool:
        """True if somebody asked to stop."""
        return self.request is not OperatorRequest.NONE

    @property
    def is_wanted(self) -> bool:
        """True if all steps were done and, where that is known, the rod is and was in the wanted curves."""
        arrived = self.playback is None or self.playback.states == self.plan.wanted
        return self.report.outcome == "done" and arrived and all(each.states == each.wanted for each in self.shapes)

    def _repr_html_(self) -> str:
        report = self.report
        done = f"{report.outcome}: {report.steps_done} of {report.steps} steps in {report.seconds:.1f} s"
        rod = "" if self.playback is None else f"; the rod shows {in_words(self.playback.states)}"
        return html_of(f"{self.plan.name} {done}{rod}", node_rows(report.nodes, self.plan.drive))

    def document(self) -> dict[str, Any]:
        """The result as plain data."""
        record = asdict(self.report)
        record["nodes"] = [node_document(status, self.plan.drive) for status in self.report.nodes]
        rod = None if self.playback is None else _rod_document(self.playback)
        shapes = None if self.playback is None else [asdict(each) for each in self.shapes]
        head = {"curveline": __version__, "plan": self.plan.name, "display": self.plan.drive.display}
        promised = {"step": self.promise.step, "states": self.promise.states}
        rest = {"promised": promised, "rod": rod, "shapes": shapes, "run": str(self.folder)}
        return {**head, "radio": self.spec, **record, "wanted": self.plan.wanted, **rest}


def _rod_document(playback: Playback) -> dict[str, Any]:
    record = asdict(playback)
    for snap in record["snaps"]:
        snap["seconds"] = snap["seconds"] if snap["seconds"] >= 0.0 else None
    return record

"""The display that a plan was made for, as its file says now."""

from __future__ import annotations

from curveline.listening import SILENT, Listener
from curveline.plan_file import Plan
from curveline.scene import Display
from curveline.shapes.files import read_display


def display_of(plan: Plan, listener: Listener = SILENT) -> Display:
    """The display that `plan` was made for; InvalidInput if its file says nothing of use.

    `listener` is told if the file has changed since the plan was made.
    """
    display = read_display(str(plan.provenance.get("display", plan.drive.display)))
    if display.digest != plan.drive.digest:
        listener.note(f"note: the file of display {plan.drive.display} has changed since this plan was made")
    return display

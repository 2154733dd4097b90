"""Files that `curveline plan` writes: the plan to be sent, its steps as a figure, the way through them as a film."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

from curveline.cli.printing import screen
from curveline.outputs import FILM, PICTURES, PLAN, write_output

if TYPE_CHECKING:
    from curveline.plan_file import Plan


def write_outputs(plan: Plan, paths: Sequence[str], *, force: bool) -> None:
    """Write a plan in every format that is asked for; InvalidInput if its display's file is of no use."""
    for path in paths:
        suffix = PLAN.suffix_of(path)
        if suffix == FILM or suffix in PICTURES:
            _draw(plan, path, force=force)
        else:
            write_output(PLAN, path, (plan,), force=force)
        screen.note(f"wrote {path}")


def _draw(plan: Plan, path: str, *, force: bool) -> None:
    """Write a figure or a film of a plan."""
    from curveline.cli.printing.progress.progress_bar import Bar
    from curveline.cli.terminal import TERMINAL
    from curveline.displays.of_plan import display_of
    from curveline.figures import planfilms, plans

    is_film = PLAN.suffix_of(path) == FILM
    display = display_of(plan, TERMINAL)
    TERMINAL.computing()
    with Bar("film, parts" if is_film else "figure, parts", (planfilms if is_film else plans).parts_of(plan)) as bar:
        write_output(PLAN, path, (plan, display, bar.reach), force=force)

"""Files that `curveline plan` writes: the plan to be sent, its steps as a figure, the way through them as a film."""

from __future__ import annotations

import os
from collections.abc import Sequence
from typing import TYPE_CHECKING

from curveline.cli import show
from curveline.errors import InvalidInput
from curveline.files import refuse_file

if TYPE_CHECKING:
    from curveline.plan import Plan

PLAN = ".json"
FILM = ".gif"
PICTURES = (".svg", ".png")


def check_outputs(paths: Sequence[str], *, force: bool) -> None:
    """Refuse before planning what could not be written after it; InvalidInput or MissingExtra."""
    for path in paths:
        suffix = _suffix(path)
        if suffix not in (PLAN, FILM, *PICTURES):
            hint = f"name a file that ends in {PLAN}, or in {', '.join(PICTURES)} or {FILM} for a figure or a film"
            raise InvalidInput(f"{path}: a plan is JSON", hint=hint)
        if suffix != PLAN:
            from curveline.figures.common import require_matplotlib

            require_matplotlib()
        if os.path.exists(path) and not force:
            refuse_file(path, "exists", "the file exists already", "choose another name, or overwrite it with --force")


def write_outputs(plan: Plan, paths: Sequence[str], *, force: bool) -> None:
    """Write a plan in every format that is asked for; InvalidInput if its display's file is of no use."""
    from curveline.files import write_file
    from curveline.plan import write_plan

    for path in paths:
        if _suffix(path) == PLAN:
            write_plan(plan, path, force=force)
        else:
            write_file(path, _picture(plan, _suffix(path)), force=force)
        show.note(f"wrote {path}")


def _picture(plan: Plan, suffix: str) -> bytes:
    """A figure or a film of a plan."""
    from curveline.cli.bar import Bar
    from curveline.cli.run import display_of
    from curveline.figures import planfilms, plans

    display = display_of(plan)
    show.announce_compilation()
    if suffix == FILM:
        with Bar("film, parts", planfilms.parts_of(plan)) as bar:
            return planfilms.animate_plan(plan, display, bar.reach)
    with Bar("figure, parts", plans.parts_of(plan)) as bar:
        return plans.draw_plan(plan, display, suffix.removeprefix("."), bar.reach)


def _suffix(path: str) -> str:
    return os.path.splitext(path)[1].lower()

"""`curveline plan`: the steps that bring a display into a shape."""

from __future__ import annotations

import os
from typing import Annotated

import typer

from curveline.cli import show
from curveline.errors import InvalidInput
from curveline.files import refuse_file


def plan(
    shapes: Annotated[list[str], typer.Argument(metavar="SHAPE", help="Shape file (.toml).")],
    output: Annotated[
        str | None, typer.Option("-o", "--output", metavar="PLAN", help="Write the plan (.json); - is stdout.")
    ] = None,
    force: Annotated[bool, typer.Option("--force", help="Overwrite a file that exists.")] = False,
    json: Annotated[bool, typer.Option("--json", help="Print the plan's JSON.")] = False,
) -> None:
    """Work out the steps from home to a shape.

    A plan is refused, with the reason, if the rod could end in another state than the wanted one.
    """
    from curveline.cli.steps import describe
    from curveline.plan import to_json, write_plan
    from curveline.planning import make_plan
    from curveline.shapefile import read_shape

    if len(shapes) > 1:
        hint = f"plan them one by one, beginning with `curveline plan {shapes[0]} -o PLAN`"
        raise InvalidInput(f"a plan of {len(shapes)} shapes in a row is not possible in this version", hint)
    path = None if output == "-" else output
    if path is not None:
        _check_output(path, force=force)
    scene = read_shape(shapes[0])
    show.announce_compilation()
    made = make_plan(scene)
    if json or output == "-":
        show.result(to_json(made).rstrip("\n"))
    else:
        show.result("\n".join(describe(made)))
    if path is not None:
        write_plan(made, path, force=force)
        show.note(f"wrote {path}")


def _check_output(path: str, *, force: bool) -> None:
    """Refuse before planning what could not be written, or would not be read as a plan, after it."""
    if not path.endswith(".json"):
        raise InvalidInput(f"{path}: a plan is JSON", hint="name a file that ends in .json")
    if os.path.exists(path) and not force:
        refuse_file(path, "exists", "the file exists already", "choose another name, or overwrite it with --force")

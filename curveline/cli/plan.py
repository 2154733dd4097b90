"""`curveline plan`: the steps that bring a display into a shape."""

from __future__ import annotations

from typing import Annotated

import typer

from curveline.cli import show
from curveline.cli.planfiles import PLAN, check_outputs, write_outputs
from curveline.errors import InvalidInput


def plan(
    shapes: Annotated[
        list[str], typer.Argument(metavar="SHAPE", help="Shape file (.toml), or a plan (.json) to look at.")
    ],
    output: Annotated[
        list[str] | None,
        typer.Option(
            "-o",
            "--output",
            metavar="FILE",
            help="Write the plan (.json), its steps as a figure (.svg, .png) or a film (.gif); - is JSON on stdout. "
            "May be repeated.",
        ),
    ] = None,
    force: Annotated[bool, typer.Option("--force", help="Overwrite files that exist.")] = False,
    json: Annotated[bool, typer.Option("--json", help="Print the plan's JSON.")] = False,
) -> None:
    """Work out the steps from home to a shape, or look at a plan that was worked out before.

    A plan is refused, with the reason, if the rod could end in another state than the wanted one.
    """
    from curveline.cli.steps import describe
    from curveline.plan import read_plan, to_json

    if len(shapes) > 1:
        hint = f"plan them one by one, beginning with `curveline plan {shapes[0]} -o PLAN`"
        raise InvalidInput(f"a plan of {len(shapes)} shapes in a row is not possible in this version", hint)
    files = [path for path in output or () if path != "-"]
    check_outputs(files, force=force)
    if shapes[0].endswith(PLAN):
        made = read_plan(shapes[0])
    else:
        from curveline.planning import make_plan
        from curveline.shapefile import read_shape

        scene = read_shape(shapes[0])
        show.announce_compilation()
        made = make_plan(scene)
    if json or len(files) < len(output or ()):
        show.result(to_json(made).rstrip("\n"))
    else:
        show.result("\n".join(describe(made)))
    write_outputs(made, files, force=force)

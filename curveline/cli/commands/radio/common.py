"""What the commands about the air share."""

from __future__ import annotations

from typing import Annotated

import typer

from curveline.cli.options import RESULTS

OutputOption = Annotated[
    str | None,
    typer.Option(
        "-o", "--output", metavar="FILE", rich_help_panel=RESULTS, help="Figure: .svg, .png or .pdf; .json, .csv."
    ),
]

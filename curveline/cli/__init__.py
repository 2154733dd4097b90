"""The command line: the only package that prints, prompts or exits."""

from __future__ import annotations

import io
import os
import sys
from typing import Annotated

import typer

from curveline import __version__
from curveline.cli import bench, load, plan, send, show, simulate, status, stop
from curveline.cli.display import check
from curveline.cli.display import show as show_display
from curveline.cli.keys import adopt, new, node
from curveline.cli.keys import show as show_keys
from curveline.errors import EXIT_INTERRUPTED, EXIT_NO, CurvelineError

EPILOG = (
    "Exit codes: 0 done; 1 it ran and the answer is no (no such state, infeasible plan, tolerance not reached, a shape "
    "of a batch failed); 2 usage or an invalid file; 3 radio or node fault; 130 interrupted. Results go to stdout, "
    "everything else to stderr."
)

app = typer.Typer(
    name="curveline",
    help="Simulate, plan and drive shape displays made of flexible rods.",
    epilog=EPILOG,
    no_args_is_help=True,
    add_completion=False,
    rich_markup_mode=None,
    pretty_exceptions_enable=False,
)
for _command in (simulate.simulate, plan.plan, send.send, status.status, stop.stop, load.load, bench.bench):
    app.command(epilog=EPILOG, no_args_is_help=_command not in (status.status, stop.stop, bench.bench))(_command)
keys = typer.Typer(help="The keys of a site: make them, load them, learn who the nodes are.", no_args_is_help=True)
for _key_command in (new.new, node.node, adopt.adopt, show_keys.show):
    keys.command(epilog=EPILOG)(_key_command)
app.add_typer(keys, name="keys", epilog=EPILOG)
displays = typer.Typer(
    help="The displays: what is built in, and whether a file of your own is sound.", no_args_is_help=True
)
for _display_command in (check.check, show_display.show):
    displays.command(epilog=EPILOG, no_args_is_help=True)(_display_command)
app.add_typer(displays, name="display", epilog=EPILOG)


def _show_version(wanted: bool) -> None:
    if wanted:
        show.result(f"curveline {__version__}")
        raise typer.Exit


@app.callback()
def _options(
    version: Annotated[
        bool, typer.Option("--version", callback=_show_version, is_eager=True, help="Show the version and exit.")
    ] = False,
) -> None:
    pass


def main() -> None:
    """Entry point: run the command line and leave with the exit code that the design promises."""
    _make_streams_safe()
    try:
        code = _run()
        sys.stdout.flush()
    except KeyboardInterrupt:
        code = EXIT_INTERRUPTED
    except OSError:
        # Only what is still buffered is written here, and what could not be written was reported when it failed.
        code = EXIT_NO
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
    sys.exit(code)


def _run() -> int:
    try:
        app(prog_name="curveline")
    except CurvelineError as error:
        show.complain(error)
        return error.exit_code
    except SystemExit as stop:
        return stop.code if isinstance(stop.code, int) else EXIT_NO
    return 0


def _make_streams_safe() -> None:
    """A closed stream swallows, and one that cannot show a character shows a substitute: neither is a traceback."""
    sys.stdout = sys.stdout or open(os.devnull, "w")  # noqa: SIM115
    sys.stderr = sys.stderr or open(os.devnull, "w")  # noqa: SIM115
    for stream in (sys.stdout, sys.stderr):
        if isinstance(stream, io.TextIOWrapper):
            stream.reconfigure(errors="replace")

"""What `curveline send` does with a folder of lines, or a run of them: asks, sends, and says how it ended."""

from __future__ import annotations

from curveline.cli import consent
from curveline.cli.printing import screen
from curveline.cli.printing.failures import document
from curveline.cli.printing.reports import lines_text
from curveline.cli.run import Means, Named
from curveline.cli.terminal import TERMINAL
from curveline.driving.interrupted import resuming
from curveline.driving.lines.dry_lines import dry_run_of_lines
from curveline.driving.lines.interrupted_lines import InterruptedLines, find_interrupted_lines
from curveline.driving.lines.lines_result import LinesHalted, LinesResult
from curveline.driving.lines.lines_wish import LinesRadio, LinesWish, going_home, read_lines
from curveline.driving.lines.preparing_lines import LinesSite, prepared_lines, prepared_rest
from curveline.errors import EXIT_DONE, EXIT_INTERRUPTED, EXIT_NO
from curveline.phrases import counted
from curveline.radio.host.actions import Policy
from curveline.radio.host.link import Control, OperatorRequest

Asked = LinesWish | InterruptedLines


def named_lines(named: Named, means: Means, *, is_typed: bool, is_dry: bool) -> Asked | None:
    """The lines of a folder, or a run of lines that goes on; None if what was named is of one display.

    A radio that was typed is that of all lines, one in the environment of those for which the manifest names none.
    """
    if named.resume is not None:
        found = find_interrupted_lines(named.resume, means.runs)
        return found if found is None or not is_typed else found.over(means.spec)
    radio = LinesRadio(means.spec if is_typed else "", means.spec, is_needed=not is_dry)
    lines = read_lines(named.folder, radio)
    return going_home(lines) if named.home else lines


def rehearse(wish: Asked, means: Means, *, as_json: bool) -> int:
    """Print what would be staged, line after line."""
    dry = dry_run_of_lines(wish, means.runs, TERMINAL, touched=means.touched)
    if as_json:
        screen.emit(dry.document())
    else:
        screen.result("\n".join(lines_text.describe_dry(dry)))
    screen.note("dry run: nothing was sent")
    return EXIT_DONE


def send(wish: Asked, means: Means, *, as_json: bool) -> int:
    """Make all lines ready, ask, send, and say how it ended; the exit code."""
    if means.asks:
        consent.require_terminal("sending moves the displays, and ", "add --yes to agree")
    site = LinesSite(means.runs, TERMINAL, means.touched)
    control = Control(Policy(takeover=means.takeover), tell=screen.note)
    opened = prepared_rest(wish, site) if isinstance(wish, InterruptedLines) else prepared_lines(wish, site)
    try:
        with opened as ready:
            if means.asks and not consent.agrees(f"Move {counted(len(ready.lines), 'display')}?"):
                screen.note("nothing was sent")
                return EXIT_NO
            result = ready.send(control)
    except LinesHalted as halted:
        return _conclude_halted(halted, control, as_json=as_json)
    return _conclude(result, as_json=as_json)


def _conclude_halted(halted: LinesHalted, control: Control, *, as_json: bool) -> int:
    """Say how it stands after a fault, or an emergency stop, which ends a run as a fault of all nodes."""
    if as_json:
        screen.emit({**halted.result.document(), "error": document(halted)})
    else:
        screen.result("\n".join(lines_text.describe(halted.result)))
    screen.complain(halted)
    _advise(halted.result)
    return halted.exit_code if control.request is OperatorRequest.NONE else EXIT_INTERRUPTED


def _conclude(result: LinesResult, *, as_json: bool) -> int:
    """Say how the run ended; the exit code for it."""
    if as_json:
        screen.emit(result.document())
    else:
        screen.result("\n".join(lines_text.describe(result)))
    if result.is_interrupted:
        _advise(result)
        return EXIT_INTERRUPTED
    return EXIT_DONE if result.is_wanted else EXIT_NO


def _advise(result: LinesResult) -> None:
    if result.can_resume:
        screen.note(f"to go on with this run: {resuming(result.folder)}")

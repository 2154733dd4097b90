"""Several displays in one run, from Python: sending a folder of lines, and going on with a run of them."""

from __future__ import annotations

import os
from pathlib import Path
from typing import TYPE_CHECKING

from curveline.driving.lines.dry_lines import LinesDryRun, dry_run_of_lines
from curveline.driving.lines.interrupted_lines import find_interrupted_lines
from curveline.driving.lines.lines_result import LinesResult
from curveline.driving.lines.lines_wish import LinesRadio, going_home, read_lines
from curveline.driving.lines.preparing_lines import LinesSite, prepared_lines, prepared_rest
from curveline.driving.run_listener import UNHEARD, RunListener
from curveline.errors import InvalidInput
from curveline.radio.host.journal import runs_folder
from curveline.radio.host.link import Control

if TYPE_CHECKING:
    from curveline.system.files import AnyPath


def send_lines(
    folder: AnyPath,
    radio: str = "",
    *,
    runs: Path | str | None = None,
    control: Control | None = None,
    listener: RunListener = UNHEARD,
) -> LinesResult:
    """Take all lines of a folder through their plans in one run: a display each, as the folder's `lines.toml` says.

    `radio` is that of all lines, whatever the manifest says of theirs; `runs` as for `connect`. `control` can pause,
    hold or stop all lines. What comes back is a sequence of lines. Raises InvalidInput for what cannot be sent, or not
    together, before a radio is opened; LinkError, with the name of its `line` and the `result` of all, once all nodes
    that can be held are held.
    """
    wish = read_lines(folder, LinesRadio(radio))
    with prepared_lines(wish, LinesSite(_where(runs), listener)) as ready:
        return ready.send(control)


def home_lines(
    folder: AnyPath,
    radio: str = "",
    *,
    runs: Path | str | None = None,
    control: Control | None = None,
    listener: RunListener = UNHEARD,
) -> LinesResult:
    """Bring all displays of a folder home, in one run, from wherever they stand; else as `send_lines`.

    Nodes are level and upright then, and the rods straight, so that the folder's plans can be sent again.
    """
    wish = going_home(read_lines(folder, LinesRadio(radio)))
    with prepared_lines(wish, LinesSite(_where(runs), listener)) as ready:
        return ready.send(control)


def _where(runs: Path | str | None) -> Path:
    """The folder of the records of runs."""
    return runs_folder() if runs is None else Path(runs)


def resume_lines(
    run: AnyPath,
    radio: str = "",
    *,
    runs: Path | str | None = None,
    control: Control | None = None,
    listener: RunListener = UNHEARD,
) -> LinesResult:
    """Go on with a run of several lines that was broken off, by its folder or its name; else as `send_lines`.

    Each line goes on over the radio it was sent through, or all over `radio`. Lines that are done stay as they are. A
    line that cannot go on is left where it is, and its `error` says why.
    """
    broken = find_interrupted_lines(os.fspath(run), where := _where(runs))
    if broken is None:
        raise InvalidInput("this run is of one display", "`session.resume` goes on with it")
    if radio:
        broken = broken.over(radio)
    with prepared_rest(broken, LinesSite(where, listener)) as ready:
        return ready.send(control)


def dry_run_lines(
    folder: AnyPath, radio: str = "", *, runs: Path | str | None = None, listener: RunListener = UNHEARD
) -> LinesDryRun:
    """What `send_lines` would stage, as the nodes would decode it; no radio is opened, nothing moves or is remembered.

    `lines` of what comes back has the frames of each line by its name. Raises InvalidInput as `send_lines`.
    """
    wish = read_lines(folder, LinesRadio(radio, is_needed=False))
    return dry_run_of_lines(wish, _where(runs), listener)

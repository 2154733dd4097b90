"""Everything that curveline raises, and the record that tells a user where a file is wrong.

    CurvelineError           base; exit code 1
    ├── InvalidInput         a file, an option or a scene that cannot be used; carries Diagnostics; exit code 2
    ├── Infeasible           the question was understood and the answer is no: no such state, no safe plan; exit code 1
    ├── MissingExtra         an optional package is not installed; exit code 2
    ├── SystemRefusal        the operating system refused what nobody foresaw; exit code 2
    └── LinkError            radio or node fault; exit code 3

Outcomes of a numerical solve (not converged, unstable) are data, not exceptions: see `rod.states.equilibrium.Outcome`.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

EXIT_DONE = 0
EXIT_NO = 1
EXIT_USAGE = 2
EXIT_LINK = 3
EXIT_INTERRUPTED = 130


@dataclass(frozen=True)
class Diagnostic:
    """One problem in a file a user wrote: where it is, what it is, what to do.

    `line` and `column` count from 1; `source` is the offending line as written, empty if the file has none. Of a very
    long line `source` is only an excerpt: `caret` is where the column stands in it, 0 if there is no source.
    """

    path: str
    line: int
    column: int
    code: str
    message: str
    hint: str = ""
    source: str = ""
    caret: int = 0

    def __str__(self) -> str:
        return f"{self.path}:{self.line}:{self.column}: error[{self.code}]: {self.message}"


class CurvelineError(Exception):
    """Base of all errors raised on purpose; `hint` says what to do about it, `code` is what scripts know it by."""

    exit_code = EXIT_NO
    code = "failed"

    def __init__(self, message: str, hint: str = "") -> None:
        super().__init__(message)
        self.message = message
        self.hint = hint
        if hint:
            # So that a traceback, in a notebook or of a script, shows it, too.
            self.add_note(f"hint: {hint}")


class InvalidInput(CurvelineError):
    """Input that cannot be used; `diagnostics` lists every problem found, in file order."""

    exit_code = EXIT_USAGE
    code = "invalid-input"

    def __init__(self, message: str, hint: str = "", diagnostics: Iterable[Diagnostic] = ()) -> None:
        super().__init__(message, hint)
        self.diagnostics = tuple(diagnostics)


class Infeasible(CurvelineError):
    """The scene or plan is well formed, but what it asks for does not exist or is not safe."""

    exit_code = EXIT_NO
    code = "infeasible"


class MissingExtra(CurvelineError):
    """An optional dependency is needed and absent."""

    exit_code = EXIT_USAGE
    code = "missing-extra"


class SystemRefusal(CurvelineError):
    """The operating system refused something that nobody foresaw: a full disk, no rights, too many open files."""

    exit_code = EXIT_USAGE
    code = "system"


class LinkError(CurvelineError):
    """The radio or a node failed, or refused; `node` is its number from 1, 0 when it concerns all.

    `cause` is what scripts know the fault by that ended a run, such as `stall`; empty where no run was under way.
    """

    exit_code = EXIT_LINK
    code = "link"
    cause = ""

    def __init__(self, message: str, hint: str = "", node: int = 0) -> None:
        super().__init__(message, hint)
        self.node = node

"""Which line something is about: what is told, and what goes wrong."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager

from curveline.driving.run_listener import RunListener
from curveline.errors import CurvelineError
from curveline.listening import Heard
from curveline.phrases import lines_in_words


class NamedListener(RunListener):
    """Hears of one line, and says of which when it passes that on."""

    def __init__(self, listener: RunListener, name: str) -> None:
        self._listener = listener
        self._name = name

    def note(self, text: str) -> None:
        """See Listener."""
        self._listener.note(f"line {self._name}: {text}")

    def computing(self) -> None:
        """See Listener."""
        self._listener.computing()

    @contextmanager
    def progress(self, what: str, total: int | None) -> Iterator[Heard]:
        """See Listener."""
        with self._listener.progress(f"line {self._name}: {what}", total) as heard:
            yield heard


@contextmanager
def errors_of(*names: str) -> Iterator[None]:
    """Whatever goes wrong in this is said to be of the lines of these names."""
    try:
        yield
    except CurvelineError as error:
        error.message = f"{lines_in_words(names)}: {error.message}"
        error.args = (error.message,)
        raise

"""Arguments of library calls that are of another kind than they must be, refused where they are handed over."""

from __future__ import annotations

import os


def expect(value: object, kind: type, what: str) -> None:
    """Raise TypeError unless a value is of a kind; `what` says what that is to be."""
    if not isinstance(value, kind):
        raise TypeError(f"{what} is needed, not {type(value).__name__}")


def expect_several(paths: object, name: str) -> None:
    """Raise TypeError for one path where several are due: its letters would be taken for paths."""
    if isinstance(paths, str | bytes | os.PathLike):
        raise TypeError(f"{name} is one path, {paths!r}: put it into a list, [{paths!r}]")

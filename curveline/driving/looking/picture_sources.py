"""Where pictures of a display come from: a command that takes one, or a folder into which a camera puts them."""

from __future__ import annotations

import os
import shlex
import subprocess
import time
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Protocol

from curveline.comparing.folders import PHOTOGRAPHS
from curveline.errors import CurvelineError, InvalidInput

MODEL = "mock"
"""What names the camera of a mock display."""
PLACE = "{}"
"""What stands in a command for the file of the picture."""
SUFFIX = ".jpg"
COMMAND_S = 60.0
"""How long a command may take."""
ARRIVES_S = 120.0
"""How long a picture is waited for."""
LOOKS_S = 0.2
SETTLED_S = 0.5
"""A file that has not grown for so long is whole."""
MOST_SAID = 300
"""Characters of what a command said that are shown."""


class NoPicture(CurvelineError):
    """No picture came from a camera."""


class PictureSource(Protocol):
    """A camera before a display."""

    def take(self, path: Path) -> Path:
        """Take a picture now, at `path` with a suffix, or elsewhere; where it is. NoPicture if none comes."""
        ...


def is_model(source: str) -> bool:
    """Whether a source is the camera of a mock display: `mock`, or `mock:` with a tier of faults and a seed."""
    return source == MODEL or source.startswith(f"{MODEL}:")


def open_source(source: str, tell: Callable[[str], None]) -> PictureSource:
    """A folder that is there, or a command with `{}` in it; `tell` hears when a picture is waited for.

    InvalidInput for what is neither.
    """
    if os.path.isdir(source):
        return FolderCamera(Path(source), tell)
    if PLACE not in source:
        hint = (
            f"name a folder into which a camera puts its pictures, or a command in which {PLACE} stands for the file, "
            f'such as "rpicam-still -n -o {PLACE}"'
        )
        raise InvalidInput(f"{source}: neither a folder nor a command that takes a picture", hint)
    try:
        words = tuple(shlex.split(source))
    except ValueError as error:
        raise InvalidInput(f"{source}: this command cannot be read: {error}", "close its quotes") from None
    return CommandCamera(words)


@dataclass(frozen=True)
class CommandCamera:
    """A camera that a command makes take pictures; no shell reads it."""

    words: tuple[str, ...]  # of the command, with `PLACE` among them or within one

    def take(self, path: Path) -> Path:
        """See PictureSource."""
        picture = path.with_name(path.name + SUFFIX)
        command = [word.replace(PLACE, str(picture)) for word in self.words]
        hint = "try the command by itself, with the name of a file in place of {}"
        try:
            done = subprocess.run(
                command, capture_output=True, timeout=COMMAND_S, check=False, stdin=subprocess.DEVNULL
            )
        except subprocess.TimeoutExpired:
            raise NoPicture(f"{command[0]} has not taken a picture within {COMMAND_S:g} s", hint) from None
        except (OSError, ValueError) as error:
            raise NoPicture(f"{command[0]} cannot be run: {error}", hint) from None
        if done.returncode != 0:
            said = done.stderr.decode("utf-8", "replace").strip()[-MOST_SAID:]
            raise NoPicture(f"{command[0]} failed with exit code {done.returncode}: {said or 'it says nothing'}", hint)
        if not picture.is_file():
            raise NoPicture(f"{command[0]} left no picture in {picture}", hint)
        return picture


@dataclass(frozen=True)
class FolderCamera:
    """A camera that puts its pictures into a folder, whenever somebody takes one."""

    folder: Path  # of the pictures
    tell: Callable[[str], None]  # hears what is waited for
    seen: set[str] = field(default_factory=set)  # names of pictures that are used already

    def __post_init__(self) -> None:
        self.seen.update(self._names())

    def take(self, path: Path) -> Path:
        """See PictureSource; it waits for a picture that was not there before."""
        self.tell(f"waiting for a picture in {self.folder}")
        ends = time.monotonic() + ARRIVES_S
        while time.monotonic() < ends:
            if new := sorted(self._names() - self.seen):
                self.seen.update(new)
                picture = self.folder / new[-1]
                _wait_until_whole(picture)
                return picture
            time.sleep(LOOKS_S)
        hint = "take one, or name a command that does"
        raise NoPicture(f"no new picture came into {self.folder} within {ARRIVES_S:g} s", hint)

    def _names(self) -> set[str]:
        try:
            return {name for name in os.listdir(self.folder) if name.lower().endswith(PHOTOGRAPHS) and name[0] != "."}
        except OSError as error:
            raise NoPicture(f"{self.folder} cannot be looked into: {error.strerror}", "see that it is there") from None


def _wait_until_whole(picture: Path) -> None:
    """Wait until a file has stopped growing."""
    size, since = -1, time.monotonic()
    while time.monotonic() - since < SETTLED_S:
        try:
            now = picture.stat().st_size
        except OSError:
            return  # whoever reads it says why not
        if now != size:
            size, since = now, time.monotonic()
        time.sleep(LOOKS_S / 2.0)

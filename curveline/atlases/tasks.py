"""What can be handed to whoever computes: tasks that come to the same wherever they are done."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from typing import Any, Protocol


class SharedTask(Protocol):
    """What a process can be handed to do."""

    def perform(self) -> Any:
        """What comes of it, the same wherever it is done."""


Doer = Callable[[Sequence[SharedTask]], Iterator[Any]]
"""Does tasks, and gives what comes of each in their order."""


def perform(task: SharedTask) -> Any:
    """What comes of a task."""
    return task.perform()

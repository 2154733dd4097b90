"""When a run that is one of several may begin, and when its nodes may move: the seam, and a run that is alone."""

from __future__ import annotations

from typing import Protocol


class Turns(Protocol):
    """Who says so; asked again and again, while the nodes stand and are polled."""

    def may_begin(self) -> bool:
        """Whether the nodes, all of which are fit to, may be taken through the plan from here on."""
        ...

    def may_move(self) -> bool:
        """Whether the next step may be released, for which all nodes have their targets."""
        ...


class AtOnce:
    """The turns of a run that is alone."""

    def may_begin(self) -> bool:
        """See Turns."""
        return True

    def may_move(self) -> bool:
        """See Turns."""
        return True

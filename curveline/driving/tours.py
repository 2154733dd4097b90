"""What a display is to show: shapes one after the other, then nothing, which is home; and the plan that leads there."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

from curveline.errors import InvalidInput
from curveline.listening import SILENT, Listener
from curveline.phrases import in_words
from curveline.scene import Display, Offsets, Scene

if TYPE_CHECKING:
    from collections.abc import Callable

    from curveline.plan_file import Plan
    from curveline.radio.protocol.codes import Counts


@dataclass(frozen=True)
class Tour:
    """The shapes of one display in the order in which it is to show them, and whether it is to go home after them."""

    display: Display
    scenes: tuple[Scene, ...] = ()
    ends_home: bool = False

    def without_last(self) -> Tour:
        """The same, but for its last shape."""
        return replace(self, scenes=self.scenes[:-1])


def tour_of(scenes: Sequence[Scene], *, ends_home: bool = False) -> Tour:
    """A tour through at least one shape; InvalidInput if they are of different displays."""
    first = scenes[0]
    for scene in scenes:
        if scene.display.digest != first.display.digest:
            raise InvalidInput(
                f"{scene.path or scene.name} is a shape of display {scene.display.name}, "
                f"{first.path or first.name} one of {first.display.name}",
                "a tour is of one display; send the shapes of each display by themselves",
            )
    return Tour(first.display, tuple(scenes), ends_home)


def home_of(display: str) -> Tour:
    """Home of a built-in display, or of one in a file."""
    from curveline.shapes.files import given_display

    return Tour(given_display(display), ends_home=True)


@dataclass(frozen=True)
class Whereabouts:
    """Where a display stands: encoder counts of every node, home if None, and the states that its segments show."""

    counts: tuple[Counts, ...] | None = None
    shows: tuple[str, ...] = ()


def plan_tour(tour: Tour, begin: Whereabouts, listener: Listener = SILENT) -> Plan:
    """A plan from where a display stands, where the segments are in the states `shows`, "" where not known."""
    from curveline.planning.tours import make_home_plan, make_round_trip, make_tour

    if tour.display.offsets != Offsets():
        listener.note("plans take nodes to be where they are told: the offsets of this display are in none")
    with _planning(listener) as tell:
        if not tour.scenes:
            return make_home_plan(tour.display, begin.counts, begin.shows, tell)
        return (make_round_trip if tour.ends_home else make_tour)(tour.scenes, begin.counts, begin.shows, tell)


@contextmanager
def _planning(listener: Listener) -> Iterator[Callable[[], None]]:
    """Called for every step that has been proven."""
    listener.computing()
    count = 0
    with listener.progress("planning, steps proven:", None) as heard:

        def tell() -> None:
            nonlocal count
            count += 1
            heard(count)

        yield tell


def summary(plan: Plan) -> str:
    """A plan as a whole in a few words."""
    steps = f"{len(plan.steps)} step{'s' if len(plan.steps) > 1 else ''}"
    return f"display {plan.drive.display}, {steps}, {plan.seconds:.1f} s, ends in: {in_words(plan.wanted)}"


def granted(plan: Plan) -> str:
    """The states that the segments must be in at the start, in a few words."""
    return in_words([name or "any" for name in plan.granted])

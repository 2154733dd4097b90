"""What a display is to show: shapes one after the other, then nothing, which is home; and the plan that leads there."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

from curveline.cli.printing import screen
from curveline.cli.printing.progress_bar import Bar
from curveline.errors import InvalidInput
from curveline.scene import Display, Scene

if TYPE_CHECKING:
    from curveline.plan_file import Plan
    from curveline.radio.protocol.codes import Counts


@dataclass(frozen=True)
class Tour:
    """The shapes of one display in the order in which it is to show them, and whether it is to go home after them."""

    display: Display
    scenes: tuple[Scene, ...] = ()
    ends_home: bool = False


def read_goal(paths: Sequence[str], *, ends_home: bool = False) -> Tour:
    """The shapes in some files, at least one; InvalidInput if they are of different displays."""
    from curveline.shapes.files import read_shape

    scenes = tuple(read_shape(path) for path in paths)
    for path, scene in zip(paths, scenes, strict=True):
        if scene.display.digest != scenes[0].display.digest:
            raise InvalidInput(
                f"{path} is a shape of display {scene.display.name}, {paths[0]} one of {scenes[0].display.name}",
                "a tour is of one display; send the shapes of each display by themselves",
            )
    return Tour(scenes[0].display, scenes, ends_home)


def home_of(display: str) -> Tour:
    """Home of a built-in display, or of one in a file."""
    from curveline.shapes.files import read_display

    return Tour(read_display(display), ends_home=True)


def plan_goal(goal: Tour, start: tuple[Counts, ...] | None, shows: tuple[str, ...] = ()) -> Plan:
    """A plan from encoder counts, home if None, where the segments are in the states `shows`, "" where not known."""
    from curveline.planning.tours import make_home_plan, make_round_trip, make_tour

    screen.announce_compilation()
    with Bar("planning, steps proven:", None) as bar:
        if not goal.scenes:
            return make_home_plan(goal.display, start, shows, bar.step)
        return (make_round_trip if goal.ends_home else make_tour)(goal.scenes, start, shows, bar.step)

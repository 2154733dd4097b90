"""Of a shape that is not safe for a rod with a set, what to do first: hold it straight, or in the mirrored shape."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

from curveline.errors import Infeasible
from curveline.material.history import Dwell, duration_text
from curveline.scene import PEAK, VALLEY, Scene
from curveline.simulation.dwelling import Holding, as_made, at_home_first, followed, with_set
from curveline.units import DAY, HOUR, MINUTE, WEEK

Works = Callable[[Scene], bool]
"""Whether a shape can be planned from home."""

WAITS = (10 * MINUTE, HOUR, 4 * HOUR, DAY, 3 * DAY, WEEK)
"""Times for which a rod is held somewhere first [s]."""
OTHER = {PEAK: VALLEY, VALLEY: PEAK}


def advice_first(scene: Scene, works: Works) -> str:
    """What to do before a shape whose rod has a past, as a sentence; empty if nothing that was tried helps."""
    past = scene.past
    if past is None or past.largest_set == 0.0:
        return ""
    at_home = next((wait for wait in WAITS if works(at_home_first(scene, wait))), None)
    mirrored = None
    if scene.last is not None:
        shorter = (wait for wait in WAITS if at_home is None or wait < at_home)
        mirrored = next((wait for wait in shorter if _works_mirrored_first(scene, scene.last, wait, works)), None)
    ways = []
    if at_home is not None:
        ways.append(f"at home for {duration_text(at_home)}")
    if mirrored is not None and scene.last is not None:
        ways.append(f"in the mirrored shape of {scene.last.name} for {duration_text(mirrored)}")
    return f"the rod's set is in the way: hold it {' or '.join(ways)} first" if ways else ""


def mirrored_shape(scene: Scene) -> Scene:
    """The shape upside down: heights and angles with the other sign, peaks for valleys."""
    return replace(
        scene,
        name=f"{scene.name}, mirrored",
        nodes=tuple(replace(node, height=-node.height, angle=-node.angle) for node in scene.nodes),
        segments=tuple(replace(each, state=OTHER.get(each.state, each.state)) for each in scene.segments),
        loads=(),
    )


def _works_mirrored_first(scene: Scene, last: Scene, seconds: float, works: Works) -> bool:
    """True if a shape can be planned when the rod was held for so long [s] in the mirror image of the last one.

    It cannot where the set keeps the rod from the mirror image, too.
    """
    try:
        first = _mirrored_first(scene, last, seconds)
    except Infeasible:
        return False
    return works(first)


def _mirrored_first(scene: Scene, last: Scene, seconds: float) -> Scene:
    """A shape with a past, had the rod been held for so long [s] after it in the mirror image of the last one.

    Infeasible if it cannot be held there.
    """
    assert scene.past is not None
    display = as_made(scene)
    there = replace(mirrored_shape(last), display=display, past=None, last=None)
    memory, _, _ = followed(scene.past.memory, display, [Holding(Dwell(there.name, seconds), there)])
    return replace(scene, display=with_set(display, memory))

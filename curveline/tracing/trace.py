"""From a photograph to a trial: every segment's rod followed along every state that it may be in, and named."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from curveline.cameras.outcomes import TrialOutcome
from curveline.cameras.pose import FoundView
from curveline.cameras.setup import CameraSetup
from curveline.cameras.view import View
from curveline.errors import InvalidInput
from curveline.rod.states.equilibrium import Equilibrium
from curveline.scene import Scene
from curveline.simulation.simulate import simulate
from curveline.tracing.following import FollowedState, TracingTask, followed
from curveline.tracing.noise import noise_of
from curveline.tracing.verdicts import SegmentVerdict, verdict_on
from curveline.tracing.windows import Sight
from curveline.trial import Trial, TrialCurve

EDGE = 2.563
"""From a tenth to nine tenths of the contrast of an edge, in standard deviations of what blurs it."""
Picture = npt.NDArray[np.uint8]


@dataclass(frozen=True, eq=False)
class TracedSegment:
    """What came of a segment: every state that was followed, the likeliest first, and what is said of it."""

    followed: tuple[FollowedState, ...]
    verdict: SegmentVerdict

    @property
    def curve(self) -> TrialCurve | None:
        """The rod, if it was seen."""
        if self.verdict.outcome is not TrialOutcome.SEEN:
            return None
        best = self.followed[0]
        return TrialCurve(best.points, best.state.name, self.verdict.sigma)


@dataclass(frozen=True, eq=False)
class Traced:
    """What came of a photograph: the segments from left to right."""

    view: View
    setup: CameraSetup
    segments: tuple[TracedSegment, ...]

    @property
    def outcome(self) -> TrialOutcome:
        """What came of it all: of the first segment that was not seen, if there is one."""
        return next((each.verdict.outcome for each in self.segments if each.curve is None), TrialOutcome.SEEN)

    @property
    def reason(self) -> str:
        """In sentences, why segments cannot be used; empty if all can."""
        if len(self.segments) == 1:
            return self.segments[0].verdict.reason
        said = [(number, each.verdict.reason) for number, each in enumerate(self.segments, start=1) if not each.curve]
        return "; ".join(f"segment {number}: {reason}" for number, reason in said)

    def trial(self, source: str) -> Trial:
        """As a trial of what the user called `source`; it has curves if all segments were seen."""
        curves = tuple(each.curve for each in self.segments if each.curve is not None)
        seen = self.outcome is TrialOutcome.SEEN
        return Trial(source, self.outcome, self.reason, curves if seen else ())


def trace(
    picture: Picture,
    view: View | FoundView,
    scene: Scene,
    setup: CameraSetup,
    states: Sequence[Sequence[Equilibrium]] | None = None,
) -> Traced:
    """The rod of every segment of a shape in a grey `picture (height, width)` that was taken from `view`.

    A view that was found by tags tells also how blurred the picture is. `states` are those that each segment may be in;
    all stable ones if it is None. Raises InvalidInput for a picture of another size than the lens was calibrated for.
    """
    height, width = picture.shape
    where = view.view if isinstance(view, FoundView) else view
    blur = view.blur / EDGE if isinstance(view, FoundView) else 0.0
    if (width, height) != where.lens.size:
        wide, high = where.lens.size
        message = f"the picture has {width} x {height} pixels, the lens is that of {wide} x {high}"
        raise InvalidInput(message, "calibrate the camera as it takes such pictures")
    listed = [segment.states for segment in simulate(scene)] if states is None else states
    sight, noise = Sight(picture, where, setup.rod, blur), noise_of(picture)
    segments = []
    for index, each in enumerate(listed):
        tasks = (TracingTask(scene, index, state, setup.node, noise) for state in each if state.stable)
        found = [one for one in (followed(sight, task) for task in tasks) if one is not None]
        found.sort(key=lambda one: -one.support)
        segments.append(TracedSegment(tuple(found), verdict_on(found)))
    return Traced(where, setup, tuple(segments))

"""What the rod of a modelled display did in a run, played from what its nodes did, and in words."""

from __future__ import annotations

import time
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

from curveline.driving.modelled import ModelledDisplay
from curveline.driving.promises import Promise
from curveline.errors import InvalidInput
from curveline.listening import Listener
from curveline.phrases import alike, spans
from curveline.plan_file import Plan
from curveline.radio.protocol.codes import Counts
from curveline.units import deg, nmm

if TYPE_CHECKING:
    from curveline.driving.rod_record import RodRecord
    from curveline.replay.playback import Playback, Snap
    from curveline.replay.tour_checks import ShapeCheck
    from curveline.scene import Display

    PlayedBack = tuple[Playback | None, tuple[ShapeCheck, ...]]

BEFORE = -1.0
"""When [s] anything happened that a process did which was killed: before this one began."""


@dataclass(frozen=True)
class PlayedPlan:
    """A plan that is played back from its step `first` (from 1) on.

    `way` is how the nodes came to where that began, if no one has told of it yet; `run` is the name of the run, and
    `record` where it is.
    """

    plan: Plan
    first: int = 1
    way: Sequence[tuple[Counts, ...]] = ()
    run: str = ""
    record: RodRecord | None = None


def play_back_run(played: PlayedPlan, display: ModelledDisplay | None, begin: float, listener: Listener) -> PlayedBack:
    """What the motion of a model's nodes since `begin` [s] did to its rod, which it then remembers.

    None behind a real radio, and if the display file is gone.
    """
    if display is None:
        return None, ()
    from curveline.displays.of_plan import display_of

    try:
        described = display_of(played.plan, listener)
    except InvalidInput as error:
        listener.note(f"which curve the rod took is not known: {error.message}")
        display.rod = []
        return None, ()
    from curveline.replay.playback import touched
    from curveline.replay.tour_checks import CarriedOut, play_back

    described = _with_set(in_truth(described, display, played.plan), played)
    listener.computing()
    motion = [(seconds - begin, counts) for seconds, counts in display.motion()]
    before = [(BEFORE, counts) for counts in played.way]
    playback, checks = play_back(CarriedOut(played.plan, described, played.first), [*before, *motion], display.rod)
    if display.hand is not None:
        playback, display.hand = touched(described, playback, motion[-1], display.hand), None
    display.rod = list(playback.states)
    return playback, checks


def _with_set(described: Display, played: PlayedPlan) -> Display:
    """The display with its rod as the runs before left it, if its file says what set that takes."""
    if described.rod.relaxation is None or played.record is None:
        return described
    from curveline.driving.rod_now import rod_now

    return rod_now(described, played.record, time.time(), played.run).with_set


def in_truth(described: Display, display: ModelledDisplay, plan: Plan) -> Display:
    """The display as it is in a run of a plan, where that differs from what its file says."""
    real = with_terms(described, display)
    if not display.set_share:
        return real
    from curveline.replay.kept_curvature import with_kept
    from curveline.replay.monte_carlo import kept_before

    kept = kept_before(described, plan)
    return real if kept is None else replace(real, rod=with_kept(real.rod, kept, display.set_share))


def with_terms(described: Display, display: ModelledDisplay) -> Display:
    """The display as it is in truth, but for the set of its rod."""
    stiffness, play = described.clamp_stiffness, described.clamp_play
    if display.clamp is not None:
        stiffness = nmm(display.clamp) / deg(1.0)
    play = play if display.play is None else deg(display.play)
    rod = replace(
        described.rod,
        youngs_modulus=described.rod.youngs_modulus * (1.0 + display.stiffness),
        shear_modulus=described.rod.shear_modulus * (1.0 + display.stiffness),
        natural_curvature=described.rod.natural_curvature + display.curvature,
    )
    return replace(described, clamp_stiffness=stiffness, clamp_play=play, rod=rod)


def rod_lines(playback: Playback | None, promised: Promise) -> Iterator[str]:
    """What the rod did, as text, where it is known."""
    if playback is None:
        return
    from curveline.replay.tour_checks import posture

    said = [(state, promised.verdict(segment, state)) for segment, state in enumerate(playback.states)]
    yield from map(_snap_line, playback.snaps)
    for segments, (state, verdict) in alike(said):
        which = f"segment{'s' if len(segments) > 1 else ''} {spans(segments)}"
        yield f"{which}: the rod is {posture(state)}{verdict}"


def _snap_line(snap: Snap) -> str:
    when = "before this went on" if snap.seconds < 0.0 else f"{snap.seconds:.1f} s"
    return f"{when}: segment {snap.segment} snapped from {snap.before} to {snap.after}"

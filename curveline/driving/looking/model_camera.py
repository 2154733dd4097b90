"""The camera of a mock display: pictures of the rod that is modelled, in the state in which it is."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING

from curveline.driving.looking.picture_sources import MODEL, NoPicture
from curveline.driving.modelled import ModelledDisplay
from curveline.driving.rod_report import with_terms
from curveline.errors import InvalidInput
from curveline.scene import Offsets
from curveline.system.files import write_file
from curveline.units import deg, mm

if TYPE_CHECKING:
    from curveline.cameras.setup import CameraSetup
    from curveline.cameras.synthetic.faults import PictureFaults
    from curveline.radio.protocol.codes import Counts
    from curveline.scene import Display, Scene
    from curveline.trial import Array

SCATTER_ANGLE, SCATTER_LENGTH = deg(0.5), mm(0.4)
"""Standard deviations of how far a node turns, and how much rod a segment has, beside what was told: with these trials
are apart as those of the paper's display, 0.75 mm."""
FORM = "mock, or mock: with a tier (clean, lab or hard) and a seed, such as mock:lab,7"


def faults_in(source: str) -> PictureFaults:
    """What is wrong with the pictures of a camera that is named so; InvalidInput unless it can be read."""
    from curveline.cameras.synthetic.faults import LAB, TIERS, faults_of

    words = [word for word in source.removeprefix(MODEL).removeprefix(":").split(",") if word]
    tiers, seeds = [word for word in words if word in TIERS], [word for word in words if word.isdecimal()]
    if len(tiers) > 1 or len(seeds) > 1 or len(tiers) + len(seeds) < len(words) or len("".join(seeds)) > 9:
        raise InvalidInput(f"{source}: no such camera of a mock display", f"write {FORM}")
    return faults_of(tiers[0] if tiers else LAB, int(seeds[0]) if seeds else 1)


@dataclass
class ModelCamera:
    """A camera before a modelled display; every picture has other noise."""

    display: Display  # as its file has it
    modelled: ModelledDisplay  # what is behind the radio
    setup: CameraSetup  # what the camera file says
    faults: PictureFaults  # of its first picture
    taken: int = 0  # pictures so far

    def take(self, path: Path) -> Path:
        """See PictureSource."""
        import cv2

        from curveline.cameras.synthetic.photograph import photograph_of
        from curveline.cameras.synthetic.standpoints import view_through

        faults = replace(self.faults, seed=self.faults.seed + self.taken)
        real = scattered(with_terms(self.display, self.modelled), self.modelled.scatter, faults.seed)
        scene, curves = shown_by(real, self.modelled.positions(), self.modelled.known_rod)
        self.taken += 1
        view = view_through(self.setup.lens, self.display)
        picture = path.with_name(path.name + ".png")
        _, data = cv2.imencode(".png", photograph_of(scene, curves, self.setup, view, faults))
        write_file(picture, data.tobytes(), force=True)
        return picture


def scattered(display: Display, times: float, seed: int) -> Display:
    """The display with nodes that are off by chance, as `SCATTER_ANGLE` and `SCATTER_LENGTH` have it, so many times."""
    import numpy as np

    if times == 0.0:
        return display
    random, told = np.random.default_rng([seed, 41]), display.offsets
    angles = times * SCATTER_ANGLE * random.standard_normal(display.node_count)
    lengths = times * SCATTER_LENGTH * random.standard_normal(display.node_count - 1)
    return replace(
        display,
        offsets=Offsets(
            tuple(told.angle(node) + float(by) for node, by in enumerate(angles)),
            tuple(told.length(segment) + float(by) for segment, by in enumerate(lengths)),
        ),
    )


def shown_by(display: Display, counts: Sequence[Counts], states: Sequence[str]) -> tuple[Scene, list[Array]]:
    """The shape that nodes at such `counts` make of a display, and the curves [m] of its rod in some states.

    NoPicture if the rod is in no state of which a curve is known.
    """
    from curveline.cameras.synthetic.photograph import curves_of
    from curveline.driving.looking.standing import scene_at
    from curveline.simulation.simulate import simulate

    scene = scene_at(display, counts, states)
    found = []
    for number, (segment, name) in enumerate(zip(simulate(scene), states, strict=False), start=1):
        state = next((each for each in segment.states if each.name == name), None)
        if state is None:
            raise NoPicture(f"segment {number} of the mock display is {name}, of which no picture can be made")
        found.append(state)
    if len(found) < len(scene.segments):
        hint = "send a shape first: the mock forgets its rod when a node moves otherwise"
        raise NoPicture("it is not known in which state the rod of the mock display is", hint)
    return scene, curves_of(scene, found)

"""Trials read from what was named: points from tables, the rod traced in photographs."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from curveline.comparing.folders import files_of, is_photograph
from curveline.comparing.trial import ShapeTrials, Trial
from curveline.comparing.trial_tables import read_table
from curveline.listening import SILENT, Listener
from curveline.scene import Scene
from curveline.shapes.files import read_shape
from curveline.system.files import AnyPath


@dataclass(frozen=True)
class Photographed:
    """How photographs among trials were made, and what becomes of them.

    `camera` is the camera file, None for that of the folder; `overlays` a folder into which each picture is drawn with
    what was seen in it, None for none. Pictures there are replaced where `is_replacing`.
    """

    camera: AnyPath | None = None
    overlays: AnyPath | None = None
    is_replacing: bool = False


def read_trials(
    what: Sequence[AnyPath], photographed: Photographed | None = None, listener: Listener = SILENT
) -> tuple[ShapeTrials, ...]:
    """The trials of a shape, [shape, trial, ...], or those of all shapes in some folders, [folder, ...].

    A folder has files such as level-up-peak-1.csv, or a folder level-up-peak with the files of its trials; the shapes
    are level-up-peak.toml beside them, or built-in ones. Points are x_mm and y_mm in the display's frame. InvalidInput
    for what cannot be read.
    """
    given = files_of(what)
    total = sum(len(each.files) for each in given)
    found, done = [], 0
    with listener.progress("reading trials", total) as heard:
        for each in given:
            scene, trials = read_shape(each.shape), []
            for path in each.files:
                trials.append(_read(path, scene))
                heard(done := done + 1)
            found.append(ShapeTrials(scene, tuple(trials)))
    return tuple(found)


def _read(path: str, scene: Scene) -> Trial:
    if is_photograph(path):
        raise NotImplementedError
    return read_table(path, scene)

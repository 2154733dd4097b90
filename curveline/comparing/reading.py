"""Trials read from what was named: points from tables, the rod traced in photographs."""

from __future__ import annotations

import os
from collections.abc import Sequence
from dataclasses import dataclass, replace

from curveline.comparing.folders import camera_in, files_of, is_photograph
from curveline.comparing.photographed import camera_use, trial_in
from curveline.comparing.trial_tables import read_table
from curveline.errors import InvalidInput
from curveline.listening import SILENT, Listener
from curveline.scene import Display, Scene
from curveline.shapes.files import given_display, read_shape
from curveline.system.files import AnyPath
from curveline.trial import ShapeTrials, Trial


@dataclass(frozen=True)
class Photographed:
    """How photographs among trials were made, and what becomes of them.

    `camera` is the camera file, None for that of the folder; `overlays` a folder into which each picture is drawn with
    what was seen in it, None for none.
    """

    camera: AnyPath | None = None
    overlays: AnyPath | None = None


def read_trials(
    what: Sequence[AnyPath],
    photographed: Photographed | None = None,
    display: AnyPath | Display | None = None,
    listener: Listener = SILENT,
) -> tuple[ShapeTrials, ...]:
    """The trials of a shape, [shape, trial, ...], or those of all shapes in some folders, [folder, ...].

    A folder has files such as level-up-peak-1.csv, or a folder level-up-peak with the files of its trials; the shapes
    are level-up-peak.toml beside them, or built-in ones. Points are x_mm and y_mm in the display's frame; in
    photographs the rod is traced. With a `display`, by name, file or `Display`, the shapes are taken to be of that
    instead of their own: of one that was calibrated since. InvalidInput for what cannot be read; MissingExtra for
    photographs without OpenCV.
    """
    given = files_of(what)
    asked = photographed or Photographed()
    asked = replace(asked, camera=asked.camera or camera_in(what))
    if asked.overlays is not None:
        _check_folder(asked.overlays)
    other = given_display(display) if isinstance(display, str | os.PathLike) else display
    total = sum(len(each.files) for each in given)
    found, done = [], 0
    listener.computing()
    with listener.progress("reading trials", total) as heard:
        for each in given:
            scene, trials = _of(other, read_shape(each.shape)), []
            for path in each.files:
                trials.append(_read(path, scene, asked))
                heard(done := done + 1)
            found.append(ShapeTrials(scene, tuple(trials)))
    return tuple(found)


def _of(display: Display | None, scene: Scene) -> Scene:
    """The shape on another display; InvalidInput if that is none that could show it."""
    if display is None:
        return scene
    own = scene.display
    if (display.node_count, display.span) != (own.node_count, own.span):
        hint = "name a display file that was made from the one of the shape"
        raise InvalidInput(f"display {display.name} has other nodes or another span than {scene.name} is for", hint)
    return replace(scene, display=display)


def _read(path: str, scene: Scene, asked: Photographed) -> Trial:
    if not is_photograph(path):
        return read_table(path, scene)
    if asked.camera is None:
        hint = "name the camera file with --camera; `curveline camera calibrate` makes one"
        raise InvalidInput(f"{path}: it is not known with which camera this photograph was taken", hint)
    return trial_in(path, scene, camera_use(asked.camera, scene.display, asked.overlays))


def _check_folder(folder: AnyPath) -> None:
    """InvalidInput unless drawings can be put into a folder; it is made if it is not there."""
    name = os.fspath(folder)
    try:
        os.makedirs(name, exist_ok=True)
    except (OSError, ValueError) as error:
        said = getattr(error, "strerror", None) or str(error)
        raise InvalidInput(f"{name}: no folder for drawings: {said}", "name another one") from None

"""curveline: simulate, plan and drive shape displays made of flexible rods.

Importing this package is cheap; the names below load what they need when first used.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from curveline._version import __version__

if TYPE_CHECKING:
    from curveline.api import after as after
    from curveline.api import calibrate_rod as calibrate_rod
    from curveline.api import calibrate_set as calibrate_set
    from curveline.api import check_display as check_display
    from curveline.api import fall as fall
    from curveline.api import load as load
    from curveline.api import load_map as load_map
    from curveline.api import log as log
    from curveline.api import monte_carlo as monte_carlo
    from curveline.api import plan as plan
    from curveline.api import rod_now as rod_now
    from curveline.api import runs as runs
    from curveline.api import simulate as simulate
    from curveline.api import simulate_poses as simulate_poses
    from curveline.api import status as status
    from curveline.api import stop as stop
    from curveline.api import sweep as sweep
    from curveline.atlases.atlas import atlas as atlas
    from curveline.atlases.atlas import stable_curves as stable_curves
    from curveline.atlases.grid import AtlasRequest as AtlasRequest
    from curveline.bench.comparison import compare_bench as compare_bench
    from curveline.bench.history import keep_bench as keep_bench
    from curveline.bench.history import read_bench as read_bench
    from curveline.bench.measuring import measure as measure
    from curveline.bench.measuring import measure_link as measure_link
    from curveline.calibrating.droop import Droop as Droop
    from curveline.calibrating.request import CalibrationRequest as CalibrationRequest
    from curveline.cameras.board_files import write_board as write_board
    from curveline.cameras.board_files import write_lens as write_lens
    from curveline.cameras.boards import camera_board as camera_board
    from curveline.cameras.camera_file import read_camera as read_camera
    from curveline.cameras.lens_calibration import calibrate_lens as calibrate_lens
    from curveline.cameras.photographs import read_photograph as read_photograph
    from curveline.cameras.pose import view_of as view_of
    from curveline.comparing.agreement import CompareRequest as CompareRequest
    from curveline.comparing.compare import compare as compare
    from curveline.comparing.reading import Photographed as Photographed
    from curveline.comparing.reading import read_trials as read_trials
    from curveline.drawings.drawing import Drawing as Drawing
    from curveline.drawings.formulas import drawing_of_formula as drawing_of_formula
    from curveline.drawings.placing import Placing as Placing
    from curveline.drawings.reading import read_drawing as read_drawing
    from curveline.drawings.sketch import HowToRead as HowToRead
    from curveline.driving.frame_log import FrameWish as FrameWish
    from curveline.driving.frame_log import overhear as overhear
    from curveline.driving.lines.from_python import dry_run_lines as dry_run_lines
    from curveline.driving.lines.from_python import home_lines as home_lines
    from curveline.driving.lines.from_python import resume_lines as resume_lines
    from curveline.driving.lines.from_python import send_lines as send_lines
    from curveline.driving.looking.verified import VerifyRequest as VerifyRequest
    from curveline.driving.looking.verified import send_verified as send_verified
    from curveline.driving.looking.watching import WatchRequest as WatchRequest
    from curveline.driving.looking.watching import watch as watch
    from curveline.driving.new_settings import Formerly as Formerly
    from curveline.driving.run_listener import RunListener as RunListener
    from curveline.driving.session import connect as connect
    from curveline.driving.site_keys import new_keys as new_keys
    from curveline.driving.site_keys import node_image as node_image
    from curveline.driving.site_keys import read_keys as read_keys
    from curveline.errors import CurvelineError as CurvelineError
    from curveline.fitting.fewest import FewestNodes as FewestNodes
    from curveline.fitting.fewest import fit_fewest as fit_fewest
    from curveline.fitting.fit import FitRequest as FitRequest
    from curveline.fitting.targets import fit as fit
    from curveline.fitting.targets import placed_on as placed_on
    from curveline.listening import Listener as Listener
    from curveline.loading.pushes import Push as Push
    from curveline.material.drum_readings import DrumReading as DrumReading
    from curveline.material.history import Dwell as Dwell
    from curveline.notebook_listener import NotebookListener as NotebookListener
    from curveline.plan_file import read_plan as read_plan
    from curveline.radio.host.actions import Policy as Policy
    from curveline.radio.host.link import Control as Control
    from curveline.radio.host.link import OperatorRequest as OperatorRequest
    from curveline.replay.monte_carlo import Errors as Errors
    from curveline.replay.trials import TrialsRequest as TrialsRequest
    from curveline.scene import DisplayErrors as DisplayErrors
    from curveline.scene import Load as Load
    from curveline.scene import Node as Node
    from curveline.scene import Range as Range
    from curveline.scene import Scene as Scene
    from curveline.scene import Segment as Segment
    from curveline.shapes.files import builtin_displays as builtin_displays
    from curveline.shapes.files import builtin_text as builtin_text
    from curveline.shapes.files import read_display as read_display
    from curveline.shapes.files import read_shape as read_shape
    from curveline.shapes.library import builtin_shapes as builtin_shapes
    from curveline.shapes.new_files import new_display as new_display
    from curveline.shapes.new_files import new_shape as new_shape
    from curveline.simulation.explanation import explain as explain
    from curveline.simulation.results import Settings as Settings
    from curveline.simulation.shape_batch import simulate_many as simulate_many
    from curveline.surfaces.fit_surface import SurfaceRequest as SurfaceRequest
    from curveline.surfaces.fit_surface import surface as surface
    from curveline.surfaces.how_to_read import HowToReadSurface as HowToReadSurface
    from curveline.surfaces.laying import Laying as Laying
    from curveline.surfaces.reading import read_surface as read_surface
    from curveline.surfaces.reading import surface_of_formula as surface_of_formula
    from curveline.writing import write as write
    from curveline.writing import write_surface as write_surface

_HOMES = {
    "simulate": "api",
    "after": "api",
    "simulate_poses": "api",
    "simulate_many": "simulation.shape_batch",
    "explain": "simulation.explanation",
    **dict.fromkeys(("sweep", "plan", "monte_carlo", "load", "load_map", "fall"), "api"),
    **dict.fromkeys(("fit", "placed_on"), "fitting.targets"),
    "FitRequest": "fitting.fit",
    **dict.fromkeys(("fit_fewest", "FewestNodes"), "fitting.fewest"),
    "read_drawing": "drawings.reading",
    "HowToRead": "drawings.sketch",
    "Placing": "drawings.placing",
    "Drawing": "drawings.drawing",
    "drawing_of_formula": "drawings.formulas",
    **dict.fromkeys(("atlas", "stable_curves"), "atlases.atlas"),
    "AtlasRequest": "atlases.grid",
    **dict.fromkeys(("surface", "SurfaceRequest"), "surfaces.fit_surface"),
    **dict.fromkeys(("read_surface", "surface_of_formula"), "surfaces.reading"),
    "HowToReadSurface": "surfaces.how_to_read",
    "Laying": "surfaces.laying",
    "write_surface": "writing",
    "CalibrationRequest": "calibrating.request",
    "Droop": "calibrating.droop",
    "read_trials": "comparing.reading",
    "compare": "comparing.compare",
    "CompareRequest": "comparing.agreement",
    "Photographed": "comparing.reading",
    "check_display": "api",
    **dict.fromkeys(("calibrate_rod", "calibrate_set"), "api"),
    **dict.fromkeys(("measure", "measure_link"), "bench.measuring"),
    **dict.fromkeys(("keep_bench", "read_bench"), "bench.history"),
    "compare_bench": "bench.comparison",
    **dict.fromkeys(("write_board", "write_lens"), "cameras.board_files"),
    "camera_board": "cameras.boards",
    "calibrate_lens": "cameras.lens_calibration",
    "read_camera": "cameras.camera_file",
    "read_photograph": "cameras.photographs",
    "view_of": "cameras.pose",
    "connect": "driving.session",
    **dict.fromkeys(("send_verified", "VerifyRequest"), "driving.looking.verified"),
    **dict.fromkeys(("watch", "WatchRequest"), "driving.looking.watching"),
    **dict.fromkeys(("overhear", "FrameWish"), "driving.frame_log"),
    **dict.fromkeys(("send_lines", "home_lines", "resume_lines", "dry_run_lines"), "driving.lines.from_python"),
    **dict.fromkeys(("status", "stop", "rod_now", "runs", "log"), "api"),
    "write": "writing",
    "write_calibration": "driving.node_calibration",
    "Formerly": "driving.new_settings",
    **dict.fromkeys(("new_keys", "read_keys", "node_image"), "driving.site_keys"),
    "read_shape": "shapes.files",
    "read_display": "shapes.files",
    "read_plan": "plan_file",
    "builtin_shapes": "shapes.library",
    "builtin_displays": "shapes.files",
    "builtin_text": "shapes.files",
    "new_shape": "shapes.new_files",
    "new_display": "shapes.new_files",
    **dict.fromkeys(("Scene", "Node", "Segment", "Load"), "scene"),
    "Settings": "simulation.results",
    "Push": "loading.pushes",
    "DrumReading": "material.drum_readings",
    "Dwell": "material.history",
    "TrialsRequest": "replay.trials",
    "Errors": "replay.monte_carlo",
    **dict.fromkeys(("DisplayErrors", "Range"), "scene"),
    "Control": "radio.host.link",
    "OperatorRequest": "radio.host.link",
    "Policy": "radio.host.actions",
    "Listener": "listening",
    "RunListener": "driving.run_listener",
    "NotebookListener": "notebook_listener",
    "CurvelineError": "errors",
}
"""Public name -> the module in which it lives, in the order in which the page of the library has them."""

__all__ = ["__version__", *_HOMES]


def __getattr__(name: str) -> Any:
    if name not in _HOMES:
        raise AttributeError(f"module 'curveline' has no attribute {name!r}")
    from importlib import import_module

    return getattr(import_module(f"curveline.{_HOMES[name]}"), name)


def __dir__() -> list[str]:
    return sorted(__all__)

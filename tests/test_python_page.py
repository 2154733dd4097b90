"""docs/from-python.md: every command and every option is in it, and every call that it names can be made."""

from __future__ import annotations

import ast
import inspect
import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import api_reference
import command_reference
import pytest

import curveline
from curveline.atlases.atlas import Atlas
from curveline.atlases.curves import StableCurves
from curveline.bench.report import BenchReport
from curveline.calibrating.calibrated import RodCalibration
from curveline.calibrating.step_response import Tuning
from curveline.cameras.boards import CameraBoard
from curveline.cameras.lens_calibration import LensCalibration
from curveline.comparing.agreement import Comparison
from curveline.displays.check import DisplayCheck
from curveline.driving.adoption import Adoption
from curveline.driving.frame_log import HeardFrame
from curveline.driving.logbook import RunLog
from curveline.driving.looking.verified import VerifiedTour
from curveline.driving.new_settings import SettingsChange
from curveline.driving.node_calibration import Calibration
from curveline.driving.one_node import OneNode
from curveline.driving.run_result import RunResult
from curveline.driving.runs import Run
from curveline.driving.session import Session
from curveline.fitting.fit import Fit
from curveline.loading.snap_through import Loading
from curveline.material.drum_fit import SetFit
from curveline.plan_file import Plan
from curveline.radio.measuring.channels import ChannelScan
from curveline.radio.measuring.reach import RangeTest
from curveline.radio.site.key_file import SiteFile
from curveline.replay.trials import Trials
from curveline.rod.states.equilibrium import Equilibrium
from curveline.simulation.results import ShapeReport
from curveline.simulation.shape_batch import ShapeAnswer, ShapeBatch
from curveline.simulation.simulate import SegmentStates
from curveline.simulation.sweep_report import SweepReport
from curveline.surfaces.fit_surface import FittedSurface

PAGE = Path(__file__).parents[1] / "docs" / "from-python.md"
TEXT = PAGE.read_text()
SHARED = "Options of many commands"
STANDS_FOR: dict[str, Any] = {
    "adoption": Adoption,
    "answer": ShapeAnswer,
    "atlas": Atlas,
    "batch": ShapeBatch,
    "bench": BenchReport,
    "board": CameraBoard,
    "calibration": RodCalibration,
    "gear": Calibration,
    "change": SettingsChange,
    "checked": DisplayCheck,
    "comparison": Comparison,
    "control": curveline.Control,
    "curveline": curveline,
    "curves": StableCurves,
    "fit": SetFit,
    "found": Fit,
    "heard": RangeTest,
    "keys": SiteFile,
    "lens": LensCalibration,
    "loading": Loading,
    "log": RunLog,
    "node": OneNode,
    "passed": HeardFrame,
    "plan": Plan,
    "quiet": ChannelScan,
    "report": ShapeReport,
    "result": RunResult,
    "run": Run,
    "segment": SegmentStates,
    "session": Session,
    "state": Equilibrium,
    "surface": FittedSurface,
    "sweep": SweepReport,
    "tour": VerifiedTour,
    "trials": Trials,
    "tuning": Tuning,
}
"""What the names on the page stand for."""
COMMANDS = dict(command_reference.commands())
CALL = re.compile(r"`((?:[a-z]+)\.[^`]+|help\([^`]*\))`")
INTERNAL = {"CurvelineError", "Listener", "NotebookListener", "RunListener", "Scene", "Node", "Segment", "Load"}
"""Public names that are in no command: what is told and thrown, and what a shape file says."""


def section(title: str) -> str:
    """What stands under a heading."""
    found = re.search(rf"^## {re.escape(title)}\n(.*?)(?=^## |\Z)", TEXT, re.MULTILINE | re.DOTALL)
    assert found, title
    return found[1]


def options_in(text: str) -> set[str]:
    """The options in the first cells of the tables of a text."""
    cells = [line.split("|")[1] for line in text.splitlines() if line.startswith("| ")]
    return {option for cell in cells for option in re.findall(r"`(--[\w-]+)`", cell)}


@pytest.mark.parametrize("name", COMMANDS)
def test_every_command_and_option_has_a_call(name: str) -> None:
    own = options_in(section(name))
    wanted = {option for option in command_reference.options(COMMANDS[name]) if option.startswith("--")}
    assert own <= wanted, own - wanted
    assert wanted <= own | options_in(section(SHARED)), wanted - own
    if not hasattr(COMMANDS[name], "commands") or name == "curveline runs":
        assert CALL.search(section(name)), name


def test_every_heading_is_a_command() -> None:
    assert set(re.findall(r"^## (.*)$", TEXT, re.MULTILINE)) == {*COMMANDS, SHARED, "An example"}


def calls() -> Iterator[ast.expr]:
    """What is named on the page as code that begins with one of the names, each expression by itself."""
    for text in CALL.findall(TEXT):
        if text.split(".")[0] in STANDS_FOR and not text.endswith((".json", ".toml", ".py")):
            tree = ast.parse(text, mode="eval").body
            yield from (node for node in ast.walk(tree) if isinstance(node, ast.Call | ast.Attribute))


def known(node: ast.expr) -> Any:
    """What an expression is on the class of its name, or None where that cannot be told; AttributeError if nothing."""
    if isinstance(node, ast.Name):
        return STANDS_FOR[node.id]
    if not isinstance(node, ast.Attribute):
        return None
    owner = known(node.value)
    if owner is None or node.attr in fields_of(owner):
        return None
    found = getattr(owner, node.attr)
    return None if isinstance(found, property) else found


def fields_of(owner: Any) -> set[str]:
    return {name for name, _, _ in api_reference.fields(owner)} if isinstance(owner, type) else set()


def test_every_call_that_is_named_can_be_made() -> None:
    seen = 0
    for node in calls():
        seen += 1
        found = known(node.func if isinstance(node, ast.Call) else node)
        if isinstance(node, ast.Call) and found is not None:
            method = inspect.isfunction(found) and found.__qualname__ != found.__name__
            given = [...] * (len(node.args) + method)
            inspect.signature(found).bind(*given, **{each.arg: ... for each in node.keywords if each.arg})
    assert seen > 80


def test_what_is_not_there_is_noticed() -> None:
    with pytest.raises(AttributeError):
        known(ast.parse("session.sendd", mode="eval").body)
    with pytest.raises(AttributeError):
        known(ast.parse("curveline.simulated", mode="eval").body)


def test_every_public_name_is_in_it() -> None:
    named = set(re.findall(r"curveline\.(\w+)", TEXT))
    assert {name for name in curveline.__all__ if name != "__version__"} - named <= INTERNAL

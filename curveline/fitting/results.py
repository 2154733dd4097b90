"""What a fit found, as JSON and as a shape file: mm, degrees, and what it was made from."""

from __future__ import annotations

import json
import os
from collections.abc import Iterator

from curveline._version import __version__
from curveline.drawings.drawing import Drawing
from curveline.fitting.fit import Fit, Sensitivity
from curveline.fitting.reasons import ActiveLimit
from curveline.phrases import counted, wrapped
from curveline.rod.problem import Array
from curveline.scene import Node, Segment
from curveline.shapes.new_files import display_named_in
from curveline.shapes.templates import check_new_shape
from curveline.simulation.results import Document, provenance
from curveline.system.files import AnyPath, printable
from curveline.units import deg, plain, to_deg, to_mm

DIGITS = 4
"""Behind the point, of numbers in mm and degrees."""


def document(found: Fit, argv: tuple[str, ...] = ()) -> Document:
    """What `curveline fit --json` prints; plain Python types only."""
    scene, plan, request = found.scene, found.plan, found.request
    asked = {name: getattr(request, name) for name in ("margin", "minimise", "effort", "seed")}
    return {
        "curveline": __version__,
        "shape": scene.name,
        "display": scene.display.name,
        "target": _target(found.drawing),
        "nodes": [_node(node) for node in scene.nodes],
        "segments": [{"length_mm": _length(each), "state": each.state} for each in scene.segments],
        "distance": _distance(found),
        "least_possible_mm": to_mm(found.least_possible.rms),
        "least_possible_max_mm": to_mm(found.least_possible.max),
        "margin": found.margin,
        "limits": [_limit(each) for each in found.limits],
        "global": {
            "starts": found.starts,
            "hits": found.hits,
            "second_best_mm": None if found.second_best is None else to_mm(found.second_best),
            "without_plan_mm": None if found.without_plan is None else to_mm(found.without_plan),
        },
        "sensitivity": _sensitivity(found.sensitivity),
        "plan": None if plan is None else {"steps": len(plan.steps), "seconds": plan.seconds},
        "refusal": found.refusal or None,
        "curve_mm": [_points(curve) for curve in found.curves],
        "target_mm": [_points(piece) for piece in found.drawn],
        "seconds": found.seconds,
        "provenance": provenance(scene, asked, argv),
    }


def _target(drawing: Drawing) -> Document:
    return {"name": drawing.name, "understood": drawing.understood, "points": int(drawing.points.shape[0])}


def _distance(found: Fit) -> Document:
    worst = [{"x_mm": to_mm(at.x), "y_mm": to_mm(at.y), "mm": to_mm(at.off), "why": at.why} for at in found.worst]
    return {"rms_mm": to_mm(found.rms), "max_mm": to_mm(found.max), "worst": worst}


def _sensitivity(sense: Sensitivity) -> Document:
    return {
        "mm_per_mm_of_feed": sense.feed,
        "mm_per_deg": to_mm(sense.angle) * deg(1.0),
        "mm_per_mm_of_height": sense.height,
    }


def _node(node: Node) -> Document:
    return {"height_mm": _tidy(to_mm(node.height)), "angle_deg": _tidy(to_deg(node.angle))}


def _length(segment: Segment) -> float:
    return _tidy(to_mm(segment.length))


def _tidy(value: float) -> float:
    """A number of a shape file, without what conversions leave behind its digits."""
    return round(value, DIGITS) + 0.0


def _limit(limit: ActiveLimit) -> Document:
    return {
        "name": limit.name,
        "value": limit.value,
        "nodes": list(limit.nodes),
        "segments": list(limit.segments),
        "costs_mm": None if limit.costs is None else to_mm(limit.costs),
    }


def _points(curve: Array) -> list[list[float]]:
    return [[round(to_mm(x), DIGITS), round(to_mm(y), DIGITS)] for x, y in curve.tolist()]


def to_json(found: Fit, path: AnyPath = "", argv: tuple[str, ...] = ()) -> bytes:
    """The document as one line, wherever it goes."""
    return (json.dumps(document(found, argv), allow_nan=False) + "\n").encode()


def to_shape(found: Fit, path: AnyPath = "", argv: tuple[str, ...] = ()) -> bytes:
    """The shape file, for a path: what it is and how well it fits in comments, then the shape.

    InvalidInput for a display that a shape file cannot name.
    """
    folder = os.path.dirname(os.fspath(path))
    scene = found.scene
    lines = [f"# {line}" for line in _said(found)]
    lines += [f"name = {json.dumps(scene.name)}", f"display = {json.dumps(display_named_in(folder, scene.display))}"]
    lines += ["nodes = ["]
    for node in map(_node, scene.nodes):
        height, angle = (plain(node[key]) for key in ("height_mm", "angle_deg"))
        lines.append(f"  {{ height_mm = {height}, angle_deg = {angle} }},")
    lines += ["]", "segments = ["]
    lines += [
        f"  {{ length_mm = {plain(_length(each))}, state = {json.dumps(each.state)} }}," for each in scene.segments
    ]
    text = "\n".join([*lines, "]", ""])
    check_new_shape(text, folder)
    return text.encode()


def _said(found: Fit) -> Iterator[str]:
    """Lines of what a fitted shape is, each short enough for a comment."""
    worst, drawing = found.worst[0], found.drawing
    best = "best" if found.without_plan is None else "nearest with a plan"
    sentences = [
        f"Fitted by curveline fit to {printable(drawing.name)}, {printable(drawing.understood) or 'points'}.",
        f"Its curve is {to_mm(found.rms):.3g} mm RMS off the drawing, {to_mm(found.max):.3g} mm at most. The drawing "
        f"is {to_mm(worst.off):.3g} mm off it at x = {to_mm(worst.x):.4g} mm: {worst.why}.",
        f"The {best} of {counted(found.starts, 'start')}, of which {found.hits} led to it; that is no proof of "
        "the best there is.",
    ]
    if found.plan is not None:
        sentences.append(f"It has a plan of {counted(len(found.plan.steps), 'step')} from home.")
    elif found.refusal:
        sentences.append(f"It has no plan from home: {printable(found.refusal)}.")
    for sentence in sentences:
        yield from wrapped(sentence, width=76, hang=0)

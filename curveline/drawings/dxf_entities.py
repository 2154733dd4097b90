"""The entities of DXF as points: lines, polylines with bulges, arcs, circles, ellipses, splines."""

from __future__ import annotations

import math
from itertools import pairwise
from typing import Any

import numpy as np

from curveline.drawings.drawing import MOST_POINTS, Array
from curveline.drawings.flattening import MOST, flat_conic
from curveline.drawings.sketch import OF_WIDTH

STRAIGHT = 1e-9
"""A bulge that makes an arc of no height: its middle would be so far away that places are lost."""
FULL_TURN = 2.0 * math.pi
SPLINE_FRAME = 16
"""Flag of a vertex that steers a polyline which was made a spline, and is not on it."""


def points_of(entity: Any, error: float) -> Array | None:
    """Points (k, 3) in the drawing's coordinates of an entity; None for a kind that is no line in a plane.

    `error` is in units of the file, 0 for a part of the size of each curve.
    """
    kind = entity.dxftype()
    if kind == "LINE":
        return np.array([_xyz(entity.dxf.start), _xyz(entity.dxf.end)])
    if kind == "LWPOLYLINE":
        rows = np.array(entity.get_points("xyb"), dtype=np.float64).reshape(-1, 3)
        flat = _bulged(rows, error, is_closed=bool(entity.closed))
        return _turned(entity, flat, float(entity.dxf.elevation))
    if kind == "POLYLINE":
        return _polyline(entity, error)
    if kind in ("ARC", "CIRCLE"):
        return _arc(entity, error)
    if kind == "ELLIPSE":
        return _ellipse(entity, error)
    if kind == "SPLINE":
        return _spline(entity.construction_tool(), error)
    return None


def _xyz(vector: Any) -> Array:
    return np.array([float(vector.x), float(vector.y), float(vector.z)])


def _turned(entity: Any, flat: Array, elevation: float) -> Array:
    """Points of the plane of an entity in the drawing's coordinates: mirrored ones lie in a plane seen from behind."""
    system = entity.ocs()
    axes = np.array([_xyz(each) for each in (system.ux, system.uy, system.uz)])
    points: Array = np.column_stack([flat, np.full(len(flat), elevation)]) @ axes
    return points


def _bulged(rows: Array, error: float, *, is_closed: bool) -> Array:
    """Points (k, 2) of a polyline whose rows are x, y and the bulge of the arc to the next: tan(angle / 4)."""
    if is_closed and len(rows):
        rows = np.vstack([rows, rows[:1]])
    parts, count = [rows[:1, :2]], 0
    for here, there in pairwise(rows):
        bulge = float(here[2])
        chord = there[:2] - here[:2]
        if abs(bulge) < STRAIGHT or not np.any(chord):
            parts.append(there[None, :2])
            continue
        left = np.array([-chord[1], chord[0]])
        center = 0.5 * (here[:2] + there[:2]) + left * (1.0 - bulge**2) / (4.0 * bulge)
        arm = here[:2] - center
        axes = np.array([arm, [-arm[1], arm[0]]])
        arc = flat_conic(center, axes, (0.0, 4.0 * math.atan(bulge)), error)[1:]
        arc[-1] = there[:2]
        parts.append(arc)
        count += len(arc)
        if count > MOST_POINTS:
            raise ValueError(f"it takes more than {MOST_POINTS} points")
    return np.vstack(parts)


def _polyline(entity: Any, error: float) -> Array | None:
    vertices = [each for each in entity.vertices if not int(each.dxf.get("flags", 0)) & SPLINE_FRAME]
    places = [_xyz(each.dxf.location) for each in vertices]
    if not places:
        return np.zeros((0, 3))
    if entity.is_3d_polyline:
        return np.array([*places, *places[:1]] if entity.is_closed else places)
    if not entity.is_2d_polyline:
        return None
    bulges = [float(each.dxf.get("bulge", 0.0)) for each in vertices]
    rows = np.array([[place[0], place[1], bulge] for place, bulge in zip(places, bulges, strict=True)])
    return _turned(entity, _bulged(rows, error, is_closed=bool(entity.is_closed)), float(places[0][2]))


def _arc(entity: Any, error: float) -> Array:
    center, radius = _xyz(entity.dxf.center), float(entity.dxf.radius)
    begin, end = 0.0, FULL_TURN
    if entity.dxftype() == "ARC":
        begin, end = (FULL_TURN * float(angle) / 360.0 for angle in (entity.dxf.start_angle, entity.dxf.end_angle))
        end = begin + (end - begin) % FULL_TURN or FULL_TURN
    flat = flat_conic(center[:2], np.diag([radius, radius]), (begin, end), error)
    return _turned(entity, flat, float(center[2]))


def _ellipse(entity: Any, error: float) -> Array:
    center, major, minor = (_xyz(each) for each in (entity.dxf.center, entity.dxf.major_axis, entity.minor_axis))
    begin, end = float(entity.dxf.start_param), float(entity.dxf.end_param)
    end = begin + ((end - begin) % FULL_TURN or FULL_TURN)
    return flat_conic(center, np.array([major, minor]), (begin, end), error)


def _spline(curve: Any, error: float) -> Array:
    """Points of a B-spline: between two knots so many that its second derivative cannot take it farther away.

    A spline and its derivatives lie within their control points (Piegl and Tiller, The NURBS Book, 3.3). One with
    weights is A / w, both of them splines, and C'' = (A'' - 2 w' C' - w'' C) / w (there, 4.8). ValueError for one that
    is damaged, or would take too many points.
    """
    control = np.array([_xyz(each) for each in curve.control_points])
    weights = np.array(curve.weights() or [1.0] * len(control), dtype=np.float64)
    knots, degree = np.array(curve.knots(), dtype=np.float64), int(curve.degree)
    if not (np.isfinite(control).all() and np.isfinite(knots).all() and (weights > 0.0).all() and degree > 0):
        raise ValueError("a number of it is none")
    allowed = error or OF_WIDTH * float(np.max(np.ptp(control, axis=0)))
    if not allowed > 0.0:
        return control
    weights = weights / weights.min()
    lifted = np.column_stack([weights[:, None] * (control - control.mean(axis=0)), weights])
    slopes = _derivative(lifted, knots, degree)
    bends = _derivative(slopes, knots[1:-1], degree - 1)
    far = float(np.linalg.norm(control - control.mean(axis=0), axis=1).max())
    at, total = [knots[degree : degree + 1]], 0
    for k in range(degree, len(control)):
        wide = float(knots[k + 1] - knots[k])
        if wide > 0.0:
            slope, turn = _most(slopes[k - degree : k]), _most(bends[k - degree : k - 1])
            bend = turn[0] + turn[1] * far + 2.0 * slope[1] * (slope[0] + slope[1] * far)
            count = max(1.0, wide * math.sqrt(bend / (8.0 * allowed)))
            if not count < MOST:
                raise ValueError("it bends more sharply than a rod could")
            total += math.ceil(count)
            if total > MOST_POINTS:
                raise ValueError(f"it takes more than {MOST_POINTS} points")
            at.append(np.linspace(knots[k], knots[k + 1], math.ceil(count) + 1)[1:])
    return np.array([_xyz(each) for each in curve.points(np.concatenate(at))])


def _derivative(control: Array, knots: Array, degree: int) -> Array:
    """The control points of a spline's derivative, whose knots are the same without the outermost."""
    if degree < 1:
        return np.zeros((0, control.shape[1]))
    spans = (knots[degree + 1 : degree + len(control)] - knots[1 : len(control)])[:, None]
    steps = degree * np.diff(control, axis=0)
    return np.divide(steps, spans, out=np.zeros_like(steps), where=spans > 0.0)


def _most(control: Array) -> tuple[float, float]:
    """How large a spline of these control points can be, and how large its weight."""
    if not len(control):
        return 0.0, 0.0
    return float(np.linalg.norm(control[:, :-1], axis=1).max()), float(np.abs(control[:, -1]).max())

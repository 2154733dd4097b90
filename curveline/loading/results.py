"""What pushing a shape showed, as JSON and as figures: mm, N and N/mm, with what it was made from."""

from __future__ import annotations

import json
import math
from collections.abc import Sequence

from curveline._version import __version__
from curveline.loading.load_map import LoadMap, MapPoint
from curveline.loading.pushes import Push, Stand
from curveline.loading.snap_through import Landing, Loading
from curveline.rod.states.equilibrium import Equilibrium
from curveline.scene import Scene
from curveline.simulation.results import Document, provenance
from curveline.units import to_mm, to_n_per_mm

CURVE_POINTS = 201
EITHER = "|"
"""Between the names of states where the rod may land in either."""


def document(loading: Loading) -> Document:
    """What `curveline load --json` prints; plain Python types only."""
    snap, stand = loading.snap, loading.stand
    asked = {**_asked(loading.push), "at": loading.push.at, "step_N": loading.push.step}
    return {
        **_head(loading.scene, loading.push, stand.state),
        "at": loading.push.at,
        "place_mm": [to_mm(part) for part in stand.seen(stand.place(stand.state))],
        "direction_xy": list(stand.toward),
        "seconds": loading.seconds,
        "stiffness_N_per_mm": None if loading.stiffness is None else to_n_per_mm(loading.stiffness),
        "snap_through_N": None if snap is None else snap.force,
        "snap_through_error_N": None if snap is None else _known(snap.error),
        "kind": None if snap is None else snap.kind,
        "lands_in": _landing(loading, "name"),
        "released_in": _landing(loading, "released"),
        "ways": [] if snap is None else [{"lands_in": way.name, "released_in": way.released} for way in snap.landings],
        "leaves_plane_N": loading.leaves_plane,
        "curve": _pairs(loading.rows),
        "curve_error_mm": to_mm(loading.error),
        "branch": [[point.force, to_mm(point.deflection), point.unstable] for point in loading.branch],
        "unloaded_mm": curve_mm(stand, stand.state),
        "loaded_mm": curve_mm(stand, loading.last),
        "landed_mm": [] if snap is None else [curve_mm(stand, way.state) for way in snap.landings if way.state],
        "provenance": provenance(loading.scene, asked, loading.push.argv),
    }


def map_document(found: LoadMap) -> Document:
    """What `curveline load --map --json` prints; plain Python types only."""
    return {
        **_head(found.scene, found.push, found.stand.state),
        "seconds": found.seconds,
        "points": [_point(point) for point in found.points],
        "weakest": None if found.weakest is None else _point(found.weakest),
        "withstands": [
            {
                "force_N": verdict.force,
                "everywhere": verdict.everywhere,
                "yields_between": [list(stretch) for stretch in verdict.stretches],
            }
            for verdict in found.verdicts
        ],
        "unloaded_mm": curve_mm(found.stand, found.stand.state),
        "provenance": provenance(found.scene, {**_asked(found.push), "points": len(found.points)}, found.push.argv),
    }


def either(landings: Sequence[Landing], what: str) -> str:
    """The names of the states that the rod may land in: "name" under the load, "released" without it."""
    return EITHER.join(dict.fromkeys(getattr(landing, what) for landing in landings))


def _landing(loading: Loading, what: str) -> str | None:
    """These names, None where nothing is known to snap."""
    return either(loading.snap.landings, what) if loading.snap and loading.snap.landings else None


def curve_mm(stand: Stand, state: Equilibrium) -> list[list[float]]:
    """The curve of a state in the display's frame, pivot to pivot, rows of x and y [mm]."""
    return [[to_mm(x), to_mm(y)] for x, y in map(stand.seen, state.curve(CURVE_POINTS).tolist())]


def _head(scene: Scene, push: Push, state: Equilibrium) -> Document:
    return {
        "curveline": __version__,
        "shape": scene.name,
        "segment": push.segment + 1,
        "state": state.name,
        "model": state.model,
        "direction": push.direction,
        "most_N": push.most,
    }


def _asked(push: Push) -> Document:
    return {
        "segment": push.segment + 1,
        "direction": push.direction,
        "most_N": push.most,
        "state": push.state or None,
        "model": push.model,
    }


def _known(value: float) -> float | None:
    """A number for JSON, which knows no infinity: None for what is not known."""
    return value if math.isfinite(value) else None


def _pairs(rows: Sequence[tuple[float, float]]) -> list[list[float]]:
    return [[force, to_mm(deflection)] for force, deflection in rows]


def _point(point: MapPoint) -> Document:
    return {
        "at": point.at,
        "place_mm": [to_mm(point.x), to_mm(point.y)],
        "snap_through_N": point.force,
        "snap_through_error_N": None if point.force is None else _known(point.error),
        "kind": point.kind or None,
        "leaves_plane_N": point.leaves_plane,
    }


def to_json(found: Loading | LoadMap) -> bytes:
    """The document as one line."""
    made = document(found) if isinstance(found, Loading) else map_document(found)
    return (json.dumps(made, allow_nan=False) + "\n").encode()

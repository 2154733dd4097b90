"""What was fitted to a surface, as JSON: mm, amperes, seconds, and what it was made from."""

from __future__ import annotations

import json
from typing import Any

from curveline._version import __version__
from curveline.fitting.results import document as fit_document
from curveline.simulation.results import Document
from curveline.surfaces.budget import STALL_A, STALL_SOURCE, SurfaceBudget
from curveline.surfaces.fit_surface import FittedLine, FittedSurface
from curveline.surfaces.neighbours import Neighbours
from curveline.system.files import AnyPath
from curveline.units import to_mm

OF_LINES = ("shape", "display", "nodes", "segments", "distance", "least_possible_mm", "margin", "plan", "refusal")
"""What the document of a line has of that of a fit."""


def document(found: FittedSurface) -> Document:
    """What `surface.json` has; plain Python types only, the same whenever and by however many processes it is made."""
    laying, request = found.request.laying, found.request.fit
    return {
        "curveline": __version__,
        "surface": {"name": found.name, "understood": found.understood},
        "display": {"name": found.display.name, "sha256": found.display.digest},
        "asked": {
            "lines": laying.lines,
            "pitch_mm": to_mm(laying.pitch),
            "scale": laying.scale or None,
            "shift_mm": laying.shift_mm,
            "depth_from_mm": laying.depth_from_mm,
            **{name: getattr(request, name) for name in ("margin", "minimise", "effort", "seed")},
        },
        "distance": {"rms_mm": _largest(found, "rms"), "max_mm": _largest(found, "max")},
        "lines": [_line(line) for line in found.lines],
        "across": [_across(pair) for pair in found.across],
        "budget": _budget(found.budget),
    }


def _largest(found: FittedSurface, which: str) -> float:
    return to_mm(max(getattr(line.fit, which) for line in found.lines))


def _line(line: FittedLine) -> Document:
    whole = fit_document(line.fit)
    return {"line": line.number, "y_mm": to_mm(line.y), **{name: whole[name] for name in OF_LINES}}


def _across(pair: Neighbours) -> Document:
    return {
        "lines": [pair.line, pair.line + 1],
        "rms_mm": to_mm(pair.rms),
        "max_mm": to_mm(pair.max),
        "x_mm": to_mm(pair.x),
    }


def _budget(budget: SurfaceBudget) -> Document:
    return {
        "rod_m": budget.rod,
        "rod_to_have_m": budget.rod_to_have,
        "nodes": budget.nodes,
        "motors": budget.motors,
        "current_A_per_motor": budget.current_per_motor,
        "current_from": STALL_SOURCE if budget.current_per_motor == STALL_A else "as given",
        "current_A_per_line": budget.current_per_line,
        "current_A": budget.current,
        "polls_per_s": budget.polls_per_s,
        "most_polls_per_s": budget.most_polls_per_s,
        "channels": budget.channels,
        "seconds_together": budget.seconds_together,
        "seconds_in_turn": budget.seconds_in_turn,
    }


def to_json(found: FittedSurface, path: AnyPath = "", argv: tuple[str, ...] = ()) -> bytes:
    """The document as one line, with the time that it took and the command as typed."""
    whole: dict[str, Any] = {**document(found), "seconds": found.seconds, "argv": list(argv)}
    return (json.dumps(whole, allow_nan=False) + "\n").encode()

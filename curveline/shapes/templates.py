"""New shape and display files as text: valid as they are, each key with what it means, to be changed by hand."""

from __future__ import annotations

import json
import tomllib
from collections.abc import Iterable, Iterator, Mapping
from typing import Any

from pydantic.fields import FieldInfo

from curveline.drive_settings import MAX_NODES
from curveline.errors import InvalidInput
from curveline.scene import PEAK, STRAIGHT, VALLEY, Display, Range
from curveline.shapes.file_keys import (
    DisplayTable,
    DriveTable,
    ErrorsTable,
    LimitsTable,
    NodeTable,
    OffsetsTable,
    RadioTable,
    RodTable,
    ShapeTable,
    Table,
)
from curveline.shapes.files import ShapeFile, builtin_text
from curveline.system.given_files import GivenFile
from curveline.units import rounded_down, rounded_up, to_deg, to_mm

REFERENCE = "single"
"""The built-in display whose numbers a new one begins with."""
EXAMPLES = {
    "bending_stiffness_Nmm2": 28000.0,
    "clamp_stiffness_Nmm_per_deg": 50.0,
    "diameter_mm": 6.0,
    "inner_diameter_mm": 4.0,
    "natural_curvature_along": [[0.0, 0.5], [2000.0, -0.5]],
    "natural_curvature_file": "rod.csv",
    "relaxation_fractions": [0.1, 0.15, 0.2],
    "relaxation_times_s": [1000.0, 30000.0, 1000000.0],
    "set_exponent": 0.295,
    "set_strength": 1.0,
    "shear_modulus_GPa": 0.9,
}
"""Numbers for keys that have no default, to be seen and not used."""
INSTEAD_OF = {
    "bending_stiffness_Nmm2": "youngs_modulus_GPa",
    "diameter_mm": "width_mm and thickness_mm",
    "relaxation_times_s": "set_strength",
}
"""Keys that say in another way what others say."""
ESTIMATES = frozenset({"youngs_modulus_GPa", "thickness_mm", "mass_g_per_m", "max_force_N", "max_moment_Nmm"})
"""What is an estimate in the built-in display."""
SECTIONS: Mapping[str, type[Table]] = {
    "rod": RodTable,
    "limits": LimitsTable,
    "drive": DriveTable,
    "radio": RadioTable,
    "errors": ErrorsTable,
    "offsets": OffsetsTable,
}
WIDTH = 34
"""Columns before a comment."""
ROD_PER_SEGMENT_MM, LEAST_ROD_MM = 1000.0, 2000.0
TILTS_DEG = {PEAK: 20.0, VALLEY: -20.0, STRAIGHT: 0.0}
"""Of the first node, and the last one the other way, for a state: away from the side on which the rod is to lie."""
SLACK = 1.2
"""Rod over the span, for a curve that is easy to see."""


def display_template(name: str, nodes: int) -> str:
    """A display file of so many nodes, each like those of the built-in display."""
    if not 2 <= nodes <= MAX_NODES:
        raise InvalidInput(f"a display has 2 to {MAX_NODES} nodes, not {nodes}", "choose a number in that range")
    values = tomllib.loads(builtin_text(REFERENCE))
    values.update(name=name, nodes=nodes)
    values["rod"]["total_length_mm"] = max(LEAST_ROD_MM, ROD_PER_SEGMENT_MM * (nodes - 1))
    values["radio"]["addresses"] = [f"C1C1C1C1{number:02X}" for number in range(1, nodes + 1)]
    lines = [
        "# A display. Its numbers are those of the built-in display "
        + REFERENCE
        + ": change them to yours, and measure",
        "# what is an estimate. `curveline display check` with this file says what such a display can do.",
        "",
        *_keys({key: field for key, field in DisplayTable.model_fields.items() if key not in SECTIONS}, values),
    ]
    for section, table in SECTIONS.items():
        lines += ["", f"[{section}]", *_keys(table.model_fields, values.get(section, {}))]
    return "\n".join(lines) + "\n"


def shape_template(name: str, display: Display, named: str, state: str) -> str:
    """A shape file in which every segment of a display, which it names so, shows a state.

    InvalidInput if the display's limits leave no room for such a shape.
    """
    fields, node = ShapeTable.model_fields, NodeTable.model_fields
    lines = [
        "# A shape. `curveline simulate` with this file shows its curves, `curveline plan` the way there.",
        "",
        *_keys({key: fields[key] for key in ("name", "display")}, {"name": name, "display": named}),
        "",
        f"# {fields['nodes'].description}",
        *(f"#   {key}: {node[key].description}" for key in ("height_mm", "angle_deg")),
        *(f"#   {key}: {node[key].description}; 0 if left out" for key in ("yaw_deg", "roll_deg")),
        "nodes = [",
        *(f"  {{ height_mm = {height}, angle_deg = {angle} }}," for height, angle in _poses(display, state)),
        "]",
        "",
        f"# {fields['segments'].description}: rod between the pivots, and the curve that is wanted: peak, valley,",
        "# or straight where there is no rod to spare",
        "segments = [",
        *[f'  {{ length_mm = {_length(display, state)}, state = "{state}" }},'] * (display.node_count - 1),
        "]",
        "",
        f"# {fields['loads'].description}, if any: at so much of the length of a segment, forces to the right and up",
        "# loads = [ { segment = 1, at = 0.5, force_N = [0.0, -1.0] } ]",
    ]
    return "\n".join(lines) + "\n"


def check_new_shape(text: str, folder: str) -> None:
    """InvalidInput if a new shape, in a folder, is none; its display leaves no room then."""
    try:
        ShapeFile(GivenFile("the new shape", text.encode(), folder))
    except InvalidInput as error:
        first = error.diagnostics[0]
        hint = f"{first.hint}; `curveline display check` says what the display can do"
        raise InvalidInput(f"the display leaves no room for a simple shape: {first.message}", hint) from None


def _keys(fields: Mapping[str, FieldInfo], values: Mapping[str, Any]) -> Iterator[str]:
    """A line per key of a table; one that may be left out is, behind a #."""
    for key, field in fields.items():
        remark = "estimate: " if key in ESTIMATES else f"instead of {INSTEAD_OF[key]}: " if key in INSTEAD_OF else ""
        comment = f"# {remark}{field.description}"
        is_out = key not in values
        example = field.examples[0] if field.examples else EXAMPLES.get(key, field.default)
        value = example if is_out else values[key]
        line = f"{'# ' if is_out else ''}{key} = {_written(value)}"
        yield from [f"{line:<{WIDTH}} {comment}"] if len(line) <= WIDTH else [comment, line]


def _written(value: Any) -> str:
    """A value as TOML, which has text, arrays and truth values as JSON has them, and its own infinity."""
    return json.dumps(value, ensure_ascii=False).replace("Infinity", "inf")


def _poses(display: Display, state: str) -> Iterable[tuple[str, str]]:
    """Height and angle of every node, as numbers of a file: level, the outermost tilted for a curve."""
    height = _within(0.0, display.limits.height, to_mm(1.0))
    last = display.node_count - 1
    for node in range(display.node_count):
        side = (node == 0) - (node == last)
        tilt = side * TILTS_DEG[state]
        yield _written(height), _written(_within(tilt, display.limits.angle, to_deg(1.0)))


def _length(display: Display, state: str) -> str:
    """Length of every segment, as a number of a file: from node to node for a straight one."""
    across = to_mm(display.span)
    if state == STRAIGHT:
        return _written(across)
    there = to_mm(display.rod.total_length) / (display.node_count - 1)
    low, high = to_mm(display.limits.length.low), min(to_mm(display.limits.length.high), there)
    wanted = max(rounded_up(low, 6), rounded_down(SLACK * across, 6))
    return _written(min(wanted, rounded_down(high, 6)))


def _within(value: float, limits: Range, unit: float) -> float:
    """The number nearest to `value` that limits, of which one SI unit holds `unit`, allow, in six digits."""
    return min(max(value, rounded_up(limits.low * unit, 6)), rounded_down(limits.high * unit, 6)) + 0.0

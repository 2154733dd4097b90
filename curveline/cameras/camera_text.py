"""The text of a camera file: a new one with every key explained, or one that exists with another lens in it."""

from __future__ import annotations

import re
import tomllib
from collections.abc import Mapping
from typing import Any

from curveline.cameras.camera_file import NODE_MARGIN
from curveline.cameras.setup import CameraSetup
from curveline.cameras.view import Frame, Lens
from curveline.scene import Display
from curveline.shapes.toml_location import TomlMap
from curveline.system.files import printable, refuse_file
from curveline.units import to_deg, to_mm

OPTIONAL = ("focal_length_mm", "film_focal_length_mm", "camera")
"""Keys of a lens that a calibration has if its pictures tell them."""
REMARKS = {
    "picture_px": "width and height, as the sensor takes pictures",
    "focal_px": "across and down",
    "centre_px": "where the axis of the lens meets the picture",
    "distortion": "k1, k2, p1, p2, k3, as OpenCV has them",
    "rms_px": "of the corners that it was calibrated on",
    "focal_length_mm": "pictures that tell another one are refused",
    "film_focal_length_mm": "the same for 35 mm film, digital zoom included",
}


def lens_keys(lens: Lens, camera: str = "") -> dict[str, Any]:
    """What `[lens]` says of a lens, as numbers that a camera file has."""
    keys: dict[str, Any] = {
        "picture_px": list(lens.size),
        "focal_px": [round(each, 3) for each in lens.focal],
        "centre_px": [round(each, 3) for each in lens.centre],
        "distortion": [round(each, 7) for each in lens.distortion],
        "rms_px": round(lens.rms, 4),
    }
    for key, length in (("focal_length_mm", lens.focal_length), ("film_focal_length_mm", lens.equivalent)):
        if length is not None:
            keys[key] = round(to_mm(length), 4)
    if camera:
        keys["camera"] = re.sub(r'["\\]', "", camera)
    return keys


def new_text(display: Display, frame: Frame, lens: Mapping[str, Any] | None = None) -> str:
    """A camera file for a display, with what can be known before anything is measured; without a lens, its place."""
    parts = [
        f"# A camera before the display {printable(display.name)}. Lengths are in mm: x from the first rail to the\n"
        "# right, y as the heights of nodes, z towards the viewer from the middle of the rod.\n",
        _lens_text(lens) if lens else "# [lens] is written here by: curveline camera calibrate PICTURES -o THIS-FILE\n",
        _frame_text(frame),
        _rod_text(display),
    ]
    return "\n".join(parts)


def with_lens(text: str, keys: Mapping[str, Any], name: str) -> str:
    """The text of a camera file with another lens, everything else and comments left as they are.

    InvalidInput for a file, called `name`, that is no TOML or in which that cannot be done.
    """
    try:
        before = tomllib.loads(text)
    except (tomllib.TOMLDecodeError, ValueError) as error:
        refuse_file(name, "toml-syntax", f"this is not TOML: {error}", "correct that, or write to another file")
    changed = text
    if "lens" in before:
        for key in OPTIONAL:
            if key not in keys:
                changed = re.sub(rf"(?m)^[ \t]*{key}[ \t]*=[^\n]*\n?", "", changed)
        for key, value in keys.items():
            changed = _with(changed, key, value)
    else:
        changed = f"{text.rstrip()}\n\n{_lens_text(keys)}".lstrip()
    others = {key: value for key, value in before.get("lens", {}).items() if key not in (*keys, *OPTIONAL)}
    try:
        is_right = tomllib.loads(changed) == {**before, "lens": {**others, **keys}}
    except tomllib.TOMLDecodeError:
        is_right = False
    if not is_right:
        message = "its lens is not written as [lens] with a key on each line, and is left as it is"
        refuse_file(name, "not-written", message, "take [lens] out of it, or write to another file")
    return changed


def _with(text: str, key: str, value: Any) -> str:
    """With another value of a key of the lens, or a line for it below its table's header."""
    found = TomlMap(text)
    if ("lens", key) not in found.keys:
        place = text.find("\n", found.values["lens",])
        line = f"{key} = {_value(value)}"
        return f"{text}\n{line}\n" if place < 0 else f"{text[: place + 1]}{line}\n{text[place + 1 :]}"
    begin = found.values["lens", key]
    ends = r"\[[^\]]*\]" if isinstance(value, list) else r"\"[^\"\n]*\"|[-+\w.]+"
    match = re.compile(ends).match(text, begin)
    return text if match is None else text[:begin] + _value(value) + text[match.end() :]


def _value(value: Any) -> str:
    """A value as TOML; text has nothing in it that would need an escape."""
    if isinstance(value, str):
        return f'"{value}"'
    if isinstance(value, list):
        return f"[{', '.join(map(_value, value))}]"
    return repr(value)


def _lens_text(keys: Mapping[str, Any]) -> str:
    lines = ["[lens]" + " " * 27 + "# by curveline camera calibrate"]
    for key, value in keys.items():
        line = f"{key} = {_value(value)}"
        lines.append(f"{line:<32} # {REMARKS[key]}" if key in REMARKS else line)
    return "\n".join(lines) + "\n"


def _frame_text(frame: Frame) -> str:
    tags = [
        f"  {{ number = {tag.number}, at_mm = [{to_mm(tag.centre[0]):.10g}, {to_mm(tag.centre[1]):.10g}], "
        f"turn_deg = {to_deg(tag.turn):.10g} }},"
        for tag in frame.tags
    ]
    return "\n".join(
        [
            "[frame]                          # measure these: they are where tags could be, not where yours are",
            f"tag_mm = {to_mm(frame.size):<23.10g} # side of the black square",
            f"depth_mm = {to_mm(frame.depth):<21.10g} # of the tags before the middle of the rod: negative behind it",
            "tags = [                         # middles of the tags; each turned so that its number reads upright",
            *tags,
            "]",
            "",
        ]
    )


def setup_text(display: Display, setup: CameraSetup) -> str:
    """The camera file of a camera of which everything is known: that of a mock display."""
    parts = [
        f"# The camera before the modelled display {printable(display.name)}.\n",
        _lens_text(lens_keys(setup.lens)),
        _frame_text(setup.frame),
        _seen_text(setup),
    ]
    return "\n".join(parts)


def _seen_text(setup: CameraSetup) -> str:
    rod, node = setup.rod, setup.node
    sides = {1: "up", -1: "down", 0: "none"}
    values = {"back_mm": rod.back, "depth_mm": rod.depth, "fibre_mm": rod.fibre}
    if rod.side:
        values |= {"teeth_mm": rod.teeth, "pitch_mm": rod.pitch}
    lines = [f"{key} = {to_mm(value):.10g}" for key, value in values.items()]
    sizes = {"half_width_mm": node.half_width, "half_height_mm": node.half_height}
    nodes = [f"{key} = {to_mm(value):.10g}" for key, value in sizes.items()]
    return "\n".join(["[rod]", f'teeth = "{sides[rod.side]}"', *lines, "", "[nodes]", *nodes, ""])


def _rod_text(display: Display) -> str:
    rod, own = display.rod, to_mm(0.5 * display.clamp + NODE_MARGIN)
    return "\n".join(
        [
            "[rod]                            # what is seen of it, which is not what bends",
            f"back_mm = {to_mm(rod.thickness):<22.10g} # thickness of what has no teeth; measure it",
            f"depth_mm = {to_mm(rod.width):<21.10g} # width, towards the viewer",
            'teeth = "none"                   # where they point on a level rod, "up" or "down"; then add teeth_mm,',
            "                                 # their height, and pitch_mm, from tooth to tooth",
            "fibre_mm = 0.0                   # from the middle of the back to what bends without stretching, towards",
            "                                 # the teeth",
            "",
            "[nodes]                          # what of a node hides the rod, around its pivot; measure it",
            f"half_width_mm = {own:.10g}",
            f"half_height_mm = {own:.10g}",
            "",
        ]
    )

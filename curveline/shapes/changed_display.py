"""The text of a display file with other values, comments kept."""

from __future__ import annotations

import json
import tomllib
from collections.abc import Mapping
from typing import Any

from curveline.errors import InvalidInput
from curveline.scene import Display
from curveline.shapes.files import MAX_BYTES, builtin_displays, builtin_text
from curveline.shapes.toml_location import KeyPath, TomlMap
from curveline.system.files import decode_text, read_file, refuse_file


def text_of(display: Display) -> str:
    """The text of the file that a display was read of; InvalidInput for one that is in no file."""
    if display.path:
        return decode_text(read_file(display.path, MAX_BYTES), display.path)
    if display.name not in builtin_displays():
        hint = "write it into a file, and read that with read_display"
        raise InvalidInput(f"{display.name}: this display is in no file that could be changed", hint)
    return builtin_text(display.name)


def changed_text(text: str, values: Mapping[KeyPath, Any], name: str) -> str:
    """The text of a display file, by its name, with other values; InvalidInput if that would change anything else."""
    found, changed, wanted = TomlMap(text), text, tomllib.loads(text)
    for path, value in values.items():
        table: Any = wanted
        for key in path[:-1]:
            table = table[key]
        table[path[-1]] = value
    for path in sorted(values, key=lambda each: -found.values.get(each, 0)):
        begin = found.values.get(path, -1)
        if begin >= 0:
            changed = changed[:begin] + json.dumps(values[path], ensure_ascii=False) + changed[_end(changed, begin) :]
    try:
        is_right = tomllib.loads(changed) == wanted
    except tomllib.TOMLDecodeError:
        is_right = False
    if not is_right:
        keys = ", ".join(".".join(map(str, path)) for path in values)
        refuse_file(name, "not-written", f"{keys} of this file cannot be changed", "write each of them plainly")
    return changed


def _end(text: str, begin: int) -> int:
    """Where the value ends that begins at a place of a file: after the fewest letters that are one by themselves."""
    stops = [place for place in range(begin + 1, len(text)) if text[place] in "#\n,]}" or text[place - 1] == "]"]
    for stop in (*stops, len(text)):
        try:
            tomllib.loads(f"x = {text[begin:stop]}")
        except tomllib.TOMLDecodeError:
            continue
        return begin + len(text[begin:stop].rstrip())
    return begin

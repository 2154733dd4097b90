"""Which of our files a text is, so that one that is given in place of another is called by its name."""

from __future__ import annotations

import re
import shlex
from typing import NamedTuple

from curveline.system.files import refuse_file

LOOKED_AT = 4_000
"""Characters from the beginning that a kind is told by; tables begin well before that."""


class FileKind(NamedTuple):
    """A kind of file: what it is called, and what takes it, with {} for its name as a shell reads it."""

    name: str
    use: str


SHAPE = FileKind("a shape", "`curveline simulate {}` takes it, and so do load, plan and send")
DISPLAY = FileKind(
    "a display file",
    "`curveline display check {}` takes it; for a shape that names it: `curveline new shape --display {}`",
)
PLAN = FileKind("a plan", "`curveline plan {}` shows it, `curveline send {}` sends it")
RESULT = FileKind("a result of curveline", "name the shape that it was computed from")
BENCH = FileKind("a record of a benchmark", "`curveline bench --compare {}` compares with it")
READINGS = FileKind("readings of strips", "`curveline calibrate set {}` takes them")
LINES = FileKind("the manifest of a folder of lines", "`curveline send` takes the folder that it is in")
CAMERA = FileKind("a camera file", "`curveline camera pose PICTURE --camera {}` takes it")
KEY_FILE = FileKind("the key file of a site", "keep it to yourself: set CURVELINE_KEYS={} to use it")
IMAGE = FileKind("a program for a node", "`curveline keys node N --hex {} -o FILE` takes it")

_JSON = (("curveline_plan", PLAN), ("curveline_site", KEY_FILE), ("curveline_bench", BENCH), ("curveline", RESULT))
_OF_SHAPES = r"(?m)^[ \t]*(?:(display|segments|nodes)[ \t]*=[ \t]*[\"'\[]|\[\[(nodes|segments|loads)\]\])"
_OF_DISPLAYS = r"(?m)^[ \t]*(?:(span_mm|clamp_mm|gravity)[ \t]*=|\[(rod|limits|drive|radio)\])"
MARKS = 2
"""Different keys or tables of a kind that a file must have, since a stray one is a slip in a file of the other kind."""


def kind_of(text: str) -> FileKind | None:
    """The kind that a text is by its first lines; None if it may be anything, or bits of two kinds."""
    head = text[:LOOKED_AT].lstrip()
    if head.startswith("{"):
        return next((kind for key, kind in _JSON if re.search(rf'\{{\s*"{key}"', head)), None)
    if re.match(r":[0-9A-Fa-f]{10}", head):
        return IMAGE
    if re.search(r"(?m)^[ \t]*\[\[lines\]\]", head):
        return LINES
    if re.search(r"(?m)^[ \t]*\[(lens|frame)\]", head):
        return CAMERA
    marks = [{"".join(found) for found in re.findall(pattern, head)} for pattern in (_OF_SHAPES, _OF_DISPLAYS)]
    if not all(marks):
        for kind, found in zip((SHAPE, DISPLAY), marks, strict=True):
            if len(found) >= MARKS:
                return kind
    return None


def refuse_other_kind(text: str, name: str, wanted: FileKind) -> None:
    """InvalidInput if a text is plainly another kind of file than the `wanted` one."""
    kind = kind_of(text)
    if kind not in (None, wanted):
        hint = kind.use.replace("{}", shlex.quote(name))
        refuse_file(name, "wrong-kind", f"this is {kind.name}, not {wanted.name}", hint)

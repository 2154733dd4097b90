"""What is to be planned or sent: files that are shapes, or one that is a plan, told by what is in them."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

from curveline.errors import InvalidInput
from curveline.plan_file import MAX_BYTES, Plan, from_json
from curveline.shapes.library import given_shape
from curveline.system.files import AnyPath, decode_text

if TYPE_CHECKING:
    from curveline.scene import Scene

PLAN_SUFFIX = ".json"


def read_inputs(paths: Sequence[str], hint: str, *, takes_plan: bool) -> Plan | list[Scene]:
    """The shapes in some files, or the plan if that is what the only one is.

    InvalidInput with `hint` for a plan beside others, or where none is taken, and as of `read_input`.
    """
    scenes = []
    for path in paths:
        given = read_input(path)
        if not isinstance(given, Plan):
            scenes.append(given)
        elif takes_plan and len(paths) == 1:
            return given
        else:
            raise InvalidInput(f"{path}: a plan is taken by itself", hint)
    return scenes


def read_input(path: AnyPath) -> Scene | Plan:
    """The shape or the plan in a file, in a pipe, or in standard input if the path is `-`; or a built-in shape.

    JSON is a plan, and so is what claims to be JSON by its name. InvalidInput lists every problem of it.
    """
    given = given_shape(path, MAX_BYTES)
    text = decode_text(given.data, given.name)
    if given.name.lower().endswith(PLAN_SUFFIX) or text.lstrip().startswith("{"):
        return from_json(text, given.name)
    from curveline.shapes.files import ShapeFile  # whoever sends a plan needs nothing of it

    return ShapeFile(given).scene

"""New shape and display files on disk, from their templates; they never replace a file."""

from __future__ import annotations

import os

from curveline.errors import InvalidInput
from curveline.scene import WANTABLE, Display
from curveline.shapes.file_keys import LONGEST_NAME
from curveline.shapes.files import read_display
from curveline.shapes.templates import check_new_shape, display_template, shape_template
from curveline.shapes.toml_document import shown
from curveline.system.arguments import expect
from curveline.system.files import AnyPath, refuse_file, write_file

SUFFIX = ".toml"


def new_shape(path: AnyPath | None, display: AnyPath = "single", state: str = "peak", *, name: str = "") -> str:
    """Write a shape file to begin with, valid as it is and every key explained; the text that is in it.

    `display` is a built-in name or the path of a display file, `state` what every segment is to show: "peak", "valley"
    or "straight". `name` is what the shape calls itself, as its file if it is empty. None for `path` writes nothing.
    Raises InvalidInput for a file that exists, or a display that leaves no room for such a shape.
    """
    if state not in WANTABLE:
        raise InvalidInput(f"no new shape has a state {state!r}", f"choose one of {', '.join(WANTABLE)}")
    check_free(path)
    folder = "" if path is None else os.path.dirname(os.fspath(path))
    read = read_display(display)
    named = display_named_in(folder, read, os.fspath(display))
    text = shape_template(_name_for(path, name, "my-shape"), read, named, state)
    check_new_shape(text, folder)
    return _kept(text, path)


def new_display(path: AnyPath | None, nodes: int = 2, *, name: str = "") -> str:
    """Write a display file to begin with, valid as it is and every key explained; the text that is in it.

    Its numbers are those of the built-in display "single", with `nodes` nodes, 2 to 128. `name` and `path` are as for
    `new_shape`.
    """
    check_free(path)
    return _kept(display_template(_name_for(path, name, "my-display"), nodes), path)


def check_free(path: AnyPath | None) -> None:
    """InvalidInput if there is anything at a path where a new file is to be."""
    if path is not None and os.path.lexists(path):
        refuse_file(
            os.fspath(path), "exists", "the file exists already", "choose another name: a new file replaces none"
        )


def _kept(text: str, path: AnyPath | None) -> str:
    if path is not None:
        write_file(path, text.encode())
    return text


def _name_for(path: AnyPath | None, name: str, default: str) -> str:
    """What a new file calls itself; InvalidInput for what none may."""
    chosen = name or (default if path is None else os.path.basename(os.fspath(path)).removesuffix(SUFFIX))
    expect(chosen, str, "a name")
    if not chosen.strip() or not chosen.isprintable() or len(chosen) > LONGEST_NAME:
        hint = f"name it with at most {LONGEST_NAME} letters, digits, spaces and signs, on one line"
        raise InvalidInput(f"no new file calls itself {shown(chosen)}", hint)
    return chosen


def display_named_in(folder: str, display: Display, path: str = "") -> str:
    """What a shape file in a folder calls a display, which is in a file or built in; `path` as somebody named it.

    InvalidInput for a file whose name cannot be written.
    """
    named = _as_named_in(folder, path or display.path) if display.path else display.name
    if not named.isprintable():
        raise InvalidInput(f"a shape file cannot name the display {shown(named)}", "give the display file a plain name")
    return named


def _as_named_in(folder: str, display: str) -> str:
    """The path of a display file as a shape in a folder names it."""
    try:
        path = os.path.relpath(display, folder or os.curdir)
    except ValueError:  # on another drive
        path = display
    return path.replace(os.sep, "/")

"""The folder of a surface: shapes, plans, displays and the manifest for `curveline send`; whole or not at all."""

from __future__ import annotations

import hashlib
import json
import os
import shutil
import tempfile
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path

from curveline.errors import InvalidInput
from curveline.fitting.results import to_shape
from curveline.plan_file import encoded, sealed
from curveline.surfaces.fit_surface import FittedLine, FittedSurface
from curveline.surfaces.results import document
from curveline.system import portable
from curveline.system.files import AnyPath, printable, read_file, refuse_file, refuse_no_name
from curveline.units import plain, to_mm

LINES_FILE = "lines.toml"
SURFACE_FILE = "surface.json"
MAX_BYTES = 64_000_000


def check_folder(folder: AnyPath, *, force: bool = False) -> None:
    """InvalidInput for a folder that `write_folder` could not make, or whose files are not its own."""
    name = os.fspath(folder)
    refuse_no_name(name)
    target = Path(os.path.realpath(name))
    is_folder = target.is_dir()
    if os.path.lexists(target) and not is_folder:
        refuse_file(name, "not-a-folder", "this is a file, and no folder", "choose another name")
    if not target.parent.is_dir():
        refuse_file(name, "no-such-folder", "there is no folder to make it in", f"make it first: {target.parent}")
    if not os.access(target.parent, os.W_OK | os.X_OK):
        refuse_file(name, "unwritable", "the folder that it is to be in may not be written to", "choose one of yours")
    if Path.cwd().is_relative_to(target):
        refuse_file(name, "in-use", "the current folder is in it, which is to be replaced", "name another, or cd away")
    inside = sorted(os.listdir(target)) if is_folder else []
    if not inside:
        return
    if not force:
        hint = "choose a new or empty one; --force replaces what this command made"
        refuse_file(name, "not-empty", "this folder is not empty", hint)
    own = _own_files(target)
    strange = [each for each in inside if own.get(each) != _digest_of(target / each)]
    if SURFACE_FILE in strange:
        strange.remove(SURFACE_FILE)
    if not own or strange:
        what = printable(strange[0]) if strange else SURFACE_FILE
        message = f"it has files that are not as `curveline surface` wrote them: {what}"
        refuse_file(name, "not-ours", message, "move them away, or choose another folder")


def _own_files(target: Path) -> Mapping[str, str]:
    """What a surface's folder says that it has, by name, with digests; nothing if it does not say."""
    try:
        found = json.loads(read_file(target / SURFACE_FILE, MAX_BYTES))["files"]
        return {str(name): str(digest) for name, digest in found.items()}
    except (InvalidInput, ValueError, KeyError, TypeError, AttributeError, RecursionError):
        return {}


def _digest_of(path: Path) -> str | None:
    """Of a file; None of what is none, or is a link."""
    if path.is_symlink():
        return None
    try:
        return hashlib.sha256(read_file(path, MAX_BYTES)).hexdigest()
    except InvalidInput:
        return None


def write_folder(
    folder: AnyPath, found: FittedSurface, figures: Mapping[str, bytes], *, force: bool = False
) -> tuple[str, ...]:
    """Put a surface into a folder that is new or empty: a shape, a plan and a display per line, and what joins them.

    `figures`, by their names, go there too. With `force` a folder is replaced that has nothing but what this function
    wrote. The names of the files in it. InvalidInput where it cannot be written; then nothing has changed.
    """
    check_folder(folder, force=force)
    target = Path(os.path.realpath(folder))
    with _refusals(target), _staging(target) as staging:
        names = _fill(staging, target, found, figures)
        _swap(staging, target)
    return names


@contextmanager
def _refusals(target: Path) -> Iterator[None]:
    try:
        yield
    except OSError as error:
        reason = error.strerror or type(error).__name__
        refuse_file(str(target), "unwritable", f"it cannot be written: {reason}", "choose another folder, or make room")


@contextmanager
def _staging(target: Path) -> Iterator[Path]:
    """A folder beside the target, which is gone in the end."""
    staging = Path(tempfile.mkdtemp(prefix=f".{target.name[:60]}.", suffix=".part", dir=target.parent))
    try:
        yield staging
    finally:
        shutil.rmtree(staging, ignore_errors=True)


def _fill(staging: Path, target: Path, found: FittedSurface, figures: Mapping[str, bytes]) -> tuple[str, ...]:
    """Write all files of a surface into a folder that will be the target."""
    files: dict[str, bytes] = {}

    def put(name: str, data: bytes) -> None:
        files[name] = data
        with open(staging / name, "xb") as stream:
            stream.write(data)
            stream.flush()
            portable.sync(stream.fileno())

    for name, data in {**figures, **dict(each for line in found.lines for each in line.own.files)}.items():
        put(name, data)
    for line in found.lines:
        put(display_name(line), line.own.text.encode())
        put(shape_name(line), _shape(line, staging))
        if line.fit.plan is not None:
            put(plan_name(line), _plan(line, target, files[shape_name(line)]))
    put(LINES_FILE, manifest(found).encode())
    digests = {name: hashlib.sha256(data).hexdigest() for name, data in sorted(files.items())}
    put(SURFACE_FILE, (json.dumps({**document(found), "files": digests}, indent=1, allow_nan=False) + "\n").encode())
    portable.sync_folder(staging)
    return tuple(files)


def shape_name(line: FittedLine) -> str:
    """The file of a line's shape."""
    return f"line-{line.number}.toml"


def plan_name(line: FittedLine) -> str:
    """The file of a line's plan."""
    return f"line-{line.number}.json"


def display_name(line: FittedLine) -> str:
    """The file of a line's display."""
    return f"display-{line.number}.toml"


def _shape(line: FittedLine, folder: Path) -> bytes:
    """The shape file of a line, whose display is beside it."""
    display = replace(line.own.display, path=str(folder / display_name(line)))
    fit = replace(line.fit, scene=replace(line.fit.scene, display=display))
    return to_shape(fit, folder / shape_name(line))


def _plan(line: FittedLine, folder: Path, shape: bytes) -> bytes:
    """The plan file of a line, which says what it was made from."""
    plan = line.fit.plan
    assert plan is not None
    provenance = {
        **plan.provenance,
        "shape": str(folder / shape_name(line)),
        "shape_sha256": hashlib.sha256(shape).hexdigest(),
        "display": str(folder / display_name(line)),
    }
    return encoded(sealed(replace(plan, provenance=provenance)))


def manifest(found: FittedSurface) -> str:
    """`lines.toml`: what `curveline send FOLDER` drives together; a line without a plan is planned as it is sent."""
    lines = [
        "# Lines that are driven together: `curveline send` with this folder. Made by `curveline surface`:",
        "# surface.json has how near they come and what they take. current_A is the worst case, all motors held.",
        "",
        f"# current_limit_A = {plain(round(2.0 * found.budget.current_per_line, 6))}"
        "   # what all that move at the same time may draw; the others wait for their turn",
    ]
    for line in found.lines:
        is_planned = line.fit.plan is not None
        lines += [
            "",
            "[[lines]]",
            f'name = "{line.number}"',
            f'plan = "{plan_name(line) if is_planned else shape_name(line)}"',
            f'display = "{display_name(line)}"',
            '# radio = "serial:PORT"',
            f"current_A = {plain(round(found.budget.current_per_line, 6))}",
        ]
        if line.fit.refusal:
            lines.append(f"# no plan from home was found: {printable(line.fit.refusal)}")
    laying = found.request.laying
    lines += [
        "",
        "[surface]",
        f"name = {json.dumps(printable(found.name), ensure_ascii=False)}",
        f"pitch_mm = {plain(to_mm(laying.pitch))}",
        f"lines = {laying.lines}",
    ]
    return "\n".join(lines) + "\n"


def _swap(staging: Path, target: Path) -> None:
    """Let a folder that is written take its place, also that of an older one, which comes back if that fails."""
    os.chmod(staging, 0o777 & ~_mask())
    if not target.exists():
        portable.replace(staging, target)
        return
    away = Path(tempfile.mkdtemp(prefix=f".{target.name[:60]}.", suffix=".old", dir=target.parent))
    portable.replace(target, away / "old")
    try:
        portable.replace(staging, target)
    except OSError:
        portable.replace(away / "old", target)
        raise
    finally:
        shutil.rmtree(away, ignore_errors=True)


def _mask() -> int:
    """The user's mask of modes for new files."""
    mask = os.umask(0)
    os.umask(mask)
    return mask

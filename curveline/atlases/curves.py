"""Some thousand stable curves of a display's segment over its limits, made once and kept in the user's cache folder.

What the folder holds is not trusted: a file is of use if it begins with the digest of what it should be of and that of
its own content, and if this is of the right form; else it is made anew.
"""

from __future__ import annotations

import hashlib
import os
from contextlib import suppress
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

import numpy as np

from curveline._version import __version__
from curveline.atlases.entries import ENTRY, Array, Entries, force_of, segment_rod, with_begins
from curveline.atlases.sampling import longest, sampled_poses
from curveline.atlases.sharing import Crew, at_work, found_at
from curveline.errors import InvalidInput
from curveline.kernels import cache
from curveline.listening import SILENT, Listener
from curveline.notebook import html_of
from curveline.rod.clamped_rod import ClampedRod
from curveline.scene import Display
from curveline.system import files
from curveline.units import mm, to_mm

POSES = 4096
"""Places of the nodes that are tried."""
TOLERANCE = mm(0.1)
"""Of the curves [m]."""
MOST_STATES = 8
"""Of a pose, on average."""
FORMAT = b"curveline stable curves 1\n"
DIGEST = hashlib.sha256().digest_size
FOLDER = "atlases"


@dataclass(frozen=True, eq=False)
class StableCurves:
    """Stable curves of one segment of a display over its limits: rows with all that is known of each, see `ENTRY`."""

    display: Display  # whose segment it is
    poses: Array  # (m, 6): x, y [m], angles of both clamps [rad], length of rod [m], where it begins [m]
    entries: Entries  # (s,), by their poses, those of one from the highest down

    def __len__(self) -> int:
        return len(self.entries)

    @cached_property
    def where(self) -> Array:
        """The pose of every curve, (s, 6)."""
        there: Array = self.poses[self.entries["pose"]]
        return there

    def _repr_html_(self) -> str:
        names, counts = np.unique(self.entries["name"], return_counts=True)
        rows = [
            (name, count, float(np.median(force_of(self.entries[self.entries["name"] == name]))))
            for name, count in zip(names.tolist(), counts.tolist(), strict=True)
        ]
        title = f"{len(self)} stable curves of {self.display.name}"
        return html_of(title, [("state", "curves", "median force N"), *rows])


def curves_of(display: Display, crew: Crew | None = None, listener: Listener = SILENT) -> StableCurves:
    """The stable curves of a display over its limits, from the cache if it has them: the same either way.

    InvalidInput for a display that leaves its plane, or whose limits allow no curve.
    """
    rod = segment_rod(display)
    poses = with_begins(sampled_poses(display, rod, POSES), display)
    if not len(poses):
        hint = f"it has {to_mm(longest(display)):.4g} mm of rod for a segment and a span of {to_mm(display.span):.4g}"
        raise InvalidInput(f"{display.name}: its limits leave no rod for a curve", hint)
    key = _key(rod, poses)
    path = cache.home() / FOLDER / f"{key.hex()[:32]}.bin"
    entries = _kept(path, key, len(poses))
    if entries is None:
        listener.computing()
        with listener.progress("stable curves", len(poses)) as heard, at_work(crew or Crew(), len(poses)) as doer:
            entries = found_at(doer, rod, poses, TOLERANCE, heard)
        _keep(path, key, entries)
    return StableCurves(display, poses, entries)


def _key(rod: ClampedRod, poses: Array) -> bytes:
    """Digest of all that the curves depend on: the rod and its bearings, the poses, the program."""
    digest = hashlib.sha256(FORMAT)
    for part in (__version__, cache.source_digest(), repr(ENTRY), repr(TOLERANCE), repr(rod.bearing)):
        digest.update(part.encode() + b"\0")
    digest.update(rod.bearing.profile.tobytes())
    digest.update(poses.tobytes())
    return digest.digest()


def _kept(path: Path, key: bytes, poses: int) -> Entries | None:
    """The curves that a file keeps; None if it keeps others, or is damaged or not there."""
    try:
        data = files.read_file(path, len(FORMAT) + 2 * DIGEST + MOST_STATES * poses * ENTRY.itemsize)
    except (InvalidInput, OSError):
        return None
    head = len(FORMAT) + 2 * DIGEST
    content = memoryview(data)[head:]
    if data[:head] != FORMAT + key + hashlib.sha256(content).digest() or len(content) % ENTRY.itemsize:
        return None
    entries = np.frombuffer(content, dtype=ENTRY)
    return entries if _is_sound(entries, poses) else None


def _is_sound(entries: Entries, poses: int) -> bool:
    """True for rows whose numbers are finite and whose poses are there, and rise."""
    numbers = [entries[name] for name in ENTRY.names or () if ENTRY[name].base.kind == "f"]
    rising = np.diff(entries["pose"], prepend=0, append=poses - 1)
    return bool(np.all(rising >= 0) and all(np.isfinite(each).all() for each in numbers))


def _keep(path: Path, key: bytes, entries: Entries) -> None:
    """Put curves into the cache, if it can be written."""
    content = entries.tobytes()
    with suppress(OSError, InvalidInput):
        os.makedirs(path.parent, exist_ok=True)
        files.write_file(path, FORMAT + key + hashlib.sha256(content).digest() + content, force=True)

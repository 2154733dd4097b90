"""The rod of a display as it is now: the set that the shapes left in it in which runs held it.

What it remembers is kept beside the runs, `rod-NAME.json`, up to where the last run but one left it, so that a long
history is gone through once. That file is a shortcut: without it, all is worked out again from the runs. It also says
since when a rod is in the display, if somebody told that it is a new one.
"""

from __future__ import annotations

import json
import os
import re
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any
from zlib import crc32

from curveline._version import __version__
from curveline.driving.rod_record import NO_RUN, RodRecord, Stay, Stays, stays_of
from curveline.driving.runs import LATEST
from curveline.errors import Infeasible, InvalidInput
from curveline.notebook import html_of
from curveline.phrases import local_time
from curveline.radio.host.run_folder import number_of, run_names
from curveline.system.files import read_file, write_file

if TYPE_CHECKING:
    from curveline.material.memory import RodMemory
    from curveline.material.past import Past
    from curveline.scene import Display, Scene

FORMAT = 1
SIZE_LIMIT = 20_000_000
MOST_STRAIN = 2.0
"""Between both faces of a rod that remembers a bend: more, no rod has been through."""


@dataclass(frozen=True)
class RodNow:
    """What the rod of a display went through, the first stay first, and what that left.

    `remarks` say what had to be taken for granted.
    """

    display: Display  # its rod as it was made
    stays: tuple[Stay, ...]  # the first one first
    past: Past  # the set that they left
    remarks: tuple[str, ...] = ()

    @property
    def last(self) -> Scene | None:
        """The last shape that was not straight, if any is on record."""
        return next((stay.scene for stay in reversed(self.stays) if stay.scene is not None), None)

    @property
    def with_set(self) -> Display:
        """The display with its rod as it is."""
        from curveline.simulation.dwelling import with_set

        return with_set(self.display, self.past.memory)

    def document(self) -> dict[str, Any]:
        """All of it as plain data."""
        told = self.past.document()
        del told["history"]
        stays = [
            {
                "run": stay.run,
                "shape": stay.shape,
                "from": stay.begin,
                "held_s": stay.seconds,
                "is_straight": stay.is_known and stay.scene is None,
                "is_known": stay.is_known,
            }
            for stay in self.stays
        ]
        head = {"curveline": __version__, "display": self.display.name, "stays": stays}
        return {**head, **told, "remarks": list(self.remarks)}

    def _repr_html_(self) -> str:
        rows = [(stay.run, stay.shape, local_time(stay.begin), stay.seconds) for stay in self.stays]
        title = f"the rod of {self.display.name}: a set of up to {self.past.largest_set:.2g} 1/m"
        return html_of(title, [("run", "shape", "from", "held s"), *rows])


@dataclass(frozen=True)
class _Kept:
    """What the file says: up to the begin of which run the memory goes; since when the rod is there [s]."""

    run: str  # by name, empty for none
    since: float
    memory: RodMemory

    @property
    def number(self) -> int:
        """That of the run, below that of any if there is none."""
        return number_of(self.run) if self.run else NO_RUN


def rod_now(display: Display, record: RodRecord, now: float, before: str = "") -> RodNow:
    """The rod of a display `now` [s since 1970], or before a run of that name.

    If the display's file does not say what set it takes, that is acetal's, an estimate.
    """
    from curveline.material.history import Dwell
    from curveline.material.memory import RodMemory
    from curveline.material.past import Past
    from curveline.material.relaxation import LONGEST, power_law

    law = display.rod.relaxation or power_law()
    found, new = stays_of(display, record, now, before), RodMemory.new(law, display.rod.total_length)
    kept, since = _begun(display, record, (found, new), now)
    stays = [replace(stay, begin=max(stay.begin, since)) for stay in found.stays if stay.end > since]
    ahead = [stay for stay in stays if stay.number >= kept.number]
    # A run may have rested more than once: it is gone through as a whole, or not yet.
    early = [stay for stay in ahead if stay.run != ahead[-1].run]
    done, error, remarks = _gone_through(display, kept.memory, early)
    if record.is_kept and not before and early:
        _write(_path(display, record), _Kept(ahead[-1].run, kept.since, done))
    memory, last_error, last_remarks = _gone_through(display, done, ahead[len(early) :])
    dwells = tuple(Dwell(stay.run, min(stay.seconds, LONGEST)) for stay in stays)
    profile = display.rod.profile
    past = Past(
        dwells,
        memory,
        display.span,
        error + last_error,
        steps=len(ahead),
        is_estimate=display.rod.relaxation is None,
        made=None if profile is None else (profile.places, profile.values),
    )
    return RodNow(display, tuple(stays), past, (*remarks, *last_remarks))


def _begun(display: Display, record: RodRecord, given: tuple[Stays, RodMemory], now: float) -> tuple[_Kept, float]:
    """From what on a rod's stays count, and since when [s], given all its stays, and what a new rod remembers."""
    found, new = given
    kept = _read(_path(display, record), display, new)
    if kept.run and kept.run not in run_names(record.runs):
        # Its runs were taken away: numbers begin anew, and nothing tells what came after what it remembers.
        kept = replace(kept, run="", memory=new)
    # A clock that was set back since must not hide what happens from now on: then the run tells when that was.
    since = kept.since if kept.since <= now else 0.0
    if record.since > since:
        kept, since = _Kept("", record.since, new), record.since
    if found.new_in is not None and number_of(found.new_in) > kept.number:
        kept = _Kept(found.new_in, kept.since, new)
    return kept, since


def begin_new_rod(display: Display, record: RodRecord, now: float) -> None:
    """Put down that a rod is new in a display since `now` [s since 1970]."""
    from curveline.material.memory import RodMemory
    from curveline.material.relaxation import power_law

    law = display.rod.relaxation or power_law()
    last = next((stay.run for stay in reversed(stays_of(display, record, now).stays)), "")
    _write(_path(display, record), _Kept(last, now, RodMemory.new(law, display.rod.total_length)), must=True)


def _gone_through(
    display: Display, memory: RodMemory, stays: Sequence[Stay]
) -> tuple[RodMemory, float, tuple[str, ...]]:
    """What a rod remembers after some stays, how exactly [1/m], and what was taken for granted."""
    from curveline.material.history import Dwell
    from curveline.material.relaxation import LONGEST
    from curveline.simulation.dwelling import Holding, followed

    error, remarks = 0.0, list[str]()
    for stay in stays:
        dwell = Dwell(stay.run, min(stay.seconds, LONGEST))
        if not stay.is_known:
            remarks.append(f"{stay.run}: which curve it left is not known, so that the rod is taken for straight")
        try:
            memory, _, off = followed(memory, display, [Holding(dwell, stay.scene)])
        except (Infeasible, InvalidInput) as refusal:
            remarks.append(f"{stay.run}: {refusal.message}, so that the rod is taken for straight")
            memory, _, off = followed(memory, display, [Holding(dwell, None)])
        error += off
    return memory, error, tuple(remarks)


def _path(display: Display, record: RodRecord) -> Path:
    """Where what is kept of a rod lies: each display has its own, and each radio that is no mock."""
    kind, _, settings = record.spec.partition(":")
    plain = re.sub(r"[^A-Za-z0-9._-]", "_", display.name)
    port = "" if kind == "mock" else os.path.realpath(settings.strip())
    told_apart = f"-{crc32(f'{kind}:{port} {display.name}'.encode()):08x}" if port or plain != display.name else ""
    return record.runs / f"{'mock-rod' if kind == 'mock' else 'rod'}-{plain or '_'}{told_apart}.json"


def _read(path: Path, display: Display, new: RodMemory) -> _Kept:
    """What is kept of a rod; one that remembers nothing, as a `new` one, if there is nothing to be believed."""
    from curveline.material.memory_json import memory_from

    nothing = _Kept("", 0.0, new)
    try:
        document: Any = json.loads(read_file(path, SIZE_LIMIT))
    except (InvalidInput, ValueError, RecursionError):
        return nothing
    if not isinstance(document, dict) or document.get("format") != FORMAT:
        return nothing
    run, since = document.get("run"), document.get("since")
    if not isinstance(run, str) or not isinstance(since, int | float) or not 0.0 <= since < LATEST:
        return nothing
    try:
        memory = memory_from(document.get("memory"), new.law, new.total_length)
    except InvalidInput:
        # Another law, or another rod's length: all that is on record since the rod was new is gone through again.
        return replace(nothing, since=float(since))
    strain = float(abs(memory.bends).max()) * display.rod.thickness
    if strain > MOST_STRAIN:
        return replace(nothing, since=float(since))
    return _Kept(run, float(since), memory)


def _write(path: Path, kept: _Kept, *, must: bool = False) -> None:
    """Keep what a rod remembers; a shortcut that cannot be kept is none."""
    from curveline.material.memory_json import memory_document

    document = {"format": FORMAT, "run": kept.run, "since": kept.since, "memory": memory_document(kept.memory)}
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        write_file(path, f"{json.dumps(document)}\n".encode(), force=True)
    except (OSError, InvalidInput):
        if must:
            raise

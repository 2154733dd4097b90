"""The record of a run, written before the radio speaks, and the folders that runs are kept in.

One line per record: body length (6 digits), sequence number (8), CRC-32 of sequence and body (8 hexadecimal digits),
JSON body. A record counts only when it is on disk; the reader drops a torn end and refuses damage before it.
"""

from __future__ import annotations

import errno
import json
import os
import re
import time
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any, Protocol
from zlib import crc32

from curveline.errors import InvalidInput, LinkError
from curveline.radio.host.actions import Record
from curveline.radio.host.run_folder import claim_folder
from curveline.system import portable
from curveline.system.files import read_file

FILE_NAME = "journal"
LOCK_NAME = "lock"
"""An empty file beside the journal, which who sends the run has locked: Windows lets nobody read a locked file."""
HEAD = re.compile(rb"([0-9]{6}) ([0-9]{8}) ([0-9a-f]{8}) ")
HEAD_BYTES = 25
BODY_LIMIT = 999_999
SIZE_LIMIT = 200_000_000
"""More than the record of any run; what is larger is not one."""

LOOK = "look"
"""Type of a record of what a camera saw once a run was done; it belongs to no step."""

LOCK_TRIES = 5
LOCK_RETRY_S = 0.02
"""Whoever only looks whether a run is being sent has its lock for an instant."""


class Disk(Protocol):
    """The calls that a journal makes; tests put failing ones in their place."""

    def reserve(self, descriptor: int, size: int) -> None:
        """Make sure that `size` bytes can be written."""
        ...

    def write(self, descriptor: int, data: bytes, offset: int) -> int:
        """Write at `offset`; how many bytes were taken."""
        ...

    def sync(self, descriptor: int) -> None:
        """Force to the medium."""
        ...


class SystemDisk:
    """The real disk."""

    def reserve(self, descriptor: int, size: int) -> None:
        """See Disk."""
        portable.reserve(descriptor, size)

    def write(self, descriptor: int, data: bytes, offset: int) -> int:
        """See Disk."""
        return portable.write_at(descriptor, data, offset)

    def sync(self, descriptor: int) -> None:
        """See Disk."""
        portable.sync(descriptor)


class Journal:
    """An open record of one run, which no other process can open meanwhile."""

    def __init__(self, run: Path, disk: Disk | None = None) -> None:
        """Begin the record in the folder `run`; LinkError if the disk refuses, InvalidInput if there is one already."""
        self.path = run / FILE_NAME
        self.disk = disk or SystemDisk()
        self._sequence = 0
        self._end = 0
        self._lock = -1
        self._broken = ""
        try:
            self._descriptor = os.open(self.path, os.O_WRONLY | os.O_CREAT | os.O_EXCL | portable.PLAIN, 0o644)
        except FileExistsError:
            raise InvalidInput(f"{self.path} holds the record of another run") from None
        except OSError as error:
            raise _refused(self.path, error) from error
        with self._closed_on_error():
            self._lock = lock_run(run)
            self.disk.sync(self._descriptor)
            portable.sync_folder(run)

    def reserve(self, size: int) -> None:
        """Make sure now that `size` bytes of records will find room; LinkError if they would not."""
        try:
            self.disk.reserve(self._descriptor, self._end + size)
        except OSError as error:
            raise _refused(self.path, error) from error

    def append(self, record: Record) -> None:
        """Put one more record on disk; LinkError if that fails, and from then on always."""
        if self._broken:
            raise LinkError(self._broken)
        line = encode_record(self._sequence, record)
        try:
            self._write(line)
            self.disk.sync(self._descriptor)
        except OSError as error:
            failure = _refused(self.path, error)
            self._broken = failure.message
            raise failure from error
        self._sequence += 1
        self._end += len(line)

    def close(self) -> None:
        """Give unused reserved space back; a second call does nothing."""
        if self._descriptor >= 0:
            try:
                os.ftruncate(self._descriptor, self._end)
            finally:
                self._give_back()

    @contextmanager
    def _closed_on_error(self) -> Iterator[None]:
        try:
            yield
        except OSError as error:
            self._give_back()
            raise _refused(self.path, error) from error
        except BaseException:
            self._give_back()
            raise

    def _give_back(self) -> None:
        os.close(self._descriptor)
        self._descriptor = -1
        if self._lock >= 0:
            os.close(self._lock)

    def _write(self, line: bytes) -> None:
        done = 0
        while done < len(line):
            taken = self.disk.write(self._descriptor, line[done:], self._end + done)
            if taken <= 0:
                raise OSError(errno.EIO, "the disk took nothing")
            done += taken


class ReopenedJournal(Journal):
    """The record of a run that was broken off, opened to be gone on with; `records` is what it holds already."""

    def __init__(self, run: Path, disk: Disk | None = None) -> None:
        """Open the record in the folder `run` and cut its torn end off.

        LinkError if another process has it open or the disk refuses, InvalidInput if there is none or it is damaged.
        """
        self.path = run / FILE_NAME
        self.disk = disk or SystemDisk()
        self._lock = -1
        self._broken = ""
        try:
            self._descriptor = os.open(self.path, os.O_WRONLY | portable.NO_WAIT | portable.PLAIN)
        except FileNotFoundError:
            raise InvalidInput(f"{run} holds no record of a run") from None
        except OSError as error:
            raise _refused(self.path, error) from error
        with self._closed_on_error():
            self._lock = lock_run(run)
            self.records, self._end = _checked_records(read_file(self.path, SIZE_LIMIT), self.path)
            self._sequence = len(self.records)
            os.ftruncate(self._descriptor, self._end)
            self.disk.sync(self._descriptor)


def encode_record(sequence: int, record: Record) -> bytes:
    """One line of a journal."""
    body = json.dumps(record, separators=(",", ":"), ensure_ascii=True).encode()
    if len(body) > BODY_LIMIT:
        raise InvalidInput("a record of the run is too long to be kept: the plan has too many steps")
    number = b"%08d" % sequence
    return b"%06d %s %08x %s\n" % (len(body), number, crc32(number + body), body)


def read_journal(path: Path) -> list[Mapping[str, Any]]:
    """All whole records of a journal; InvalidInput if one is damaged that others follow."""
    return _checked_records(read_file(path, SIZE_LIMIT), path)[0]


def runs_folder() -> Path:
    """Where runs are kept: CURVELINE_RUNS, or curveline in XDG_STATE_HOME, or ~/.local/state/curveline."""
    if chosen := os.environ.get("CURVELINE_RUNS"):
        return Path(chosen)
    state = os.environ.get("XDG_STATE_HOME")
    return (Path(state) if state else Path.home() / ".local" / "state") / "curveline"


def find_run(folder: Path, name: str) -> Path:
    """The folder of a run: a path, or a name in the runs folder; InvalidInput if there is none."""
    choices = [Path(name)] if os.sep in name else [folder / name, Path(name)]
    found = next((run for run in choices if os.path.isfile(run / FILE_NAME)), None)
    if found is None:
        raise InvalidInput(f"there is no run {name!r} in {folder}", hint="`curveline runs` lists those that there are")
    return found


def new_run(folder: Path, name: str) -> Path:
    """A new folder for one run, named by its number, local time and `name`; LinkError if it cannot be made."""
    label = re.sub(r"[^A-Za-z0-9._-]+", "-", name).strip("-.")[:60] or "run"
    stamp = time.strftime("%Y%m%d-%H%M%S")
    try:
        run = claim_folder(folder, f"{stamp}-{label}")
        portable.sync_folder(folder)
    except OSError as error:
        raise _refused(folder, error) from error
    return run


def is_open(run: Path) -> bool:
    """Whether a process has the record of a run open, to send it."""
    try:
        descriptor = os.open(run / LOCK_NAME, os.O_RDWR | portable.NO_WAIT)
    except OSError:
        return False
    try:
        return not portable.lock(descriptor)
    except OSError:
        return False
    finally:
        os.close(descriptor)


def lock_run(run: Path) -> int:
    """Keep other processes away from a run for as long as this descriptor is open; LinkError if one has it."""
    descriptor = os.open(run / LOCK_NAME, os.O_RDWR | os.O_CREAT | portable.NO_WAIT, 0o644)
    try:
        for _ in range(LOCK_TRIES):
            if portable.lock(descriptor):
                return descriptor
            time.sleep(LOCK_RETRY_S)
    except OSError:
        os.close(descriptor)
        raise
    os.close(descriptor)
    raise LinkError(
        f"another process is sending the run {run.name}", "only one host may send a run; wait until it has ended"
    )


def _refused(path: Path, error: OSError) -> LinkError:
    return LinkError(
        f"cannot write {path}: {error.strerror or error}",
        hint="free space on that disk, or set CURVELINE_RUNS to another folder",
    )


def _checked_records(data: bytes, path: Path) -> tuple[list[Mapping[str, Any]], int]:
    """Whole records and where they end; InvalidInput if there is a gap with records behind it."""
    records, offset = _whole_records(data)
    if _holds_record(data, offset):
        raise InvalidInput(
            f"{path} is damaged: record {len(records) + 1} cannot be read, but later ones can",
            hint="this run cannot be trusted any more; send the shape again from where the display stands",
        )
    return records, offset


def _whole_records(data: bytes) -> tuple[list[Mapping[str, Any]], int]:
    """Records from the start on, up to the first that is not whole, and where that one begins."""
    records: list[Mapping[str, Any]] = []
    offset = 0
    while (found := _record_at(data, offset)) is not None and found[0] == len(records):
        records.append(found[1])
        offset = found[2]
    return records, offset


def _record_at(data: bytes, offset: int) -> tuple[int, Mapping[str, Any], int] | None:
    """(sequence, record, where the next one begins), or None if there is no whole record."""
    head = HEAD.match(data, offset)
    if head is None:
        return None
    end = offset + HEAD_BYTES + int(head[1])
    body = data[offset + HEAD_BYTES : end]
    if data[end : end + 1] != b"\n" or crc32(head[2] + body) != int(head[3], 16):
        return None
    try:
        record = json.loads(body)
    except (ValueError, RecursionError):
        return None
    return (int(head[2]), record, end + 1) if isinstance(record, dict) else None


def _holds_record(data: bytes, offset: int) -> bool:
    """Whether a whole record begins anywhere from `offset` on, or heads lie over each other as no crash leaves them.

    Records do not overlap, so those that end where they say take no more than there is: what takes more was forged,
    and would take time without end to look through.
    """
    left = len(data) - offset
    for head in HEAD.finditer(data, offset):
        end = head.end() + int(head[1])
        if data[end : end + 1] != b"\n":
            continue
        left -= end - head.start()
        if left < 0 or _record_at(data, head.start()) is not None:
            return True
    return False

"""What a mock display remembers between invocations: a small file, read with suspicion, and a lock on it."""

from __future__ import annotations

import json
import os
import re
import sys
import time
from collections.abc import Mapping
from dataclasses import asdict, dataclass, field, fields
from pathlib import Path
from typing import Any

from curveline.drive_settings import DriveSettings
from curveline.errors import LinkError
from curveline.radio.interface import InUse
from curveline.radio.mock.board import Board, KeyRing, board_of
from curveline.radio.node.state import HOMED, NOWHERE, Memory, Reasons
from curveline.radio.protocol.codes import AXIS_COUNT, REASONS, TARGET_LIMIT, BootCause, Counts, Fault
from curveline.system import portable

FORMAT = 4
WITHOUT_PROGRAMS = 3
"""The format of releases before, whose boards forgot their program between commands."""
WITHOUT_BOARDS = 2
"""The format of older releases, whose boards held whatever the display file said."""
LOCK_WAIT_S = 10.0
LOCK_RETRY_S = 0.05
SIZE_LIMIT = 20_000_000
"""Each of 250 nodes may have got all but the last sector of a program."""
BITS = {"boot": 24, "run_tag": 64, "noise": 32, "offers": 32, "move_ms": 32, "homing": 3}
"""Width of the numbers in a node's memory that are not 16 bits wide."""
FRESH_HINT = "`--radio mock:fresh` puts a new display there, standing at home"


@dataclass
class Standing:
    """One node as it stands: encoder counts, what the node remembers, its board; without one, a board just flashed."""

    counts: Counts = (0, 0, 0)
    memory: Memory = field(default_factory=Memory)
    board: Board | None = None


@dataclass
class MockState:
    """The whole mock display; `rod` names the state each segment was last seen in, empty when unknown.

    `rod_at` is where the nodes were when it was seen.
    """

    nodes: list[Standing]
    rod: list[str] = field(default_factory=list)
    rod_at: list[Counts] = field(default_factory=list)

    @property
    def known_rod(self) -> tuple[str, ...]:
        """The states of the rod, none if a node has moved since it was seen."""
        return tuple(self.rod) if self.rod_at == [node.counts for node in self.nodes] else ()


def file_label(display: str) -> str:
    """What the files of a display are called after its name."""
    return re.sub(r"[^A-Za-z0-9._-]", "_", display) or "_"


def state_at_home(count: int, *, unhomed: bool = False) -> MockState:
    """A display at home, which its nodes know unless they are `unhomed`."""
    return MockState([Standing(memory=Memory(unhomed=NOWHERE if unhomed else HOMED)) for _ in range(count)])


class Store:
    """The file of one mock display in the runs folder."""

    def __init__(self, runs: Path, drive: DriveSettings) -> None:
        name = file_label(drive.display)
        self.path = runs / f"mock-{name}.json"
        self._lock_path = runs / f"mock-{name}.lock"
        self._owner_path = runs / f"mock-{name}.owner"
        self._drive = drive
        self._lock: int | None = None

    def open(self) -> None:
        """Lock the display for this process; LinkError if another one keeps it for 10 s."""
        try:
            self.path.parent.mkdir(parents=True, exist_ok=True)
            self._lock = os.open(self._lock_path, os.O_RDWR | os.O_CREAT, 0o644)
            self._take()
        except BaseException as error:
            self.close()
            if isinstance(error, OSError):
                raise _unusable(self._lock_path, error) from error
            raise

    def _take(self) -> None:
        """Wait for the lock, and say who has it now: not in the locked file, which on Windows nobody else can read."""
        assert self._lock is not None
        deadline = time.monotonic() + LOCK_WAIT_S
        while not portable.lock(self._lock):
            if time.monotonic() > deadline:
                raise InUse(
                    f"the mock display {self._drive.display!r} is in use by {self._owner()}: a run may be on",
                    hint="wait until it is done, or use another runs folder (CURVELINE_RUNS)",
                )
            time.sleep(LOCK_RETRY_S)
        name = Path(sys.argv[0]).name or "python"
        self._owner_path.write_text(f"process {os.getpid()} ({name})", encoding="utf-8", errors="replace")

    def _owner(self) -> str:
        try:
            with self._owner_path.open(encoding="utf-8", errors="replace") as file:
                owner = file.read(200).strip()
        except OSError:
            owner = ""
        return owner if owner.isprintable() and owner else "another process"

    def close(self) -> None:
        """Give the lock back."""
        if self._lock is not None:
            os.close(self._lock)
            self._lock = None

    def load(self, ring: KeyRing) -> MockState:
        """The display as it was left, at home if it has never been used; LinkError if the file cannot be trusted.

        `ring` has the keys of its boards.
        """
        try:
            if self.path.stat().st_size > SIZE_LIMIT:
                raise _damaged(self.path, "it is far too large")
            text = self.path.read_bytes().decode("utf-8")
            return _checked(json.loads(text), self._drive, ring)
        except FileNotFoundError:
            return state_at_home(self._drive.node_count)
        except OSError as error:
            raise _unusable(self.path, error) from error
        except RecursionError:
            raise _damaged(self.path, "it is nested without end") from None
        except (ValueError, TypeError, KeyError) as error:
            raise _damaged(self.path, str(error)) from error

    def save(self, state: MockState) -> None:
        """Replace the file in one go."""
        content = {
            "format": FORMAT,
            "display": self._drive.display,
            "nodes": [_plain(node) for node in state.nodes],
            "rod": state.rod,
            "rod_at": state.rod_at,
        }
        partial = self.path.with_suffix(".part")
        try:
            partial.write_text(json.dumps(content) + "\n", encoding="utf-8")
            portable.replace(partial, self.path)
        except OSError as error:
            raise _unusable(self.path, error) from error


def _unusable(path: Path, error: OSError) -> LinkError:
    reason = error.strerror or str(error)
    return LinkError(
        f"cannot use {path}: {reason}",
        hint="free space on that disk, or set CURVELINE_RUNS to a folder that can be written",
    )


def _damaged(path: Path, why: str) -> LinkError:
    return LinkError(f"the state of the mock display in {path} is damaged: {why}", hint=FRESH_HINT)


def _plain(node: Standing) -> dict[str, Any]:
    board = {} if node.board is None else {"board": node.board.document()}
    return {"counts": node.counts, **asdict(node.memory), **board}


def _checked(content: Any, drive: DriveSettings, ring: KeyRing) -> MockState:
    """A display out of parsed JSON; ValueError, TypeError or KeyError say what is wrong with it."""
    if not isinstance(content, dict) or content.get("format") not in (FORMAT, WITHOUT_PROGRAMS, WITHOUT_BOARDS):
        raise ValueError("it is of another release of curveline")
    if content["format"] == WITHOUT_BOARDS and content["counts_per_unit"] != [
        axis.counts_per_unit for axis in drive.axes
    ]:
        raise ValueError("its motors differ from those of the display file")
    nodes, rod = content["nodes"], content["rod"]
    if not isinstance(nodes, list) or len(nodes) != drive.node_count:
        raise ValueError(f"it does not have {drive.node_count} nodes")
    if not isinstance(rod, list) or not all(isinstance(name, str) for name in rod):
        raise ValueError("the states of its rod are not names")
    rod_at = content.get("rod_at", [])
    if not isinstance(rod_at, list):
        raise ValueError("where its rod was seen is not a list")
    return MockState([_standing(node, ring) for node in nodes], rod, [_counts(each) for each in rod_at])


def _standing(content: Mapping[str, Any], ring: KeyRing) -> Standing:
    values = dict(content)
    board = board_of(values.pop("board"), ring) if "board" in values else None
    counts = _counts(values.pop("counts"))
    known = {each.name for each in fields(Memory)}
    if values.keys() != known:
        raise ValueError("a node has missing or unknown entries")
    for name in ("target", "next_target"):
        values[name] = _counts(values[name])
    if not isinstance(values["estop"], bool):
        raise ValueError("estop is neither true nor false")
    if type(values["fault_ms"]) is not int or not -(2**53) < values["fault_ms"] <= 0:
        raise ValueError("fault_ms is not a whole number of the past")
    if values["homing"] != 0:
        raise ValueError("a node is finding its zeros although nobody is there")
    values["unhomed"] = _reasons(values["unhomed"])
    for name in known - {"target", "next_target", "unhomed", "fault_ms", "estop"}:
        if type(values[name]) is not int or not 0 <= values[name] < 2 ** BITS.get(name, 16):
            raise ValueError(f"{name} is not a whole number in its range")
    if values["fault_axis"] > AXIS_COUNT:
        raise ValueError("there is no such axis to be in fault")
    values["fault"], values["cause"] = Fault(values["fault"]), BootCause(values["cause"])
    return Standing(counts, Memory(**values), board)


def _reasons(value: Any) -> Reasons:
    if not isinstance(value, list) or len(value) != 3 or not all(type(each) is int for each in value):
        raise ValueError("what keeps axes from being homed is not three numbers")
    if not REASONS.issuperset(value):
        raise ValueError("what keeps an axis from being homed has no meaning")
    return value[0], value[1], value[2]


def _counts(value: Any) -> Counts:
    if not isinstance(value, list) or len(value) != 3:
        raise ValueError("a position is not three numbers")
    for each in value:
        if type(each) is not int or abs(each) > TARGET_LIMIT:
            raise ValueError("a position is not in whole counts within reach")
    return value[0], value[1], value[2]

"""Commands in processes of their own, as a user starts them: how long they take, and what memory."""

from __future__ import annotations

import os
import subprocess
import sys
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

from curveline.bench.measurement import Measurement
from curveline.bench.methods.stopwatch import Timed

COMMAND = (sys.executable, "-m", "curveline")
APART = ("CURVELINE_RADIO", "CURVELINE_KEYS")
"""Settings of a user's that must not count."""
HUSH = subprocess.DEVNULL


@dataclass(frozen=True)
class ProcessTime:
    """What a process took, all that it started included [s]."""

    wall: float
    processor: float


def apart(folder: str, **more: str) -> dict[str, str]:
    """The environment of commands whose records of runs go to `folder`."""
    kept = {name: value for name, value in os.environ.items() if name not in APART}
    return {**kept, "CURVELINE_RUNS": str(Path(folder) / "runs"), **more}


def spent(command: Sequence[str], environment: Mapping[str, str]) -> ProcessTime:
    """What one process takes; CalledProcessError if it fails."""
    begin, before = time.perf_counter(), _of_children()
    subprocess.run(command, env=environment, stdin=HUSH, stdout=HUSH, stderr=HUSH, check=True)
    return ProcessTime(time.perf_counter() - begin, _of_children() - before)


def _of_children() -> float:
    found = os.times()
    return found.children_user + found.children_system


def shortest(command: Sequence[str], environment: Mapping[str, str], repeats: int = 3) -> Timed:
    """Wall time of a command over some repeats."""
    found = sorted((spent(command, environment) for _ in range(repeats)), key=lambda each: each.wall)
    return Timed.of([each.wall for each in found], found[0].processor)


def peak_memory(command: Sequence[str], environment: Mapping[str, str]) -> float:
    """Largest resident memory of a command [MB]; asked by a small process, as a fork counts what its parent holds."""
    ask = (
        "import resource, subprocess, sys; hush = subprocess.DEVNULL; "
        "subprocess.run(sys.argv[1:], stdin=hush, stdout=hush, stderr=hush, check=True); "
        "print(resource.getrusage(resource.RUSAGE_CHILDREN).ru_maxrss)"
    )
    done = subprocess.run([sys.executable, "-c", ask, *command], env=environment, capture_output=True, check=True)
    return int(done.stdout) / (1e6 if sys.platform == "darwin" else 1e3)


def unless_it_fails(row: Measurement, measured: Callable[[], tuple[float, float | None]]) -> Measurement:
    """The figure with the value and the spread that are measured, or without, saying so, if a command of it fails."""
    try:
        value, spread = measured()
    except subprocess.CalledProcessError as error:
        return replace(row, how=f"failed: exit code {error.returncode}")
    return replace(row, value=value, spread=spread)

"""Whole commands as a user waits for them: help, a batch of shapes, the first run; and their memory."""

from __future__ import annotations

import math
import os
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from pathlib import Path

from curveline.bench.measurement import Measurement


def rows(paths: list[str]) -> Iterator[Measurement]:
    """Help, all shape files, the first run with an empty kernel cache; peak memory."""
    command = [sys.executable, "-m", "curveline"]
    bare = _wall([sys.executable, "-c", "import typer"], dict(os.environ))
    shown = _wall([*command, "--help"], dict(os.environ))
    yield Measurement("curveline --help", shown, "s", "< 0.3", "wall, best of 5")
    yield Measurement("help over bare Python with typer", shown / bare, "x", "< 3", "same run")
    warm = _wall([*command, "simulate", "--json", *paths], dict(os.environ))
    yield Measurement(f"simulate {len(paths)} files, warm", warm, "s", "< 1.5", "with start-up, best of 5")
    memory = _peak_memory([*command, "simulate", "--json", *paths], dict(os.environ))
    yield Measurement("its peak memory", memory, "MB", "< 200", "resident")
    with tempfile.TemporaryDirectory() as folder:
        fresh = {**os.environ, "CURVELINE_CACHE": str(Path(folder) / "cache")}
        first = _wall([*command, "simulate", "--json", paths[0]], fresh, repeats=1)
    yield Measurement("first run, empty kernel cache", first, "s", "< 2", "wall")


def _wall(command: list[str], environment: dict[str, str], repeats: int = 5) -> float:
    """Shortest wall time of a command [s]."""
    best = math.inf
    for _ in range(repeats):
        begin = time.perf_counter()
        subprocess.run(command, env=environment, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL, check=True)
        best = min(best, time.perf_counter() - begin)
    return best


def _peak_memory(command: list[str], environment: dict[str, str]) -> float:
    """Largest resident memory of a command [MB]; asked by a small process, as a fork counts what its parent holds."""
    ask = (
        "import resource, subprocess, sys; hush = subprocess.DEVNULL; "
        "subprocess.run(sys.argv[1:], stdout=hush, stderr=hush, check=True); "
        "print(resource.getrusage(resource.RUSAGE_CHILDREN).ru_maxrss)"
    )
    done = subprocess.run([sys.executable, "-c", ask, *command], env=environment, capture_output=True, check=True)
    return int(done.stdout) / (1e6 if sys.platform == "darwin" else 1e3)

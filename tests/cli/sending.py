"""A send in a process of its own, to be interrupted, watched and killed."""

from __future__ import annotations

import os
import subprocess
import sys
import time
from collections.abc import Sequence
from pathlib import Path

from curveline.plan_file import write_plan

from .conftest import Result, small_plan

LIMIT_S = 30.0


class Sending:
    """A send of some steps, begun by `python`; its stderr goes to a file, where it can be watched."""

    def __init__(
        self, folder: Path, radio: str, seconds: float, steps: int, python: Sequence[str] = (sys.executable,)
    ) -> None:
        write_plan(small_plan(steps=steps, seconds=seconds), folder / "plan.json")
        self._said = folder / "said"
        with self._said.open("w") as said:
            self.process = subprocess.Popen(
                [*python, "-m", "curveline", "send", "plan.json", "--radio", radio, "--yes", "--json"],
                cwd=folder,
                env={**os.environ, "CURVELINE_RUNS": str(folder / "runs")},
                stdout=subprocess.PIPE,
                stderr=said,
                text=True,
            )

    def wait_for(self, words: str) -> None:
        """Return once these words have been said."""
        deadline = time.monotonic() + LIMIT_S
        while words not in self._said.read_text():
            assert time.monotonic() < deadline, f"{words!r} was not said"
            time.sleep(0.02)

    def kill(self) -> None:
        """End it without a chance to say a word."""
        self.process.kill()
        self.process.wait()
        assert self.process.stdout is not None
        self.process.stdout.close()

    def end(self) -> Result:
        """Wait for the end."""
        out, _ = self.process.communicate(timeout=LIMIT_S)
        return Result(self.process.returncode, out, self._said.read_text())

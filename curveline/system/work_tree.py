"""Whether a file with a secret lies where the next commit would take it along."""

from __future__ import annotations

import subprocess
from pathlib import Path

NOT_IGNORED = 1
"""Exit code of `git check-ignore` for a file of a work tree that nothing ignores; outside of work trees it is 128."""
MOST_SECONDS = 5.0


def would_be_committed(path: Path) -> bool:
    """True if a file lies in a git work tree that does not ignore it; False, too, where there is no git to ask."""
    folder = path.absolute().parent
    # A repository may name a program that watches its files, and this is no reason to run it.
    command = ["git", "-c", "core.fsmonitor=false", "-C", str(folder), "check-ignore", "--quiet", "--", path.name]
    try:
        done = subprocess.run(command, capture_output=True, stdin=subprocess.DEVNULL, timeout=MOST_SECONDS, check=False)
    except (OSError, subprocess.TimeoutExpired):
        return False
    return done.returncode == NOT_IGNORED

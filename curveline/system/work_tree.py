"""What git says: whether a file with a secret would be committed, and which commit a clone stands at."""

from __future__ import annotations

import subprocess
from pathlib import Path

NOT_IGNORED = 1
"""Exit code of `git check-ignore` for a file of a work tree that nothing ignores; outside of work trees it is 128."""
MOST_SECONDS = 5.0


def would_be_committed(path: Path) -> bool:
    """True if a file lies in a git work tree that does not ignore it; False, too, where there is no git to ask."""
    done = _asked(path.absolute().parent, "check-ignore", "--quiet", "--", path.name)
    return done is not None and done.returncode == NOT_IGNORED


def commit_of(folder: Path) -> str | None:
    """The commit of a clone, with a + if tracked files differ from it; None if the folder itself is no clone."""
    if not (folder / ".git").exists():  # as a folder within somebody else's clone
        return None
    commit, changes = _asked(folder, "rev-parse", "HEAD"), _asked(folder, "status", "--porcelain", "-uno")
    if commit is None or changes is None or commit.returncode or changes.returncode:
        return None
    return commit.stdout.decode().strip() + ("+" if changes.stdout.strip() else "")


def _asked(folder: Path, *words: str) -> subprocess.CompletedProcess[bytes] | None:
    """What git says in a folder; None where there is none to ask."""
    # A repository may name a program that watches its files, and this is no reason to run it.
    command = ["git", "--no-optional-locks", "-c", "core.fsmonitor=false", "-C", str(folder), *words]
    try:
        return subprocess.run(command, capture_output=True, stdin=subprocess.DEVNULL, timeout=MOST_SECONDS, check=False)
    except (OSError, subprocess.TimeoutExpired):
        return None

"""What is said of a file with the site's key that the next commit might publish."""

from __future__ import annotations

from pathlib import Path

from curveline.cli.printing import screen


def warn_of_commits(path: Path) -> None:
    """A note if a file that holds the site's key lies in a git work tree that does not ignore it."""
    from curveline.system.work_tree import would_be_committed

    if would_be_committed(path):
        pattern = f"*{path.suffix}" if path.suffix == ".hex" else path.name
        screen.note(
            f"warning: {path} holds the site's key, and the git work tree that it lies in does not ignore it: "
            f"add a line {pattern} to its .gitignore, or keep it elsewhere"
        )

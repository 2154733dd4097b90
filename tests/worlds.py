"""Commands in a world of their own, in which some folders are other than they are; it leaves no trace."""

from __future__ import annotations

import os
import subprocess
from collections.abc import Sequence
from functools import cache

import pytest

UNSHARE = ("unshare", "-m") if os.geteuid() == 0 else ("unshare", "-rm")
READ_ONLY = 'mount --bind "{0}" "{0}" && mount -o remount,ro,bind "{0}"'
FULL = 'mount -t tmpfs -o size=16k none "{0}" && (head -c 1000000 /dev/zero > "{0}/rest" 2>&- || true)'


@cache
def _can_mount() -> bool:
    command = [*UNSHARE, "sh", "-c", "mount -t tmpfs none /mnt"]
    return subprocess.run(command, capture_output=True, check=False).returncode == 0


def in_a_world(changes: Sequence[str], command: Sequence[str]) -> list[str]:
    """A command after some mounts that only it sees; the test is skipped where this user may mount nothing."""
    if not _can_mount():
        pytest.skip("mounts are not permitted here")
    return [*UNSHARE, "sh", "-c", " && ".join([*changes, 'exec "$@"']), "sh", *command]

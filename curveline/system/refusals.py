"""What the operating system refused and nobody foresaw, in words: what, where, and what may help."""

from __future__ import annotations

import errno
import os
from pathlib import Path
from traceback import extract_tb

PACKAGE = Path(__file__).parents[1]
GONE = "the current folder does not exist any more"
LAST_RESORT = "see that the folders and disks in use can be written and have room, then try again"
FOLDERS = "name another place: CURVELINE_RUNS for runs, CURVELINE_CACHE for kernels, CURVELINE_KEYS for keys"
HINTS = {
    errno.ENOSPC: f"free space on that disk, or {FOLDERS}",
    errno.EDQUOT: f"your quota on that disk is used up: free space, or {FOLDERS}",
    errno.EFBIG: f"files may not get so large there (`ulimit -f`): allow it, or {FOLDERS}",
    errno.EROFS: f"that disk can only be read: {FOLDERS}",
    errno.EACCES: f"see who may read and write there, or {FOLDERS}",
    errno.EPERM: f"see who may read and write there, or {FOLDERS}",
    errno.EMFILE: "allow a process more open files (`ulimit -n 256`), or choose fewer --jobs",
    errno.ENFILE: "the whole computer has too many files open: close some programs",
    errno.EAGAIN: "the computer allows no more processes: close some programs, or choose fewer --jobs",
    errno.ENOMEM: "memory is short: close some programs, or choose fewer --jobs",
    errno.EIO: f"the disk may be failing: look at the system's log, or {FOLDERS}",
}


def message_of(error: OSError) -> str:
    """One sentence on what was refused and where: the path if the system named one, else the place in this package."""
    if _is_nowhere(error):
        return GONE
    what = error.strerror or str(error) or type(error).__name__
    paths = [os.fsdecode(name) for name in (error.filename, error.filename2) if isinstance(name, str | bytes)]
    return f"the system refused what is needed: {what}: {' to '.join(paths) or _place_of(error)}"


def hint_of(error: OSError) -> str:
    """What to do about it."""
    if _is_nowhere(error):
        return "change to a folder that exists, with cd"
    if "temporary directory" in str(error):
        return "set TMPDIR to a folder that can be written"
    return HINTS.get(error.errno or 0, LAST_RESORT)


def _is_nowhere(error: OSError) -> bool:
    """Whether something is missing because the current folder is."""
    if isinstance(error, FileNotFoundError):
        try:
            os.getcwd()
        except FileNotFoundError:
            return True
    return False


def _place_of(error: OSError) -> str:
    """The innermost line of this package on the way to the error."""
    ours = [frame for frame in extract_tb(error.__traceback__) if PACKAGE in Path(frame.filename).parents]
    return f"in {Path(ours[-1].filename).relative_to(PACKAGE.parent)}, line {ours[-1].lineno}" if ours else "in Python"

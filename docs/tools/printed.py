"""Runs what README.md and the pages print, and holds what comes out against what stands there.

    python docs/tools/printed.py             # what differs, page by page
    python docs/tools/printed.py --write     # puts in what is printed now

Blocks of a page run in its order, in a folder that looks like a fresh clone: `sh` as a script, `python` as a program,
and of `console` every line that begins with `$ `, whose standard output follows it. Other blocks are text. What stands
on the line before a block changes that:

    <!-- file NAME -->    text that is saved under this name
    <!-- exit N -->       another exit code than 0; of a console the error output follows, too
    <!-- slow -->         takes a minute
    <!-- not run -->      needs what is not there, such as a real display
    <!-- goes on -->      a program that goes on with the one before it, as the cells of a notebook do

On a line of its own, `<!-- radio SPEC -->` says what stands for the radio of whoever reads, from there on: commands
without one use it.
"""

from __future__ import annotations

import argparse
import os
import re
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

ROOT = Path(__file__).parents[2]
PAGES = [ROOT / "README.md", ROOT / "CONTRIBUTING.md", *sorted((ROOT / "docs").rglob("*.md"))]
BLOCK = re.compile(
    r"(?:^<!-- (?P<note>[^\n]+) -->\n)?^```(?P<kind>\w+)[^\n]*\n(?P<text>.*?)^```$", re.DOTALL | re.MULTILINE
)
RADIO = re.compile(r"^<!-- radio (?P<spec>\S+) -->\n", re.MULTILINE)
INSTALLING = "pip install"
GOES_ON = "goes on"
LONGEST = 300
"""Seconds that a block may take."""

PYTHON = [sys.executable]
"""What a program of a page is given to."""

COMMANDS = Path(sys.executable).parent
"""The folder in which the shell finds the commands first."""

CACHE = "CURVELINE_CACHE"
"""The one setting of whoever runs this that counts: kernels that are compiled already."""

DRAWN = re.compile(r"[⠀-⣿]")
VARIES = re.compile(
    r"[\d.]+ (?:ms\b|us\b|s on \d+ process(?:es)?|[a-z]+ per second)|^[\d.]+ s$"
    r"|\d{4}-\d\d-\d\d \d\d:\d\d:\d\d|\d{6}-\d{8}-\d{6}|process \d+|^\d\d:\d\d:\d\d$|master key [0-9a-f]{8}",
    re.MULTILINE,
)
"""What depends on the machine and the day: the time of a computation, dates, names of runs, processes, keys."""
PASSING = re.compile(r"^compiling .*\n", re.MULTILINE)
"""What is said on some machines and not on others, of kernels that are new there."""
CLOSE = 0.05
"""By what part numbers may differ, as those near nothing do from one machine to another."""


class Block(NamedTuple):
    """A block of a page: what kind, what stands in it, where it lies in the page, and what stands for a radio."""

    kind: str
    text: str
    note: str
    span: tuple[int, int]
    radio: str = ""

    @property
    def exit_code(self) -> int:
        """The exit code that the page promises."""
        return int(self.note.split()[1]) if self.note.startswith("exit") else 0

    @property
    def is_run(self) -> bool:
        """True for what runs everywhere, and soon."""
        runs = self.kind in ("sh", "console", "python") or self.note.startswith("file")
        return runs and self.note not in ("slow", "not run")


class Printed(NamedTuple):
    """What a block did: its exit code, what it wrote, and for a console what its text should be."""

    code: int
    out: str
    err: str
    text: str


def blocks(page: Path) -> list[Block]:
    """All blocks of a page that have a kind."""
    text = page.read_text(encoding="utf-8")
    radios = [(each.end(), each["spec"]) for each in RADIO.finditer(text)]

    def radio(at: int) -> str:
        return next((spec for end, spec in reversed(radios) if end <= at), "")

    found = BLOCK.finditer(text)
    return [
        Block(*each.group("kind", "text"), each["note"] or "", each.span("text"), radio(each.start())) for each in found
    ]


def clone(folder: Path) -> Path:
    """A folder with what commands look for in a fresh clone."""
    shutil.copytree(ROOT / "shapes", folder / "shapes")
    shutil.copytree(ROOT / "docs" / "tools", folder / "docs" / "tools", ignore=shutil.ignore_patterns("__pycache__"))
    shutil.copytree(ROOT / "firmware", folder / "firmware", ignore=shutil.ignore_patterns("build"))
    return folder


def run(block: Block, folder: Path) -> Printed:
    """Run a block in `folder`, where its records and keys are kept, too."""
    if block.note.startswith("file"):
        (folder / block.note.split()[1]).write_text(block.text, encoding="utf-8")
        return Printed(0, "", "", "")
    if block.kind == "console":
        return _console(block, folder)
    if block.kind == "python":
        return _process([*PYTHON, "-c", block.text], folder, block.radio)
    lines = "".join(line for line in block.text.splitlines(keepends=True) if not line.startswith(INSTALLING))
    return _process(["bash", "-e", "-c", lines], folder, block.radio)


def _console(block: Block, folder: Path) -> Printed:
    """Every command of a console, up to the first that fails; its code and error output, or those of the last one."""
    text, out, done = "", "", Printed(0, "", "", "")
    for command in re.findall(r"^\$ (.*\n(?:> .*\n)*)", block.text, re.MULTILINE):
        done = _process(["bash", "-e", "-c", command.replace("\n> ", "\n")], folder, block.radio)
        shown = done.out + (PASSING.sub("", done.err) if block.exit_code else "")
        text, out = f"{text}$ {command}{shown.replace(f'{folder}/', '').rstrip()}".rstrip() + "\n", out + done.out
        if done.code:
            break
    return Printed(done.code, out, done.err, text)


def _process(command: list[str], folder: Path, radio: str) -> Printed:
    apart = {name: value for name, value in os.environ.items() if not name.startswith("CURVELINE_") or name == CACHE}
    environment = {
        **apart,
        "CURVELINE_RUNS": "runs",
        "CURVELINE_KEYS": "site.json",
        "COLUMNS": "80",
        **({"CURVELINE_RADIO": radio} if radio else {}),
        "PATH": f"{COMMANDS}{os.pathsep}{os.environ['PATH']}",
    }
    done = subprocess.run(
        command, cwd=folder, env=environment, capture_output=True, text=True, timeout=LONGEST, check=False
    )
    return Printed(done.returncode, done.stdout, done.stderr, "")


def differences(block: Block, printed: Printed) -> list[str]:
    """What a block did otherwise than its page says, line by line; times and rounding do not count."""
    if printed.code != block.exit_code:
        return [f"exit code {printed.code} instead of {block.exit_code}: {block.text.strip()}", printed.err]
    if "Traceback" in printed.err:
        return [printed.err]
    if block.kind != "console":
        return []
    before, now = _comparable(block.text), _comparable(printed.text)
    found = [f"- {one}\n+ {other}" for one, other in zip(before, now, strict=False) if not _is_same(one, other)]
    return found + [f"- {line}" for line in before[len(now) :]] + [f"+ {line}" for line in now[len(before) :]]


def _comparable(text: str) -> list[str]:
    """The lines of a text without what differs from run to run, and without drawings."""
    return [line for line in VARIES.sub("VARIES", text).splitlines() if line.strip() and not DRAWN.search(line)]


def _is_same(one: str, other: str) -> bool:
    words, others = one.split(), other.split()
    return len(words) == len(others) and all(map(_is_close, words, others))


def _is_close(one: str, other: str) -> bool:
    try:
        first, second = float(one), float(other)
    except ValueError:
        return one == other
    return first == second or abs(first - second) <= CLOSE * max(abs(first), abs(second))


def reports(page: Path) -> Iterator[tuple[Block, Printed]]:
    """Run every block of a page that runs everywhere, one program of all cells that follow each other."""
    with tempfile.TemporaryDirectory() as name:
        folder = clone(Path(name))
        for block in joined([each for each in blocks(page) if each.is_run]):
            yield block, run(block, folder)


def joined(found: list[Block]) -> Iterator[Block]:
    """Blocks in their order; a cell with all before it, and only the last of several that follow each other."""
    program = ""
    for block, after in zip(found, [*found[1:], None], strict=True):
        if block.kind != "python":
            yield block
            continue
        program = program + block.text if block.note == GOES_ON else block.text
        if after is None or after.kind != "python" or after.note != GOES_ON:
            yield block._replace(text=program)


def rewritten(page: Path) -> str:
    """The text of a page in which every console says what is printed now; SystemExit for a command that fails."""
    text = page.read_text(encoding="utf-8")
    changes = [(block, printed) for block, printed in reports(page) if differences(block, printed)]
    for block, printed in changes:
        if block.kind != "console" or printed.code != block.exit_code:
            sys.exit(f"{page}: " + "\n".join(differences(block, printed)))
    for block, printed in reversed(changes):
        text = text[: block.span[0]] + printed.text + text[block.span[1] :]
    return text


def main() -> None:
    """Say what differs, or write it."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--write", action="store_true")
    parser.add_argument("pages", nargs="*", type=Path, default=PAGES)
    asked = parser.parse_args()
    for page in asked.pages:
        if asked.write:
            page.write_text(rewritten(page), encoding="utf-8")
            continue
        for block, printed in reports(page):
            for line in differences(block, printed):
                print(f"{page}: {line}")


if __name__ == "__main__":
    main()

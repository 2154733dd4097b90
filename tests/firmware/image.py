"""Builds the node program the way a lab does, with `make`, and reads what came out."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

from .build import FIRMWARE, compiler_environment
from .machine import Image, read_image

BUILD_LIMIT_S = 300


def make(folder: Path, *arguments: str) -> subprocess.CompletedProcess[str]:
    """Run make in `firmware/` with products in `folder`."""
    command = ["make", "-C", str(FIRMWARE), f"PYTHON={sys.executable}", f"BUILD={folder}", *arguments]
    return subprocess.run(
        command, env=compiler_environment(), capture_output=True, text=True, check=False, timeout=BUILD_LIMIT_S
    )


def build_image(folder: Path) -> Image:
    """The node program, built into `folder`."""
    done = make(folder)
    assert done.returncode == 0, done.stdout + done.stderr
    return read_image(folder / "node.elf")

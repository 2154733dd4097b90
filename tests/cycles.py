"""Prints how many cycles the node program takes for its tags and its control loop: `python tests/cycles.py`."""

from __future__ import annotations

from pathlib import Path
from tempfile import TemporaryDirectory

from firmware.conftest import home_flash
from firmware.cycles import describe
from firmware.image import build_image
from firmware.test_cycles import metered_run


def main() -> None:
    """Build the image, let a node carry out a plan, count."""
    with TemporaryDirectory() as work:
        image = build_image(Path(work) / "build")
        print(describe(metered_run(image, home_flash(image), Path(work))))


if __name__ == "__main__":
    main()

"""The node program, built once for all tests that run it, and nodes that have found their zero once."""

from __future__ import annotations

from pathlib import Path

import pytest

from .fleet import STORE, Fleet, drive_table
from .image import Image, build_image, read_image


@pytest.fixture(scope="session")
def image_folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Where the build has put its products."""
    folder = tmp_path_factory.mktemp("node-image")
    build_image(folder)
    return folder


@pytest.fixture(scope="session")
def image(image_folder: Path) -> Image:
    """The node program."""
    return read_image(image_folder / "node.elf")


@pytest.fixture(scope="session")
def homed_flash(image: Image) -> bytes:
    """What a node has in its store after it was homed and left alone for a while."""
    return home_flash(image)


def home_flash(image: Image) -> bytes:
    """Home a node and see what it writes down."""
    fleet = Fleet(image, drive_table(1))
    fleet.home()
    (machine,) = fleet.machines
    assert machine.watchdog_resets == 0
    return bytes(machine.flash[STORE:])

"""What the node program costs in cycles, counted on the real image while a node carries out a plan."""

from __future__ import annotations

from pathlib import Path

import pytest

from curveline.drive_settings import EDGE_CYCLES

from .cycles import Meter, cost, describe, metered
from .display import Rig
from .image import Image

TAG_LIMIT = 8_000
FRAME_LIMIT = 36_000
"""Three quarters of a millisecond, for a HELLO, which makes a key."""
TICK_LIMIT = 9_600
"""A fifth of the millisecond."""
EDGE_LIMIT = 480
"""10 us: three axes at full speed bring an edge every 48 us."""


def metered_run(image: Image, flash: bytes, folder: Path) -> Meter:
    """One node's plan, counted."""
    rig = Rig(image, flash, folder, count=1)
    with metered(rig.machines[0]) as meter:
        rig.send()
    return meter


@pytest.mark.parametrize(
    ("code", "taken", "cycles"),
    [
        (0x1840, False, 1),  # adds
        (0x4348, False, 1),  # muls
        (0x6801, False, 2),  # ldr
        (0x4B02, False, 2),  # ldr, literal
        (0xB5F0, False, 6),  # push of five
        (0xBDF0, True, 8),  # pop of five, pc among them
        (0xBC30, False, 3),  # pop of two
        (0xC807, False, 4),  # ldm of three
        (0xD1FC, False, 1),  # bne, not taken
        (0xD1FC, True, 2),
        (0xE7FE, True, 2),
        (0x4770, True, 2),  # bx
        (0x1F000, True, 3),  # bl
    ],
)
def test_an_instruction_costs_what_the_core_takes(code: int, taken: bool, cycles: int) -> None:
    assert cost(code, taken=taken) == cycles


@pytest.mark.campaign
def test_tags_and_control_steps_leave_time_for_everything_else(
    image: Image, homed_flash: bytes, tmp_path: Path
) -> None:
    meter = metered_run(image, homed_flash, tmp_path)
    print(describe(meter))
    counts = meter.counts
    assert counts["cl_tag"].calls > 50
    assert counts["tick_handler"].calls > 500
    assert counts["pins_handler"].calls > 500
    assert 2_000 < counts["cl_tag"].most <= TAG_LIMIT
    assert counts["cl_node_receive"].calls > 40
    assert counts["cl_node_receive"].most <= FRAME_LIMIT
    assert counts["tick_handler"].most <= TICK_LIMIT
    assert counts["pins_handler"].most <= EDGE_LIMIT
    assert counts["pins_handler"].mean <= EDGE_CYCLES

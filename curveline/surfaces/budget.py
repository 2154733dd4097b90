"""What the lines of a surface take: rod, nodes, motors, current, radio and time."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from curveline.drive_settings import AXES
from curveline.fitting.fit import Fit
from curveline.radio.host.actions import Policy
from curveline.radio.protocol.air_time import PACKET_BITS, RATES_KBPS, TURN_US
from curveline.scene import Display
from curveline.units import ms

STALL_A = 0.6
"""What a motor draws that is held at 6 V: builds with geared motors like those of the display measured it (N20, 298:1,
part GA46-N20E-0043). The vendor of the motor itself, Adafruit 4641, says 0.2 A."""
STALL_SOURCE = "held N20 motors of 298:1 at 6 V, measured by others; not measured on this display"


@dataclass(frozen=True)
class SurfaceBudget:
    """What it takes to build and to drive the lines of a surface."""

    rod: float  # [m] between the outer nodes of all lines, in their shapes
    rod_to_have: float  # [m] that the displays are said to have, all together
    nodes: int  # of all lines
    motors: int  # of all nodes
    current_per_motor: float  # [A], of a motor that is held
    current_per_line: float  # [A], if all motors of a line are held
    current: float  # [A], if all motors are held at once
    polls_per_s: float  # that all nodes are to be asked, on `channels`
    most_polls_per_s: float  # that the air of one channel carries, as no frame is lost
    channels: int  # of the radio, at present
    seconds_together: float | None  # of all lines at once; None where a line has no plan
    seconds_in_turn: float | None  # of one line after another


def budget_of(display: Display, fits: Sequence[Fit], current_per_motor: float) -> SurfaceBudget:
    """What lines take, each with a display of its own."""
    nodes = display.node_count * len(fits)
    motors = nodes * len(AXES)
    times = [fit.plan.seconds for fit in fits if fit.plan is not None]
    is_planned = len(times) == len(fits)
    exchange = ms(2.0 * PACKET_BITS / RATES_KBPS[display.radio.data_rate]) + ms(2.0 * TURN_US / 1000.0)
    return SurfaceBudget(
        rod=sum(segment.length for fit in fits for segment in fit.scene.segments),
        rod_to_have=display.rod.total_length * len(fits),
        nodes=nodes,
        motors=motors,
        current_per_motor=current_per_motor,
        current_per_line=current_per_motor * motors / len(fits),
        current=current_per_motor * motors,
        polls_per_s=nodes / ms(float(Policy().poll_ms)),
        most_polls_per_s=1.0 / exchange,
        channels=1,
        seconds_together=max(times) if is_planned else None,
        seconds_in_turn=sum(times) if is_planned else None,
    )

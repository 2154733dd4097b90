"""What a plan would put into the air, decoded."""

from __future__ import annotations

from dataclasses import dataclass

from curveline.plan_file import Plan
from curveline.radio.host.preflight import loads_of
from curveline.radio.protocol.codes import Counts, Reject
from curveline.radio.protocol.frames import DriveFrame, decode_drive, encode_drive
from curveline.radio.protocol.keys import KEY_BYTES


@dataclass(frozen=True)
class FrameRecord:
    """One frame of a dry run as the node would decode it."""

    step: int  # from 1
    node: int  # from 1
    address: str  # 5 bytes, hexadecimal
    action: str  # of the step
    release: int  # last step that the node may begin
    target: Counts  # encoder counts from home
    move_ms: int  # time of the move
    payload: bytes  # as it goes over the air


def describe_plan_frames(plan: Plan) -> list[FrameRecord]:
    """The staging frames of a plan, through the real encoder and decoder, under a key that no node has."""
    key = bytes(KEY_BYTES)
    records = []
    for step, loads in zip(plan.steps, loads_of(plan), strict=True):
        for node, (number, target, move_ms) in enumerate(loads, start=1):
            frame = DriveFrame(0, 0, number, number - 1, number, target, move_ms)
            payload = encode_drive(frame, key)
            decoded = decode_drive(payload, key, frame.clock)
            assert not isinstance(decoded, Reject)
            fields = (decoded.release, decoded.target, decoded.move_ms, payload)
            records.append(FrameRecord(number, node, plan.drive.addresses[node - 1], step.action, *fields))
    return records

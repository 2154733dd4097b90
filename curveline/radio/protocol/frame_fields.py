"""What a frame says, for whoever has no key: the fields, and nothing about whose they are.

Bodies of frames are signed, and but for pieces of settings not encrypted. Each is read by its own decoder, after it has
been signed anew with a key that nobody else has a use for.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import fields
from enum import Enum
from typing import Any, NamedTuple

from curveline.radio.protocol import frames, page_frames, service_frames, settings_frames, update_frames
from curveline.radio.protocol.codes import BODY_BYTES, FrameKind, Reject, plain_name
from curveline.radio.protocol.envelope import kind_of, nonce_bytes
from curveline.radio.protocol.keys import FROM_HOST, FROM_NODE, KEY_BYTES, OPEN_KEY, tag

KEY = bytes(KEY_BYTES)
HIDDEN = frozenset({(FrameKind.SETTINGS, "piece")})
"""Fields that only who has the key can read."""


class FieldReader(NamedTuple):
    """How a body of one kind is read: the place of its clock, which its tag covers, and its decoder."""

    clock: slice
    decode: Callable[[bytes, int], Any]


NO_CLOCK, HOST_CLOCK, NODE_CLOCK = slice(0), slice(1, 2), slice(8, 10)
OF_HOST: Mapping[FrameKind, FieldReader] = {
    FrameKind.DRIVE: FieldReader(HOST_CLOCK, lambda payload, clock: frames.decode_drive(payload, KEY, clock)),
    FrameKind.HOME: FieldReader(HOST_CLOCK, lambda payload, clock: frames.decode_home(payload, KEY, clock)),
    FrameKind.SERVICE: FieldReader(
        HOST_CLOCK, lambda payload, clock: service_frames.decode_service(payload, KEY, clock)
    ),
    FrameKind.SETTINGS: FieldReader(
        HOST_CLOCK, lambda payload, clock: settings_frames.decode_settings(payload, KEY, clock)
    ),
    FrameKind.UPDATE: FieldReader(NO_CLOCK, lambda payload, clock: update_frames.decode_update(payload, KEY)),
    FrameKind.HELLO: FieldReader(NO_CLOCK, lambda payload, clock: frames.decode_hello(payload, KEY)),
    FrameKind.STOP: FieldReader(NO_CLOCK, lambda payload, clock: frames.decode_stop(payload, KEY)),
    FrameKind.ESTOP: FieldReader(NO_CLOCK, lambda payload, clock: frames.decode_estop(payload, KEY)),
    FrameKind.PAGE: FieldReader(NO_CLOCK, lambda payload, clock: page_frames.decode_ask(payload)),
}
OF_NODE: Mapping[FrameKind, FieldReader] = {
    FrameKind.STATUS: FieldReader(NODE_CLOCK, lambda payload, clock: frames.decode_status(payload, KEY, clock)),
    FrameKind.READING: FieldReader(
        NODE_CLOCK, lambda payload, clock: service_frames.decode_reading(payload, KEY, clock)
    ),
    FrameKind.PROGRESS: FieldReader(NO_CLOCK, lambda payload, clock: update_frames.decode_progress(payload, KEY)),
    FrameKind.IDENT: FieldReader(NO_CLOCK, lambda payload, clock: frames.decode_ident(payload, KEY, 0)),
    FrameKind.REPORT: FieldReader(NO_CLOCK, lambda payload, clock: frames.decode_report(payload, KEY, 0)),
    FrameKind.PAGE: FieldReader(NO_CLOCK, lambda payload, clock: page_frames.decode_page(payload, 0)),
}


def kind_name(payload: bytes) -> str:
    """What a payload says that it is, such as "drive", or in words why it is no frame."""
    kind = kind_of(payload)
    return kind.value if isinstance(kind, Reject) else plain_name(kind)


def fields_of(payload: bytes, *, from_host: bool) -> dict[str, Any] | None:
    """The fields of a frame by name, as plain data; None for what is no frame that this release knows.

    Of clocks only the low bits are in a frame, and only these are told.
    """
    kind = kind_of(payload)
    reader = None if isinstance(kind, Reject) else (OF_HOST if from_host else OF_NODE).get(kind)
    if reader is None:
        return None
    body, clock = payload[:BODY_BYTES], int.from_bytes(payload[reader.clock], "little")
    key = OPEN_KEY if kind is FrameKind.PAGE else KEY
    signed = body + tag(key, body + nonce_bytes(clock), FROM_HOST if from_host else FROM_NODE)
    found = reader.decode(signed, clock)
    if isinstance(found, Reject):
        return None
    names = (each.name for each in fields(found) if (kind, each.name) not in HIDDEN)
    return {name: _plain(getattr(found, name)) for name in names}


def _plain(value: Any) -> Any:
    if isinstance(value, Enum):
        return plain_name(value)
    if isinstance(value, bytes):
        return value.hex()
    return list(value) if isinstance(value, tuple) else value

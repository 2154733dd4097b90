"""What frames say to who has no key: the same as to who has it."""

from __future__ import annotations

from dataclasses import fields
from enum import Enum
from random import Random
from typing import Any

import pytest

from curveline.radio.protocol import frames, page_frames, service_frames, settings_frames, update_frames
from curveline.radio.protocol.codes import (
    BootCause,
    ErrandOutcome,
    Fault,
    FrameKind,
    NodeState,
    ReadingPage,
    ServiceOperation,
    plain_name,
)
from curveline.radio.protocol.frame_fields import OF_HOST, OF_NODE, fields_of, kind_name

KEY = bytes(range(16))
HIDDEN = {("settings", "piece")}
NONCE = 0x1122334455667700
RUN = 0x8877665544332211
OF_THE_HOST = {
    "drive": (frame := frames.DriveFrame(200, 5, 77, 3, 4, (123456, -7, 0), 1200, 2), frames.encode_drive(frame, KEY)),
    "home": (home := frames.HomeFrame(199, 5, 78, 5, 1), frames.encode_home(home, KEY)),
    "hello": (hello := frames.HelloFrame(2, NONCE | 7, RUN, 0xABCD, 1200, 4), frames.encode_hello(hello, KEY)),
    "estop": (estop := frames.EstopFrame(2, 5, 79), frames.encode_estop(estop, KEY)),
    "stop": (stop := frames.StopFrame(1), frames.encode_stop(stop, KEY)),
    "page": (ask := page_frames.AskFrame(255, NONCE | 3), page_frames.encode_ask(ask)),
    "settings": (
        store := settings_frames.SettingsFrame(3, 5, 81, settings_frames.SettingsOperation.PIECE, 2, bytes(range(14))),
        settings_frames.encode_settings(store, KEY),
    ),
    "update": (
        piece := update_frames.UpdateFrame(5, 82, 7, 63, bytes(range(16))),
        update_frames.encode_update(piece, KEY),
    ),
    "service": (
        jog := service_frames.ServiceFrame(
            3, 5, 80, ServiceOperation.JOG, 1, 2, ReadingPage.AXIS, amount=-900, rate=500
        ),
        service_frames.encode_service(jog, KEY),
    ),
}
STATUS = (2, 5, 76, 0xFEDC, 3, 4, 4, NodeState.MOVING, 2, Fault.NONE, 0, (8000, -16, 0))
REPORT = (2, 9, BootCause.POWER_ON, 3, 4, 4, NodeState.FAULT, 2, Fault.STALL, 3, (8000, -16, 0), (0, 15, 3), 12, True)
IDENT = (2, frames.NodeNonce(9, 5, 12345), 4242, 0xABCD, 2, NodeState.READY, True, False, True)
OF_THE_NODE = {
    "status": (status := frames.StatusFrame(*STATUS), frames.encode_status(status, KEY)),
    "report": (report := frames.ReportFrame(*REPORT), frames.encode_report(report, KEY, NONCE)),
    "ident": (ident := frames.IdentFrame(*IDENT), frames.encode_ident(ident, KEY, NONCE)),
    "progress": (
        progress := update_frames.ProgressFrame(2, 5, 82, 2**63 + 1, 7, update_frames.UpdateOutcome.DONE, 3, 6, 99),
        update_frames.encode_progress(progress, KEY),
    ),
    "page": (
        page := page_frames.PageFrame(2, 0xDEADBEEF, 3, 9, 0xABCD, NodeState.READY, bad_tags=4),
        page_frames.encode_page(page, NONCE),
    ),
    "reading": (
        reading := service_frames.ReadingFrame(
            2, 5, 80, 65000, ReadingPage.MOTORS, ErrandOutcome.DONE, 1, bytes(range(12))
        ),
        service_frames.encode_reading(reading, KEY),
    ),
}


def plain(value: Any) -> Any:
    if isinstance(value, Enum):
        return plain_name(value)
    return value.hex() if isinstance(value, bytes) else list(value) if isinstance(value, tuple) else value


@pytest.mark.parametrize(
    ("name", "from_host"), [*((name, True) for name in OF_THE_HOST), *((name, False) for name in OF_THE_NODE)]
)
def test_all_fields_are_told(name: str, from_host: bool) -> None:
    frame, payload = (OF_THE_HOST if from_host else OF_THE_NODE)[name]
    assert kind_name(payload) == name
    told = fields_of(payload, from_host=from_host)
    assert told == {
        each.name: plain(getattr(frame, each.name)) for each in fields(frame) if (name, each.name) not in HIDDEN
    }
    assert fields_of(payload[:24] + bytes(8), from_host=from_host) == told, "whatever its tag is"


def test_no_kind_is_left_out() -> None:
    assert {kind.name for kind in FrameKind} - {kind.name for kind in (*OF_HOST, *OF_NODE)} == set()
    assert {plain_name(kind) for kind in OF_HOST} >= set(OF_THE_HOST)
    assert {plain_name(kind) for kind in OF_NODE} >= set(OF_THE_NODE)


def test_what_is_no_frame_is_named_and_nothing_raises() -> None:
    assert kind_name(b"") == "not 32 bytes"
    assert kind_name(bytes(32)) == "another protocol version"
    random = Random(5)
    told = 0
    for _ in range(5000):
        payload = bytes([0x20 | random.randrange(16)]) + random.randbytes(random.choice((0, 15, 31, 31, 31)))
        for from_host in (True, False):
            told += fields_of(payload, from_host=from_host) is not None
        assert kind_name(payload)
    assert told > 100
    for name, (_, payload) in OF_THE_HOST.items():
        assert name == "page" or fields_of(payload, from_host=False) is None, "a node does not say that"

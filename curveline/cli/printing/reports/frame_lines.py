"""Frames as they pass, as lines for terminals of 80 columns."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator, Mapping
from typing import Any

from curveline.driving.frame_log import HeardFrame
from curveline.phrases import WIDTH, counted
from curveline.radio.protocol.codes import FLAG_CLEAR, FLAG_QUERY, FLAG_RESUME, FLAG_TAKEOVER
from curveline.radio.protocol.frame_fields import fields_of, kind_name
from curveline.radio.tag_witness import WRONG

Fields = Mapping[str, Any]
FLAGS = {FLAG_TAKEOVER: "take over", FLAG_RESUME: "resume", FLAG_QUERY: "query", FLAG_CLEAR: "clear faults"}
NOTHING = "none"


def describe_frame(heard: HeardFrame) -> Iterator[str]:
    """A frame of the host, and what came back for it, a line each."""
    if heard.missed:
        yield f"... {counted(heard.missed, 'frame')} passed that could not be told in time"
    news = heard.news
    moment = f"{time.strftime('%H:%M:%S', time.localtime(news.at))}.{int(news.at * 1000) % 1000:03d}"
    who = f"{news.node}" if news.node else news.address
    yield _line(f"{moment} {who:>3} > {_said(heard.sent, from_host=True)}")
    repeats = f" after {counted(news.retries, 'repeat')}" if news.retries else ""
    margin = f"{'':{len(moment)}} {'':{len(who):d}}".ljust(len(moment) + 1 + max(3, len(who)))
    if heard.answer is None:
        yield _line(f"{margin} < nothing{repeats}")
    elif not heard.answer:
        yield _line(f"{margin} < acknowledged, no answer was loaded{repeats}")
    else:
        wrong = "WRONG TAG " if news.trust == WRONG else ""
        yield _line(f"{margin} < {wrong}{_said(heard.answer, from_host=False)}{repeats}")


def _line(text: str) -> str:
    return text if len(text) <= WIDTH else f"{text[: WIDTH - 3]}..."


def _said(payload: bytes, *, from_host: bool) -> str:
    """The type of a frame, and what is worth knowing of it in half a line."""
    kind, fields = kind_name(payload), fields_of(payload, from_host=from_host)
    if fields is None:
        return f"{kind}: {payload.hex()}"
    describe = (HOST_WORDS if from_host else NODE_WORDS)[kind]
    return f"{kind:<7} {describe(fields)}".rstrip()


def _drive(fields: Fields) -> str:
    load = f", step {fields['load_step']} to {_counts(fields['target'])}" if fields["load_step"] else ""
    return f"release {fields['release']}{load}, hold {fields['hold_gen']}"


def _hello(fields: Fields) -> str:
    flags = ", ".join(name for bit, name in FLAGS.items() if fields["flags"] & bit)
    run = f"run {fields['run_tag']:016x}" if fields["run_tag"] else ""
    return ", ".join(filter(None, (flags, run)))


def _status(fields: Fields) -> str:
    steps = f"steps {fields['finished']}/{fields['started']}/{fields['staged']}"
    return f"{fields['state']}{_fault(fields)}, {steps} at {_counts(fields['position'])}"


def _report(fields: Fields) -> str:
    return f"{fields['state']}{_fault(fields)}, boot {fields['boot']}, at {_counts(fields['position'])}"


def _ident(fields: Fields) -> str:
    marks = [name for name in ("busy", "stopped", "same_run") if fields[name]]
    return ", ".join([f"{fields['state']}, clock {fields['clock']}", *(mark.replace("_", " ") for mark in marks)])


def _page(fields: Fields) -> str:
    return f"{fields['state']}, chip {fields['chip']:08x}, firmware {fields['firmware']}, boot {fields['boot']}"


def _service(fields: Fields) -> str:
    axis = f" axis {fields['axis']} by {fields['amount']}" if fields["axis"] else ""
    return f"{fields['operation']}{axis}, order {fields['order']}, page {fields['page']}"


def _reading(fields: Fields) -> str:
    return f"order {fields['outcome']}, page {fields['page']}: {fields['facts']}"


def _fault(fields: Fields) -> str:
    return "" if fields["fault"] == NOTHING else f" ({fields['fault']} of axis {fields['fault_axis']})"


def _counts(counts: list[int]) -> str:
    return ",".join(map(str, counts))


HOST_WORDS: Mapping[str, Callable[[Fields], str]] = {
    "drive": _drive,
    "hello": _hello,
    "home": lambda fields: f"axes {fields['axes']:03b}, order {fields['order']}",
    "service": _service,
    "settings": lambda fields: f"{fields['operation']} {fields['index']}",
    "update": lambda fields: f"place {fields['place']}, piece {fields['index']}",
    "page": lambda fields: "who is there?",
    "stop": lambda fields: "to all",
    "estop": lambda fields: "",
}
NODE_WORDS: Mapping[str, Callable[[Fields], str]] = {
    "status": _status,
    "report": _report,
    "ident": _ident,
    "page": _page,
    "reading": _reading,
    "progress": lambda fields: f"order {fields['outcome']}, sector {fields['sector']}, holds {fields['held']:016x}",
}

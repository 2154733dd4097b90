"""Plans: the steps that bring a display into a shape, as data that is read without numpy.

A plan file is the contract between the workstation that plans and the small computer that sends. Lengths are in mm,
angles in degrees, and the motor targets are absolute encoder counts from home.
"""

from __future__ import annotations

import json
import math
import os
import re
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from hashlib import blake2s
from typing import Any, NoReturn

from curveline.drive_settings import (
    ADDRESS,
    AXES,
    DATA_RATES,
    LEAST_RATE,
    MAX_CHANNEL,
    MAX_NODES,
    AxisDrive,
    DriveSettings,
)
from curveline.errors import Diagnostic, InvalidInput
from curveline.notebook import html_of, svg_of
from curveline.system.file_kinds import PLAN, refuse_other_kind
from curveline.system.files import AnyPath, decode_text, excerpt, read_file, write_file
from curveline.system.json_records import Decoder
from curveline.units import beyond, told_apart

FORMAT = 3
UNSEALED = (1, 2)
"""The formats of older releases, whose plans bear no seal."""
SEAL_BYTES = 16
MARKER = "curveline_plan"
MAX_BYTES = 4_000_000
MAX_DIAGNOSTICS = 100
MAX_COUNT = (1 << 23) - 1
"""Motor targets travel as signed 24-bit numbers."""
MAX_STEP_SECONDS = 65.535
"""A step's duration travels as milliseconds in 16 bits."""
MAX_CORNERS = 10**12
STATE = r"[a-z]{1,20}(-[0-9]{1,9})?"
"""What a single state is called: `peak`, `middle-1`."""


@dataclass(frozen=True)
class NodeTarget:
    """Where a node's three axes go: rod fed to the right since home, tangent angle, pivot height."""

    extrude_mm: float  # rod to the right
    bias_deg: float  # from +x, counter-clockwise
    translate_mm: float  # from home
    counts: tuple[int, int, int]  # the same in encoder counts from home


@dataclass(frozen=True)
class Step:
    """One barrier-to-barrier move of all nodes, and what the rod does during it.

    `states` lists the states the rod can be in after the step (one name per segment, alternatives joined by `|`);
    `lowest_eigenvalue` is the smallest along the step, in units of EI/L^2; `margin` is what `margin_of` says; `corners`
    counts the mixtures of uneven progress that were followed. `shape` names the shape that is complete after the step.
    """

    number: int  # from 1
    action: str  # such as feed, turn, lift
    seconds: float  # [s]
    targets: tuple[NodeTarget, ...]  # one per node
    lengths_mm: tuple[float, ...]  # rod of each segment after it
    states: tuple[str, ...]
    lowest_eigenvalue: float
    margin: float
    margin_of: str
    max_strain: float  # of the rod on the way
    max_force_N: float  # on a node
    max_moment_Nmm: float  # on a node
    corners: int = 0
    shape: str = ""


@dataclass(frozen=True)
class Plan:
    """Steps from `start` to a wanted shape.

    `shows` names the state that each segment must be in at the start for what was proven to hold, empty where it does
    not matter; no names at all if none does. `seal` is what `sealed` makes of all the rest.
    """

    name: str  # of the shapes
    drive: DriveSettings  # the display as nodes see it
    start: tuple[NodeTarget, ...]
    steps: tuple[Step, ...]  # in order
    wanted: tuple[str, ...]  # state of each segment at the end
    lengths_mm: tuple[float, ...]  # rod of each segment at the end
    shows: tuple[str, ...] = ()
    provenance: Mapping[str, Any] = field(default_factory=dict)  # what it was made from
    seal: str = ""

    @property
    def seconds(self) -> float:
        """Expected time of all steps together, without the radio's share."""
        return math.fsum(step.seconds for step in self.steps)

    @property
    def granted(self) -> tuple[str, ...]:
        """`shows` with a name for every segment, all of them empty if no state matters."""
        return self.shows or ("",) * len(self.wanted)

    def _repr_svg_(self) -> str | None:
        return svg_of("curveline.figures.plans:draw", self)

    def _repr_html_(self) -> str:
        steps = [
            (step.number, step.action, step.seconds, ", ".join(step.states), step.margin, step.margin_of)
            for step in self.steps
        ]
        head = ("step", "action", "time s", "states after", "margin", "of")
        return html_of(f"{self.name}, {self.seconds:.1f} s", [head, *steps], self._repr_svg_())


def sealed(plan: Plan) -> Plan:
    """The same plan under a seal that fits; whoever calls this vouches that all of it was proven as it is.

    The seal protects against editing and damage. It is no secret and no signature: anybody can compute it.
    """
    return replace(plan, seal=seal_of(plan))


def seal_of(plan: Plan) -> str:
    """Hexadecimal digest of all that a plan says, its seal excepted; ValueError for numbers that JSON has not.

    It does not depend on the layout of a file, nor on whether 3 is written as 3.0.
    """
    content = json.dumps({**vars(plan), "seal": ""}, default=vars, allow_nan=False)
    document = {MARKER: FORMAT, **json.loads(content, parse_float=_number)}
    canonical = json.dumps(document, sort_keys=True, separators=(",", ":"))
    return blake2s(canonical.encode(), digest_size=SEAL_BYTES).hexdigest()


def _number(text: str) -> float:
    value = float(text)
    return int(value) if value.is_integer() else value


def to_json(plan: Plan) -> str:
    """The JSON document of a sealed plan; `from_json` gives the same plan back to the last bit.

    InvalidInput if the plan was changed after it was sealed, or never was, ValueError for numbers that JSON has not.
    """
    if plan.seal != seal_of(plan):
        raise InvalidInput(
            f"the plan {plan.name!r} is not sealed as it is: it was changed after it was proven",
            "plan again; in Python, `curveline.plan_file.sealed` seals a plan that you vouch for yourself",
        )
    document = {MARKER: FORMAT, **vars(plan)}
    return json.dumps(document, default=vars, indent=1, allow_nan=False, ensure_ascii=False) + "\n"


def encoded(plan: Plan) -> bytes:
    """The content of a plan file; errors as of `to_json`."""
    return to_json(plan).encode()


def write_plan(plan: Plan, path: AnyPath, *, force: bool = False) -> None:
    """Write a plan file, whole or not at all; InvalidInput as of `to_json`, or if it exists without `force`."""
    write_file(path, encoded(plan), force=force)


def read_plan(path: AnyPath) -> Plan:
    """The plan in a file; InvalidInput lists everything that makes it unfit to be sent."""
    name = os.fspath(path)
    return from_json(decode_text(read_file(name, MAX_BYTES), name), name)


def from_json(text: str, path: str) -> Plan:
    """The plan in a JSON document; `path` names it in the Diagnostics of InvalidInput."""
    refuse_other_kind(text, path, PLAN)
    decoder = Decoder()
    try:
        document = _parse(text, path, decoder)
        if not isinstance(document, dict) or MARKER not in document:
            hint = "name a file that `curveline plan -o` wrote"
            _refuse(path, [("not-a-plan", f"this is no plan: {MARKER} is missing")], hint)
        _check_format(document.pop(MARKER), path)
        plan: Plan = decoder.decode(Plan, document, "")
    except RecursionError:
        _refuse(path, [("too-deep", "objects or arrays nested too deep")], "plan again")
    if not decoder.problems:
        _check_drive(plan.drive, decoder)
        _check_plan(plan, decoder)
    if not decoder.problems:
        _check_seal(plan, decoder)
    if decoder.problems:
        _refuse(path, decoder.problems, "do not edit plans by hand: change the shape and plan again")
    return plan


def _parse(text: str, path: str, decoder: Decoder) -> Any:
    def unique(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
        record = dict(pairs)
        if len(record) < len(pairs):
            decoder.problem("duplicate-key", f"an object says a key twice; it has {', '.join(record)[:80]!r}")
        return record

    try:
        return json.loads(text, object_pairs_hook=unique)
    except json.JSONDecodeError as error:
        source, caret = excerpt(text.split("\n")[error.lineno - 1], error.colno)
        message, hint = f"this is not JSON: {error.msg}", "name a file that `curveline plan -o` wrote"
        found = Diagnostic(path, error.lineno, error.colno, "json-syntax", message, hint, source, caret)
        raise InvalidInput(f"{path}: {message}", hint, [found]) from None
    except ValueError:  # Python refuses to read a whole number of more than 4300 digits
        _refuse(path, [("out-of-range", "a number of thousands of digits")], "plan again")


def _refuse(path: str, problems: list[tuple[str, str]], hint: str) -> NoReturn:
    found = [Diagnostic(path, 1, 1, code, message, hint) for code, message in problems[:MAX_DIAGNOSTICS]]
    raise InvalidInput(f"{path}: {problems[0][1]}", hint, found)


def _check_format(version: object, path: str) -> None:
    if version in UNSEALED:
        message = f"this plan was made by an older release and is not sealed: {MARKER} is not {FORMAT}"
        hint = "plan again: `curveline plan SHAPE... -o PLAN.json`, with --force to replace this file"
        _refuse(path, [("unsealed", message)], hint)
    if version != FORMAT:
        _refuse(path, [("unknown-format", f"{MARKER} is not {FORMAT}")], "plan again with this version")


def _check_seal(plan: Plan, found: Decoder) -> None:
    if not plan.seal:
        found.problem("unsealed", "seal is missing, so that nothing says whether this is what was proven")
    elif plan.seal != seal_of(plan):
        found.problem("broken-seal", "the seal does not fit: the plan was edited or damaged after it was proven")


def _check_drive(drive: DriveSettings, found: Decoder) -> None:
    for name, axis in zip(AXES, drive.axes, strict=True):
        where = f"drive.axes, {name}"
        if min(axis.counts_per_unit, axis.speed, axis.acceleration) < LEAST_RATE:
            message = f"{where}: counts per unit, speed and acceleration must be at least {LEAST_RATE:g}"
            found.problem("out-of-range", message)
        if not axis.low < axis.high:
            low, high = told_apart(axis.low, axis.high, 6)
            found.problem("empty-range", f"{where}: low is {low}, which is not below high, {high}")
    if not 0 <= drive.channel <= MAX_CHANNEL:
        found.problem("out-of-range", f"drive.channel is {drive.channel}, but must be 0 to {MAX_CHANNEL}")
    if drive.data_rate not in DATA_RATES:
        found.problem("bad-value", f"drive.data_rate is {drive.data_rate[:40]!r}, not one of {', '.join(DATA_RATES)}")
    if not 2 <= drive.node_count <= MAX_NODES:
        message = f"drive.addresses has {drive.node_count}, but a display has 2 to {MAX_NODES} nodes"
        found.problem("node-count", message)
    for address in drive.addresses:
        if re.fullmatch(ADDRESS, address) is None:
            found.problem("bad-value", f"drive.addresses: {address[:40]!r} is not ten hexadecimal digits")
    if len({address.upper() for address in drive.addresses}) < drive.node_count:
        found.problem("duplicate-address", "drive.addresses: two nodes have the same address")


def _check_plan(plan: Plan, found: Decoder) -> None:
    segments = plan.drive.node_count - 1
    if not plan.steps:
        found.problem("step-number", "steps is empty: there is nothing to send")
    _check_targets(plan.drive, plan.start, "start", found)
    _check_length("wanted", len(plan.wanted), segments, found)
    _check_length("lengths_mm", len(plan.lengths_mm), segments, found)
    if plan.shows:
        _check_length("shows", len(plan.shows), segments, found)
    for index, name in enumerate(plan.shows):
        if name and re.fullmatch(STATE, name) is None:
            found.problem("bad-value", f"shows[{index}] is {name[:40]!r}, which is no name of one state")
    for index, step in enumerate(plan.steps):
        _check_step(plan, index, step, found)
    if plan.steps:
        _check_end(plan, plan.steps[-1], found)


def _check_step(plan: Plan, index: int, step: Step, found: Decoder) -> None:
    where, segments = f"steps[{index}]", plan.drive.node_count - 1
    if step.number != index + 1:
        found.problem("step-number", f"{where}.number is {step.number}, but must be {index + 1}")
    if not 0.0 <= step.seconds <= MAX_STEP_SECONDS:
        given, *_ = beyond(step.seconds, 0.0, MAX_STEP_SECONDS)
        message = f"{where}.seconds is {given} s, but must be 0 to {MAX_STEP_SECONDS} s"
        found.problem("out-of-range", message)
    if not 0 <= step.corners <= MAX_CORNERS:
        found.problem("out-of-range", f"{where}.corners is {step.corners}, but must be 0 to {MAX_CORNERS:g}")
    _check_targets(plan.drive, step.targets, f"{where}.targets", found)
    _check_length(f"{where}.states", len(step.states), segments, found)
    _check_length(f"{where}.lengths_mm", len(step.lengths_mm), segments, found)


def _check_end(plan: Plan, last: Step, found: Decoder) -> None:
    """What a plan is for must be what its last step was proven to end in."""
    if plan.wanted != last.states:
        message = f"wanted is {_named(plan.wanted)}, but the last step ends in {_named(last.states)}"
        found.problem("end-mismatch", message)
    if plan.lengths_mm != last.lengths_mm:
        found.problem("end-mismatch", "lengths_mm is not what the last step ends with")


def _named(states: tuple[str, ...]) -> str:
    return repr(", ".join(states)[:80])


def _check_length(where: str, count: int, segments: int, found: Decoder) -> None:
    if count != segments:
        found.problem("segment-count", f"{where} has {count} items, but must have one per segment, {segments}")


def _check_targets(drive: DriveSettings, targets: tuple[NodeTarget, ...], where: str, found: Decoder) -> None:
    if len(targets) != drive.node_count:
        found.problem("node-count", f"{where} has {len(targets)} items, but must have one per node, {drive.node_count}")
    for index, target in enumerate(targets):
        values = (target.extrude_mm, target.bias_deg, target.translate_mm)
        for name, axis, value, counts in zip(AXES, drive.axes, values, target.counts, strict=True):
            problem = _axis_problem(axis, value, counts)
            if problem:
                found.problem(problem[0], f"{where}[{index}], {name}: {problem[1]}")


def _axis_problem(axis: AxisDrive, value: float, counts: int) -> tuple[str, str] | None:
    """Code and message of what is wrong with one axis of a target; one count is the motor's own uncertainty."""
    if axis.counts_per_unit < LEAST_RATE:
        return None  # reported with the drive
    if not -MAX_COUNT - 1 <= counts <= MAX_COUNT:
        return "out-of-range", f"the count does not fit 24 bits, {MAX_COUNT}"
    if abs(value * axis.counts_per_unit - counts) > 1.0:
        return "count-mismatch", f"{value:g} is not {counts} counts at {axis.counts_per_unit:g} counts per unit"
    slack = 1.0 / axis.counts_per_unit
    if not axis.low - slack <= value <= axis.high + slack:
        there, low, high = beyond(value, axis.low, axis.high)
        return "out-of-range", f"{there} is outside {low} to {high}"
    return None

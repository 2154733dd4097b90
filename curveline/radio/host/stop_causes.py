"""Why a run stops: one cause, one message and one hint for each fault the host can tell apart."""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum
from shlex import quote

from curveline.drive_settings import AXES, DEFAULT_DISPLAY
from curveline.plan_file import Plan
from curveline.radio.protocol.codes import Fault, plain_name


class Cause(Enum):
    """What stopped a run: a message, in which `{node}`, `{when}` and `{detail}` are filled in, and a hint.

    In a hint `{node}` and `{channel}` are filled in, and `{display}` with the option that names the display, if the
    commands need one. Every command in it works as it is printed, once the radio is named: see docs/ways-out.md.
    """

    def __init__(self, text: str, hint: str) -> None:
        self.text = text
        self.hint = hint

    SILENT = (
        "node {node} does not answer{detail}",
        "check its power and antenna, the channel and the address; `curveline status{display}` shows who answers",
    )
    DEAF = (
        "no node answers{detail}",
        "see that the nodes have power and that the radio is on the display's channel and data rate; something may "
        "be jamming that channel, too; `curveline status{display}` shows who answers",
    )
    UNTRUSTED = (
        "node {node} answers, but not to the key of this site",
        "load the site's key into it: by a cable, `curveline keys node`, or with the key file that it was flashed for, "
        "`curveline node settings` with --old-keys; `curveline status --scan{display}` shows who answers",
    )
    SPENT = (
        "node {node} takes no more hosts: somebody has sent it more handshakes than it has numbers for",
        "switch it off and on (the mock: `curveline status --radio mock:repower{display}`), then send again",
    )
    CLONE = (
        "the answers of node {node} come cut short",
        "its radio chip may be a bad copy, or this computer's if all do so: see `curveline status "
        "--radio-test{display}`",
    )
    TWIN = (
        "two devices answer on the address of node {node}: {detail}",
        "switch one of them off, and write settings of its own to each node: by a cable, `curveline keys node`, or to "
        "one that is alone on the air, `curveline node settings`",
    )
    VERSION = (
        "node {node} speaks another version of the protocol: {detail}",
        "flash the node with the firmware of this release of curveline",
    )
    CHIP = (
        "node {node} is another device than the site knows: {detail}",
        "see if two nodes have been swapped; `curveline keys adopt` records a device that was exchanged on purpose",
    )
    CONFIG = (
        "node {node} holds other limits or speeds than this display: {detail}",
        "`curveline node settings {node}{display}` gives it those of the display file, over the air; or correct the "
        "file",
    )
    TRIAL = (
        "node {node} tries other settings",
        "within half a minute it returns to those before, unless it is told to keep them: `curveline node settings "
        "{node}{display}`",
    )
    BUSY = (
        "node {node} belongs to another host that is sending to it{detail}",
        "wait until the other host is done, or stop it: `curveline stop{display}`; a send with --takeover takes "
        "nodes over that stand still",
    )
    TAKEN = (
        "node {node} no longer obeys this radio session; another host may have taken it over",
        "only one host may send at a time; find the other one, then send the shape again: that plans from where the "
        "display stands",
    )
    NOT_HOMED = (
        "node {node} does not know where it is{when}: it has not been homed",
        "home it: `curveline node home {node}{display}`; then send again",
    )
    UNFOUND = (
        "node {node} has not found the zeros of all its axes: {detail}",
        "see to the motors of these axes and to their encoders: are they connected, is the way free? Then home them: "
        "`curveline node home {node}{display}`",
    )
    LOST = (
        "node {node} has lost its position{when} ({detail})",
        "check the cable of that motor's encoder; then home the node: `curveline node home {node}{display}`; "
        "nothing else can tell where it stands",
    )
    BROWN_OUT = (
        "the supply of node {node} sagged{when} ({detail}), and its position went with it",
        "check its supply: cable, connector, current with all motors turning; then home the node: `curveline node "
        "home {node}{display}`",
    )
    LATCHED = (
        "node {node} has been stopped for good by an emergency stop",
        "find out why; then switch the node off and on (the mock: `curveline status --radio "
        "mock:repower{display}`), and send again",
    )
    ELSEWHERE = (
        "node {node} does not stand where the plan starts: {detail}",
        "send the shape instead of the plan: that plans from where the display stands",
    )
    REBOOT = (
        "node {node} has restarted{when}: {detail}",
        "check its supply; then send the shape again: that plans from where the display stands, or says which node "
        "does not know that any more",
    )
    DEADLINE = (
        "node {node} is late{when}: {detail}",
        "look for something in its way, or a motor that is too slow for the plan; the run can be resumed",
    )
    CONFLICT = (
        "node {node} was given two different targets for one step{when}",
        "this is a fault in a host program: report it; `curveline node clear {node}{display}` ends it, then send "
        "the shape again",
    )
    LIMIT = (
        "node {node} refused a target{when}: its {detail} axis would leave its limits",
        "the node's limits and the display file disagree: `curveline node settings {node}{display}` gives it those of "
        "the file; `curveline node clear {node}{display}` ends the fault, then send the shape again",
    )
    STALL = (
        "node {node} has stalled{when}: its {detail} motor does not follow",
        "free what blocks it; `curveline node clear {node}{display}` ends the fault, and so does going on with the run "
        "that it broke off: `curveline send --resume last{display}`",
    )
    RUNAWAY = (
        "node {node} moved against its command{when} ({detail})",
        "motor or encoder is wired the wrong way round: set that right; `curveline node clear {node}{display}` ends"
        " the fault, then send the shape again",
    )
    DRIVER = (
        "node {node} reports a fault of its motor driver{when} ({detail})",
        "check the motor's wiring and supply for a short circuit; `curveline node clear {node}{display}` ends the "
        "fault, and so does going on with the run that it broke off: `curveline send --resume last{display}`",
    )
    HELD = (
        "node {node} heard nothing for longer than its dead-man time and holds{when}",
        "improve the radio link; then resume the run, or send the shape again from where the display stands",
    )
    SUSPENDED = (
        "this computer fell silent{when} ({detail}), so the nodes hold",
        "keep it awake and its disk free while a display moves; the run can be resumed",
    )
    STOPPED = (
        "node {node} was stopped{when} by a stop broadcast that this run did not send",
        "find out who stopped the display; then resume the run, or send the shape again from where the display stands",
    )
    AHEAD = (
        "node {node} is at step {detail}, which this run never released",
        "another host has driven it, or the run's record is not the newest: this run cannot go on; send the shape "
        "again from where the display stands",
    )
    BEHIND = (
        "node {node} has not done what the record of the run says that it did: {detail}",
        "it was homed, or its run was given up; send the shape again from where the display stands",
    )
    OTHER_RUN = (
        "node {node} knows nothing of this run; it has been sent something else since",
        "send the shape again from where the display stands",
    )
    JOURNAL = (
        "the record of the run cannot be written, so no further step is released: {detail}",
        "free space on the disk of the runs folder, or set CURVELINE_RUNS to another one",
    )
    WORN = (
        "this run has been paused and resumed as often as one radio session allows",
        "send the shape again from where the display stands",
    )
    UNTAKEN = (
        "emergency stop was asked for before the nodes were taken over: none was sent, they may be another host's",
        "`curveline stop{display}` stops a display whoever drives it",
    )
    ESTOP = (
        "emergency stop was asked for{when}",
        "switch every node off and on (the mock: `curveline status --radio mock:repower{display}`), then send again",
    )
    OTHERS = (
        "another line of the run cannot begin, so that this one does not either",
        "see to that line; then send again, or go on with the run: `curveline send --resume last`",
    )
    OLDER = (
        "node {node} has firmware {detail}, which knows nothing of that",
        "flash the node with the firmware of this release of curveline",
    )
    NO_LOADER = (
        "node {node} has no loader, or does not find it: its program cannot be replaced over the air",
        "flash it once by USB with an image that has one: `make -C firmware updatable`, `curveline keys node {node}`",
    )
    UNFLASHED = (
        "node {node} has not got its program: {detail}",
        "try again; if that does not help, flash it by USB",
    )
    MUTE = (
        "node {node} has got its program, but does not answer under it",
        "switch it off and on, which brings its loader back, and send it a program that works",
    )
    IN_LOADER = (
        "node {node} is in its loader, and waits for a program",
        "send it one: `curveline node update {node} --hex firmware/build/updatable.hex{display}` goes on where an "
        "update was broken off; a node whose program is whole returns to it when nobody has asked it anything for 20 s",
    )
    REFUSED = (
        "node {node} does not do that: {detail}",
        "see how it is: `curveline node status {node}{display}`",
    )
    CUT_SHORT = (
        "node {node} stopped on its way: {detail}",
        "see how it is: `curveline node status {node}{display}`; then try again",
    )
    CHANNEL = (
        "node {node} does not answer on channel {detail}",
        "`curveline node settings {node} --old-channel {channel}{display}` gives it that of the display file, over "
        "the air; or correct the channel in the file",
    )
    UNFIT = (
        "node {node} does not take these settings: {detail}",
        "see how it is: `curveline node info {node}{display}`; the cable always works: `curveline keys node`",
    )
    UNHEARD = (
        "node {node} was not heard under its new settings, and is back under the old ones",
        "nothing has changed; see that the new channel is free, and the link good at the new data rate; then again: "
        "`curveline node settings {node}{display}`",
    )
    STRAYED = (
        "node {node} answers neither under its new settings nor under the old ones: {detail}",
        "see that it has power; `curveline node settings {node}{display}` can be told where it listens now, by "
        "--old-display, --old-channel, --old-number, --old-keys; one that tries other settings is back within half a "
        "minute",
    )
    TAKEN_PLACE = (
        "another device answers where node {node} is to be: {detail}",
        "give that one other settings first, or switch it off",
    )
    UNHEEDED = (
        "node {node} did not begin to home: {detail}",
        "see what it is doing: `curveline node status {node}{display}`; then try again",
    )


UNREACHABLE = frozenset({Cause.SILENT, Cause.DEAF, Cause.REBOOT, Cause.TAKEN})
"""Causes after which the node at fault, or every node, will not answer under its session any more."""


@dataclass(frozen=True)
class Halt:
    """A cause with its particulars; `node` is 0 when it concerns all, `step` 0 before the first.

    `display` is the name or file by which commands find the display.
    """

    cause: Cause
    node: int = 0
    step: int = 0
    detail: str = ""
    display: str = DEFAULT_DISPLAY
    channel: int = 0  # on which the node answers, if that is what matters

    @property
    def message(self) -> str:
        """What happened, in one sentence."""
        when = f" in step {self.step}" if self.step else ""
        return self.cause.text.format(node=self.node, when=when, detail=self.detail)

    @property
    def hint(self) -> str:
        """What to do about it."""
        return self.cause.hint.format(node=self.node, display=display_option(self.display), channel=self.channel)


_FAULTS = {
    Fault.CONFLICT: Cause.CONFLICT,
    Fault.LIMIT: Cause.LIMIT,
    Fault.STALL: Cause.STALL,
    Fault.RUNAWAY: Cause.RUNAWAY,
    Fault.DRIVER: Cause.DRIVER,
    Fault.ENCODER: Cause.LOST,
    Fault.BROWN_OUT: Cause.BROWN_OUT,
}


def fault_halt(fault: Fault, axis: int, node: int, step: int) -> Halt:
    """The halt for a fault that a node reports; `axis` from 1, 0 if it concerns no single one."""
    where = AXES[axis - 1] if axis else "whole drive"
    if _FAULTS[fault] is Cause.LOST:
        where = f"{where}: {plain_name(fault)}"
    return Halt(_FAULTS[fault], node, step, where)


def named_display(plan: Plan) -> str:
    """The name or file by which commands find the display of a plan."""
    return str(plan.provenance.get("display", plan.drive.display))


def display_option(display: str) -> str:
    """What a command that is advised needs besides to find a display; nothing for the one that it takes by itself."""
    return "" if display == DEFAULT_DISPLAY else f" --display {quote(display)}"

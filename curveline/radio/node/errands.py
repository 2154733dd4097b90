"""What a node does for a host that tries it out or changes its settings: jogs, turns, places, and what it says then.

Part of the executable specification of a node, docs/radio-protocol.md; none of it belongs to a run.
"""

from __future__ import annotations

from curveline.radio.node.body import NodeBody
from curveline.radio.node.state import LOST_POSITION, NodeSession, with_reason
from curveline.radio.node.workbench import Turn
from curveline.radio.protocol.codes import (
    BLINK_MS,
    POSITION_LIMIT,
    SERVICE_DEADMAN_MS,
    TURN_COUNTS,
    TURN_DUTY,
    TURN_MS,
    UNHOMED_COUNTS,
    Counts,
    ErrandOutcome,
    Fault,
    ReadingPage,
    ServiceOperation,
    SettingsOperation,
    clock_of,
)
from curveline.radio.protocol.motion import LEAST_RATE, plan_move
from curveline.radio.protocol.service_frames import (
    LINE_TURNING,
    ORDERS,
    AxisFacts,
    LimitFacts,
    MotorFacts,
    ReadingFrame,
    ServiceFrame,
    pack_axis,
    pack_limits,
    pack_motors,
    pack_samples,
)
from curveline.radio.protocol.settings_frames import (
    PIECES,
    SettingsFacts,
    SettingsFrame,
    pack_settings,
)


class NodeErrands(NodeBody):
    """The errands of one node: what a SERVICE orders, whether it may, and what a READING tells."""

    def _serve(self, now_ms: int, session: NodeSession, frame: ServiceFrame) -> None:
        """Do what a SERVICE that counts asks for; an order is taken once, also if it is refused."""
        if frame.operation is ServiceOperation.BLINK:
            self.blink_until_ms = now_ms + BLINK_MS
        elif frame.operation in ORDERS and frame.order > session.order:
            session.order = frame.order
            self.outcome = self._refusal(now_ms, session, frame)
            if self.outcome is ErrandOutcome.NONE:
                self.memory.forget_run()
                self._begin_errand(now_ms, frame)

    def _change(self, session: NodeSession, frame: SettingsFrame) -> None:
        """Take a piece of other settings, or do what a SETTINGS that counts orders; an order is taken once."""
        if frame.operation is SettingsOperation.PIECE:
            if not self.on_trial:
                session.pieces[frame.index] = frame.piece
        elif frame.index > session.order:
            session.order = frame.index
            self.outcome = self._change_refusal(session, frame.operation)
            if self.outcome is ErrandOutcome.NONE:
                self.outcome = self._carry_out(session, frame.operation)

    def _change_refusal(self, session: NodeSession, wanted: SettingsOperation) -> ErrandOutcome:
        if (refusal := self._unready(session)) is not ErrandOutcome.NONE:
            return refusal
        if self.on_trial:
            ends_it = wanted in (SettingsOperation.KEEP, SettingsOperation.DROP)
            return ErrandOutcome.NONE if ends_it else ErrandOutcome.OCCUPIED
        lacks = wanted is SettingsOperation.STORE and len(session.pieces) < PIECES
        return ErrandOutcome.BEYOND if lacks or wanted is SettingsOperation.KEEP else ErrandOutcome.NONE

    def _carry_out(self, session: NodeSession, wanted: SettingsOperation) -> ErrandOutcome:
        keeper, pieces = self.plant.settings, session.pieces
        if wanted is SettingsOperation.STORE:
            outcome = keeper.store(b"".join(pieces[index] for index in range(PIECES)))
            pieces.clear()
        elif wanted is SettingsOperation.TRY:
            outcome = keeper.request()
            self.leaves = outcome is ErrandOutcome.DONE
        elif wanted is SettingsOperation.KEEP:
            outcome = keeper.keep()
            self.on_trial = outcome is not ErrandOutcome.DONE
        elif wanted is SettingsOperation.LOADER:
            self.leaves = self.seeks_loader = self.plant.has_loader
            outcome = ErrandOutcome.DONE if self.leaves else ErrandOutcome.BEYOND
        else:
            outcome, self.leaves = ErrandOutcome.DONE, self.on_trial
            pieces.clear()
            keeper.drop()
        return outcome

    def _begin_errand(self, now_ms: int, frame: ServiceFrame) -> None:
        self.outcome = ErrandOutcome.BUSY
        if frame.operation is ServiceOperation.JOG:
            at = self.plant.positions(now_ms)
            target = _moved(at, frame.axis, frame.amount)
            self.move = plan_move(at, target, self._axes, 1000 * abs(frame.amount) // frame.rate)
            self.move_start_ms = now_ms
            self.jogging = True
            self.plant.follow(now_ms, now_ms, self.move)
        elif frame.operation is ServiceOperation.TURN:
            self.turning = True
            self.plant.turn(now_ms, Turn(frame.axis, frame.amount, frame.rate, frame.span, frame.at_once))
        else:
            self.plant.place(now_ms, frame.axis, frame.amount)
            memory = self.memory
            memory.unhomed = with_reason(memory.unhomed, 1 << frame.axis - 1, 0)
            if memory.homed and memory.fault in LOST_POSITION:
                memory.forget_fault()
            self.outcome = ErrandOutcome.DONE

    def _refusal(self, now_ms: int, session: NodeSession, frame: ServiceFrame) -> ErrandOutcome:
        """Why an order is not carried out, NONE if it is."""
        if (refusal := self._unready(session)) is not ErrandOutcome.NONE:
            return refusal
        if self.on_trial:
            return ErrandOutcome.OCCUPIED
        if frame.operation is ServiceOperation.PLACE:
            axis = self._axes[frame.axis - 1]
            return ErrandOutcome.NONE if axis.low <= frame.amount <= axis.high else ErrandOutcome.BEYOND
        if session.hello.deadman_ms > SERVICE_DEADMAN_MS:
            return ErrandOutcome.DEADMAN
        at = self.plant.positions(now_ms)
        return (
            self._jog_refusal(at, frame) if frame.operation is ServiceOperation.JOG else self._turn_refusal(at, frame)
        )

    def _unready(self, session: NodeSession) -> ErrandOutcome:
        """Why the node carries out no order at all, NONE if it may."""
        memory = self.memory
        if memory.estop or self._silent or self._stopped or session.hold_gen & 1:
            return ErrandOutcome.HELD
        is_occupied = session.owns_run or self._moves() or memory.homing
        return ErrandOutcome.OCCUPIED if is_occupied else ErrandOutcome.NONE

    def _jog_refusal(self, at: Counts, frame: ServiceFrame) -> ErrandOutcome:
        if self.memory.fault is not Fault.NONE:
            return ErrandOutcome.FAULTY
        axis, target = self._axes[frame.axis - 1], at[frame.axis - 1] + frame.amount
        if (
            any(abs(each) > 2 * POSITION_LIMIT for each in at)
            or abs(target) > POSITION_LIMIT
            or frame.rate < LEAST_RATE
        ):
            return ErrandOutcome.BEYOND
        if self.memory.unhomed[frame.axis - 1] == 0:
            return ErrandOutcome.NONE if axis.low <= target <= axis.high else ErrandOutcome.BEYOND
        if not frame.unhomed:
            return ErrandOutcome.UNHOMED
        most = min(UNHOMED_COUNTS, (axis.high - axis.low) // 4)
        return ErrandOutcome.BEYOND if abs(frame.amount) > most else ErrandOutcome.NONE

    def _turn_refusal(self, at: Counts, frame: ServiceFrame) -> ErrandOutcome:
        too_much = abs(frame.amount) > TURN_DUTY or frame.rate > TURN_COUNTS or frame.span > TURN_MS
        if too_much or frame.amount == 0 or frame.rate == 0 or frame.span == 0:
            return ErrandOutcome.BEYOND
        axis, end = self._axes[frame.axis - 1], at[frame.axis - 1] + (frame.rate if frame.amount > 0 else -frame.rate)
        is_homed = self.memory.unhomed[frame.axis - 1] == 0
        return ErrandOutcome.NONE if not is_homed or axis.low <= end <= axis.high else ErrandOutcome.BEYOND

    def _standing(self, now_ms: int, session: NodeSession) -> bytes:
        """What the node runs under, and the pieces that it has."""
        standing = self.plant.settings.standing()
        left_s = max(0, -(-(self.trial_ends_ms - now_ms) // 1000)) if self.on_trial else 0
        held = sum(1 << index for index in session.pieces)
        return pack_settings(SettingsFacts(held, self.on_trial, standing.generation, left_s, standing.stored))

    def _reading(self, now_ms: int, session: NodeSession, frame: ServiceFrame) -> ReadingFrame:
        """The page that was asked for, as it is now."""
        number = max(1, frame.axis)
        index = {ReadingPage.LIMITS: number, ReadingPage.TRACE: frame.rate & 0xFF}.get(frame.page, session.order)
        return ReadingFrame(
            *(self.identity.number, session.number, session.counter, clock_of(now_ms)),
            *(frame.page, self.outcome, index, self._facts(now_ms, session, frame)),
        )

    def _facts(self, now_ms: int, session: NodeSession, frame: ServiceFrame) -> bytes:
        number = max(1, frame.axis)
        if frame.page is ReadingPage.SETTINGS:
            return self._standing(now_ms, session)
        if frame.page is ReadingPage.LIMITS:
            axis = self._axes[number - 1]
            return pack_limits(LimitFacts(axis.low, axis.high, axis.speed, axis.acceleration))
        seen = self.plant.look(now_ms, number, frame.rate & 0xFF)
        if frame.page is ReadingPage.TRACE:
            return pack_samples(seen.trace)
        if frame.page is ReadingPage.AXIS:
            facts = seen.missed, seen.duty, seen.lag, seen.threshold, seen.samples
            return pack_axis(AxisFacts(number, *facts, self.memory.started))
        return pack_motors(MotorFacts(seen.counts, seen.lines | LINE_TURNING * self.is_turning, seen.supply_mv))


def _moved(at: Counts, axis: int, by: int) -> Counts:
    x, y, z = (each + by if number == axis else each for number, each in enumerate(at, start=1))
    return x, y, z

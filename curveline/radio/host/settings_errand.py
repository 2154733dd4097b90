"""What a host has one node do that gets other settings: take pieces, store, try, keep, drop."""

from __future__ import annotations

from curveline.radio.host.errands import WHY, Inquiry
from curveline.radio.host.scan import SETTINGS_FROM
from curveline.radio.host.service import SILENCE_US
from curveline.radio.host.stop_causes import Cause, Halt
from curveline.radio.protocol.codes import AXIS_COUNT, ErrandOutcome, NodeState, ReadingPage, SettingsOperation
from curveline.radio.protocol.motion import Axes, AxisLimits
from curveline.radio.protocol.node_settings import NodeSettings
from curveline.radio.protocol.service_frames import ReadingFrame, ServiceFrame
from curveline.radio.protocol.settings_frames import (
    ALL_PIECES,
    PIECE_BYTES,
    SettingsFacts,
    SettingsFrame,
    pieces_of,
    settings_facts_in,
)

LEAVING = 25
"""Frames in a row without an answer after which a node has most likely started anew."""
REFUSED = {**WHY, ErrandOutcome.FAILED: "its flash does not hold them"}
"""Outcome -> why an order about settings was not carried out."""


class SettingsErrand(Inquiry):
    """The session of one node that gets other settings."""

    deadman_ms = 0
    needs = SETTINGS_FROM

    def standing(self) -> SettingsFacts:
        """What the node runs under, and what it has stored."""
        return settings_facts_in(self._look(ServiceFrame(0, 0, 0, page=ReadingPage.SETTINGS)).facts)

    def axes(self) -> Axes:
        """The limits that the node holds."""
        found = [self.limits(axis) for axis in range(1, AXIS_COUNT + 1)]
        x, y, z = (AxisLimits(each.low, each.high, each.speed, each.acceleration) for each in found)
        return x, y, z

    def store(self, settings: NodeSettings) -> None:
        """Give the node settings, and have it put them aside; LinkError if it does not."""
        pieces, held = pieces_of(settings.record()), 0
        self._heard_us = self._radio.now_us()
        while held != ALL_PIECES:
            for number, piece in enumerate(pieces):
                reading = None if held >> number & 1 else self._tell(SettingsOperation.PIECE, number, piece)
                if reading is not None:
                    held = settings_facts_in(reading.facts).pieces
            self._check_heard()
        self._order_until_done(SettingsOperation.STORE)

    def attempt(self) -> None:
        """Have the node start anew under what it has stored; LinkError if it says that it does not."""
        self._order += 1
        unheard, mark = 0, self._peer.counter + 1
        while unheard < LEAVING:
            reading = self._tell(SettingsOperation.TRY, self._order)
            unheard = 0 if reading is not None else unheard + 1
            if reading is not None and self._is_answer(reading, mark):
                self._check_done(reading.outcome)
                return

    def keep(self) -> None:
        """The settings on trial are to be those of the node; LinkError if it does not say so."""
        self._order_until_done(SettingsOperation.KEEP)

    def drop(self) -> None:
        """End a trial, or forget what is stored; a node whose trial ends starts anew and says nothing."""
        self._order += 1
        unheard, mark = 0, self._peer.counter + 1
        while unheard < LEAVING:
            reading = self._tell(SettingsOperation.DROP, self._order)
            if reading is not None and self._is_answer(reading, mark):
                self._check_done(reading.outcome)
                return
            unheard = 0 if reading is not None else unheard + 1

    def _order_until_done(self, operation: SettingsOperation) -> None:
        self._order += 1
        mark, self._heard_us = self._peer.counter + 1, self._radio.now_us()
        while True:
            reading = self._tell(operation, self._order)
            if reading is not None and self._is_answer(reading, mark):
                self._check_done(reading.outcome)
                return
            self._check_heard()

    def _tell(self, operation: SettingsOperation, index: int, piece: bytes = bytes(PIECE_BYTES)) -> ReadingFrame | None:
        return self._reading_for(self._peer.settings(SettingsFrame(0, 0, 0, operation, index, piece)))

    def _is_answer(self, reading: ReadingFrame, mark: int) -> bool:
        is_settings = reading.page is ReadingPage.SETTINGS
        return is_settings and reading.echo >= mark and reading.index == self._order

    def _check_done(self, outcome: ErrandOutcome) -> None:
        if outcome is ErrandOutcome.DONE:
            return
        number = self._peer.number
        if outcome is ErrandOutcome.HELD and self._status().state is NodeState.ESTOP:
            raise self._halted(Halt(Cause.LATCHED, number))
        cause = Cause.REFUSED if outcome in (ErrandOutcome.HELD, ErrandOutcome.OCCUPIED) else Cause.UNFIT
        raise self._halted(Halt(cause, number, detail=REFUSED.get(outcome, "it does not say why")))

    def _check_heard(self) -> None:
        if self._radio.now_us() - self._heard_us > SILENCE_US:
            raise self._halted(Halt(Cause.SILENT, self._peer.number, detail=" any more"))

"""A register-level model of the nRF24L01+: bytes on the SPI bus and levels on CE and IRQ on one side, an `Ether` on the
other.

It follows the product specification: registers with their defaults and read-only bits, three-level FIFOs, packet ids,
the repeat filter, automatic acknowledgement with payload, retransmission, and the times that a driver has to respect.
Left out: the constant carrier, the bit order inside the CRC (it is a CRC-16 of the same fields, byte by byte), and
everything analogue. It is not stricter than chips are: registers can be written in any mode.

Time is that of the ether; transfers take none of it, so whoever drives the bus lets the ether go on meanwhile.
"""

from __future__ import annotations

from binascii import crc_hqx
from collections.abc import Callable
from dataclasses import dataclass, replace
from enum import Enum, auto
from functools import partial
from typing import Protocol

from .chipbank import (
    CONFIG,
    EN_ACK_PAY,
    EN_RXADDR,
    FEATURE,
    FIFO_LEVELS,
    FLAGS,
    MAX_RT,
    PRIM_RX,
    PWR_UP,
    RF_CH,
    RX_DR,
    RX_PW_P0,
    SETUP_RETR,
    TX_DS,
    Bank,
    Transaction,
)

START_US = 1500
TURN_US = 130
GAIN_US = 40
"""Between the receiver's being on and its knowing how strong what it hears is."""
PULSE_US = 10
ARD_US = 250


@dataclass(frozen=True)
class Packet:
    """What is in the air: who can hear it (channel, rate, format), and what it says; the address as on the bus."""

    channel: int
    kbps: int
    crc_bytes: int
    enhanced: bool
    address: bytes
    payload: bytes
    pid: int = 0
    no_ack: bool = False

    @property
    def air_us(self) -> int:
        """How long it is in the air: preamble, address, control field, payload, CRC."""
        control = 9 if self.enhanced else 0
        bits = 8 * (1 + len(self.address) + len(self.payload) + self.crc_bytes) + control
        return -(-bits * 1000 // self.kbps)

    @property
    def mark(self) -> tuple[int, int]:
        """What the repeat filter looks at: packet id and CRC."""
        control = bytes([len(self.payload) << 2 | self.pid, self.no_ack])
        crc = crc_hqx(self.address + control + self.payload, 0xFFFF)
        return self.pid, crc if self.crc_bytes == 2 else crc & 0xFF


class Medium(Protocol):
    """What a chip needs of the ether."""

    now_us: int

    def join(self, chip: Chip) -> None:
        """From now on `chip` hears what is sent."""
        ...

    def at(self, moment_us: int, event: Callable[[], None]) -> None:
        """Let `event` happen at `moment_us`."""
        ...

    def transmit(self, sender: Chip, packet: Packet) -> None:
        """Put a packet into the air now; the sender is told when it is out."""
        ...

    def has_carrier(self, listener: Chip, channel: int) -> bool:
        """Whether anybody but `listener` sends on a channel now."""
        ...


class Mode(Enum):
    """What the radio part of the chip is doing."""

    DOWN = auto()
    STARTING = auto()
    STANDBY = auto()
    RX = auto()
    TX_SETTLING = auto()
    TX = auto()
    ACK_WAIT = auto()
    ACKING = auto()


class Chip:
    """One nRF24L01+; `select`, `transfer`, `deselect`, `ce` and `irq` are its pins.

    `on_irq` is told the level of the IRQ pin (0 is an interrupt) whenever it changes. `unplugged` is what the bus reads
    when the chip is not there, None as long as it is.
    """

    def __init__(self, ether: Medium, name: str = "") -> None:
        self.name = name
        self.on_irq: Callable[[int], None] | None = None
        self.unplugged: int | None = None
        self._ether = ether
        self._ce = 0
        self._epoch = 0
        self._irq = 1
        self._bus: Transaction | None = None
        self._power_on()
        ether.join(self)

    def _power_on(self) -> None:
        self.bank = Bank()
        self._last: dict[int, tuple[int, int]] = {}
        self._is_latched = False
        self._rise_us = 0
        self._listening_from: int | None = None
        self.mode = Mode.DOWN

    def reset(self) -> None:
        """A dip in the supply: registers, FIFOs and filter as after power-on; CE is what its driver makes it."""
        self._epoch += 1
        self._power_on()
        self._settle_irq()

    # Pins

    @property
    def ce(self) -> int:
        """Level of the CE pin."""
        return self._ce

    @ce.setter
    def ce(self, level: int) -> None:
        if level == self._ce:
            return
        self._sense()
        self._ce = level
        now_us = self._ether.now_us
        if level:
            self._rise_us = now_us
        elif self.mode is Mode.TX_SETTLING and not self.bank.arc and now_us - self._rise_us < PULSE_US:
            self._enter(Mode.STANDBY)  # too short a pulse starts nothing
        self._review()

    @property
    def irq(self) -> int:
        """Level of the IRQ pin: 0 while a flag is up that CONFIG does not mask."""
        return self._irq

    def select(self) -> None:
        """CSN goes low: a command begins."""
        self._sense()
        self._bus = Transaction(self.bank)

    def transfer(self, byte: int) -> int:
        """One byte each way."""
        if self.unplugged is not None or self._bus is None:
            return self.unplugged or 0
        return self._bus.transfer(byte)

    def deselect(self) -> None:
        """CSN goes high: what was written takes effect."""
        bus, self._bus = self._bus, None
        if bus is not None and self.unplugged is None:
            bus.finish()
            self._settle_irq()
            self._review()

    def command(self, data: bytes) -> bytes:
        """A whole command from select to deselect; what came back for each byte."""
        self.select()
        answer = bytes(self.transfer(byte) for byte in data)
        self.deselect()
        return answer

    def _raise(self, flags: int) -> None:
        self.bank.flags |= flags
        self._settle_irq()

    def _settle_irq(self) -> None:
        level = 0 if self.bank.flags & ~self.bank[CONFIG] & FLAGS else 1
        if level != self._irq:
            self._irq = level
            if self.on_irq is not None:
                self._ether.at(self._ether.now_us, partial(self.on_irq, level))  # once the chip is done here

    def _sense(self) -> None:
        """RPD follows what is in the air while the chip listens; a packet, or the end of that, keeps it as it is."""
        since_us = self._listening_from
        knows = self.mode is Mode.RX and since_us is not None and self._ether.now_us >= since_us + GAIN_US
        if knows and not self._is_latched:
            self.bank.rpd = int(self._ether.has_carrier(self, self.bank[RF_CH]))

    # What the radio part does

    def _enter(self, mode: Mode) -> None:
        self._epoch += 1
        self.mode = mode
        self._listening_from = None

    def _after(self, delay_us: int, event: Callable[[], None]) -> None:
        """Let `event` happen unless the chip turns to something else first."""
        self._ether.at(self._ether.now_us + delay_us, partial(self._still, self._epoch, event))

    def _still(self, epoch: int, event: Callable[[], None]) -> None:
        if epoch == self._epoch:
            event()

    def _review(self) -> None:
        """Turn to what CE, CONFIG and the FIFOs ask for; a packet that is under way is finished first."""
        config = self.bank[CONFIG]
        if not config & PWR_UP:
            if self.mode is not Mode.DOWN:
                self._enter(Mode.DOWN)
        elif self.mode is Mode.DOWN:
            self._enter(Mode.STARTING)
            self._after(START_US, self._ready)
        elif self.mode in (Mode.STANDBY, Mode.RX):
            self._choose()

    def _choose(self) -> None:
        if self._ce and self.bank[CONFIG] & PRIM_RX:
            if self.mode is not Mode.RX:
                self._enter(Mode.RX)
                self._listening_from = self._ether.now_us + TURN_US
                self.bank.rpd, self._is_latched = 0, False
        elif self._ce and self.bank.tx and self.bank.tx[0].pipe is None and not self.bank.flags & MAX_RT:
            self._enter(Mode.TX_SETTLING)
            self.bank.arc = 0
            self._after(TURN_US, self._send)
        elif self.mode is Mode.RX:
            self._enter(Mode.STANDBY)

    def _ready(self) -> None:
        self._enter(Mode.STANDBY)
        self._review()

    def _send(self) -> None:
        self._enter(Mode.TX)
        if not self.bank.tx:  # flushed meanwhile
            self._ready()
            return
        entry = self.bank.tx[0]
        packet = self._build(self.bank.tx_address, entry.payload, enhanced=self.bank.is_enhanced(0))
        self._ether.transmit(self, replace(packet, pid=entry.pid, no_ack=entry.no_ack))

    def _build(self, address: bytes, payload: bytes, *, enhanced: bool) -> Packet:
        return Packet(self.bank[RF_CH], self.bank.kbps, self.bank.crc_bytes, enhanced, address, payload)

    def sent(self, packet: Packet) -> None:
        """The ether tells that the packet is out."""
        if self.mode is Mode.ACKING:
            self._ready()
        elif self.mode is Mode.TX and (packet.no_ack or not packet.enhanced):
            self._delivered()
        elif self.mode is Mode.TX:
            self._enter(Mode.ACK_WAIT)
            self._listening_from = self._ether.now_us + TURN_US
            self._after(((self.bank[SETUP_RETR] >> 4) + 1) * ARD_US, self._unanswered)

    def _unanswered(self) -> None:
        if self.bank.arc < self.bank[SETUP_RETR] & 0x0F:
            self.bank.arc += 1
            self._enter(Mode.TX_SETTLING)  # it listened to the end of the delay, so it has yet to turn
            self._after(TURN_US, self._send)
            return
        self.bank.plos = min(self.bank.plos + 1, 15)
        self._enter(Mode.STANDBY)
        self._raise(MAX_RT)
        self._review()

    def _delivered(self) -> None:
        if self.bank.tx and not self.bank.repeats:
            self.bank.tx.pop(0)
        self._enter(Mode.STANDBY)
        self._raise(TX_DS)
        self._review()

    def hears(self, packet: Packet, start_us: int) -> bool:
        """Whether the receiver was on, and tuned to the channel of a packet that began at `start_us`."""
        since_us = self._listening_from
        return since_us is not None and since_us <= start_us and packet.channel == self.bank[RF_CH]

    def take(self, packet: Packet) -> None:
        """A packet that was heard unspoilt; it counts if its format and address are those of a pipe."""
        self.bank.rpd, self._is_latched = 1, True
        if (packet.kbps, packet.crc_bytes) != (self.bank.kbps, self.bank.crc_bytes):
            return
        for pipe in range(6):
            enabled = self.bank[EN_RXADDR] >> pipe & 1
            if (
                enabled
                and self.bank.pipe_address(pipe) == packet.address
                and self.bank.is_enhanced(pipe) == packet.enhanced
            ):
                self._accept(pipe, packet)
                return

    def _accept(self, pipe: int, packet: Packet) -> None:
        full = len(self.bank.rx) >= FIFO_LEVELS
        if self.mode is Mode.ACK_WAIT:
            if pipe == 0 and not (packet.payload and full):
                if packet.payload:
                    self.bank.rx.append((0, packet.payload))
                    self._raise(RX_DR)
                self._delivered()
            return
        fits = self.bank.is_dynamic(pipe) or len(packet.payload) == self.bank[RX_PW_P0 + pipe]
        if full or not fits:
            return
        if not packet.enhanced or self._last.get(pipe) != packet.mark:
            self._last[pipe] = packet.mark
            self.bank.rx.append((pipe, packet.payload))
            self._confirm(pipe)
            self._raise(RX_DR)
        if packet.enhanced and not packet.no_ack:
            self._acknowledge(pipe, packet)

    def _confirm(self, pipe: int) -> None:
        """A new packet proves that the answer to the one before has arrived."""
        entry = self.bank.confirmed_by_next.pop(pipe, None)
        if entry is not None and entry in self.bank.tx:
            self.bank.tx.remove(entry)
            self._raise(TX_DS)

    def _acknowledge(self, pipe: int, packet: Packet) -> None:
        """Answer with the payload that is loaded now, which the node has had no time to renew."""
        entry = None
        if self.bank[FEATURE] & EN_ACK_PAY and self.bank.is_dynamic(pipe):
            entry = next((each for each in self.bank.tx if each.pipe == pipe), None)
        if entry is not None:
            self.bank.confirmed_by_next[pipe] = entry
        self._enter(Mode.ACKING)
        answer = self._build(packet.address, entry.payload if entry else b"", enhanced=True)
        self._after(TURN_US, partial(self._ether.transmit, self, replace(answer, pid=packet.pid)))

"""Registers, FIFOs and bus commands of the nRF24L01+, as specified; `chip.py` has the radio around them."""

from __future__ import annotations

from dataclasses import dataclass

CONFIG, EN_AA, EN_RXADDR, SETUP_AW, SETUP_RETR, RF_CH, RF_SETUP, STATUS, OBSERVE_TX, RPD = range(10)
RX_ADDR_P0, RX_ADDR_P1 = 0x0A, 0x0B
TX_ADDR = 0x10
RX_PW_P0 = 0x11
FIFO_STATUS = 0x17
DYNPD, FEATURE = 0x1C, 0x1D

R_REGISTER, W_REGISTER = 0x00, 0x20
R_RX_PL_WID, R_RX_PAYLOAD = 0x60, 0x61
W_TX_PAYLOAD, W_TX_PAYLOAD_NOACK, W_ACK_PAYLOAD = 0xA0, 0xB0, 0xA8
FLUSH_TX, FLUSH_RX, REUSE_TX_PL, NOP = 0xE1, 0xE2, 0xE3, 0xFF

PRIM_RX, PWR_UP, CRCO, EN_CRC = 0x01, 0x02, 0x04, 0x08
RX_DR, TX_DS, MAX_RT = 0x40, 0x20, 0x10
FLAGS = RX_DR | TX_DS | MAX_RT
EN_DPL, EN_ACK_PAY, EN_DYN_ACK = 0x04, 0x02, 0x01
RF_DR_LOW, RF_DR_HIGH = 0x20, 0x08

FIFO_LEVELS = 3
PAYLOAD_BYTES = 32

WRITABLE = {
    CONFIG: 0x7F,
    EN_AA: 0x3F,
    EN_RXADDR: 0x3F,
    SETUP_AW: 0x03,
    SETUP_RETR: 0xFF,
    RF_CH: 0x7F,
    RF_SETUP: 0xBE,
    DYNPD: 0x3F,
    FEATURE: 0x07,
    **dict.fromkeys(range(RX_PW_P0, RX_PW_P0 + 6), 0x3F),
    **dict.fromkeys(range(RX_ADDR_P1 + 1, TX_ADDR), 0xFF),
}
"""Registers of one byte that can be written, and which of their bits exist."""

DEFAULTS = {
    CONFIG: 0x08,
    EN_AA: 0x3F,
    EN_RXADDR: 0x03,
    SETUP_AW: 0x03,
    SETUP_RETR: 0x03,
    RF_CH: 0x02,
    RF_SETUP: 0x0E,
    DYNPD: 0,
    FEATURE: 0,
    **dict.fromkeys(range(RX_PW_P0, RX_PW_P0 + 6), 0),
    **{RX_ADDR_P1 + 1 + index: 0xC3 + index for index in range(4)},
}
LONG_DEFAULTS = {RX_ADDR_P0: b"\xe7" * 5, RX_ADDR_P1: b"\xc2" * 5, TX_ADDR: b"\xe7" * 5}
"""Addresses, least significant byte first, as they go over the bus."""


@dataclass(eq=False)
class Entry:
    """One level of the TX FIFO: a payload to send, or, with a pipe, one to acknowledge with."""

    payload: bytes
    pid: int = 0
    pipe: int | None = None
    no_ack: bool = False


class Bank:
    """What the chip keeps: registers, flags, counters and both FIFOs, as at power-on."""

    def __init__(self) -> None:
        self.flags = 0
        self.arc = 0
        self.plos = 0
        self.rpd = 0
        self.tx: list[Entry] = []
        self.rx: list[tuple[int, bytes]] = []
        self.repeats = False
        self.confirmed_by_next: dict[int, Entry] = {}
        self._registers = dict(DEFAULTS)
        self._addresses = dict(LONG_DEFAULTS)
        self._pid = 0

    def __getitem__(self, register: int) -> int:
        return self._registers[register]

    # Registers

    def read(self, register: int) -> bytes:
        """As R_REGISTER gives it."""
        if register in self._addresses:
            return self._addresses[register]
        live = {
            STATUS: self.status,
            OBSERVE_TX: self.plos << 4 | self.arc,
            RPD: self.rpd,
            FIFO_STATUS: self.fifo_status,
        }
        return bytes([live.get(register, self._registers.get(register, 0))])

    def write(self, register: int, data: bytes) -> None:
        """As W_REGISTER does it."""
        if register in self._addresses:
            self._addresses[register] = data[:5] + self._addresses[register][len(data) :]
        elif register == STATUS:
            self.flags &= ~data[0]
        elif register in WRITABLE:
            self._registers[register] = data[0] & WRITABLE[register]
            if register == RF_CH:
                self.plos = 0

    @property
    def status(self) -> int:
        """The byte that every command begins with."""
        front = self.rx[0][0] if self.rx else 7
        return self.flags | front << 1 | (len(self.tx) >= FIFO_LEVELS)

    @property
    def fifo_status(self) -> int:
        """How full both FIFOs are."""
        tx = (len(self.tx) >= FIFO_LEVELS) << 5 | (not self.tx) << 4
        return self.repeats << 6 | tx | (len(self.rx) >= FIFO_LEVELS) << 1 | (not self.rx)

    @property
    def crc_bytes(self) -> int:
        """CRC of a packet; automatic acknowledgement forces one."""
        config = self._registers[CONFIG]
        if not config & EN_CRC and not self._registers[EN_AA]:
            return 0
        return 2 if config & CRCO else 1

    @property
    def kbps(self) -> int:
        """Data rate."""
        setup = self._registers[RF_SETUP]
        return 250 if setup & RF_DR_LOW else 2000 if setup & RF_DR_HIGH else 1000

    @property
    def width(self) -> int:
        """Bytes of an address; 2 is no legal width, but what chips do when told 0."""
        return self._registers[SETUP_AW] + 2

    @property
    def tx_address(self) -> bytes:
        """Whom packets are for, least significant byte first."""
        return self._addresses[TX_ADDR][: self.width]

    def pipe_address(self, pipe: int) -> bytes:
        """What a pipe listens to; pipes 2 to 5 share all but one byte with pipe 1."""
        if pipe < 2:
            return self._addresses[RX_ADDR_P0 + pipe][: self.width]
        return bytes([self._registers[RX_ADDR_P0 + pipe]]) + self._addresses[RX_ADDR_P1][1 : self.width]

    def is_enhanced(self, pipe: int) -> bool:
        """Whether a pipe acknowledges by itself."""
        return bool(self._registers[EN_AA] >> pipe & 1)

    def is_dynamic(self, pipe: int) -> bool:
        """Whether a pipe takes payloads of any size."""
        return bool(self._registers[FEATURE] & EN_DPL and self._registers[DYNPD] >> pipe & 1)

    # FIFOs, as the commands see them

    def front(self) -> bytes:
        """The oldest payload received, empty if there is none."""
        return self.rx[0][1] if self.rx else b""

    def drop_front(self) -> None:
        """Forget the oldest payload received."""
        del self.rx[:1]

    def push(self, payload: bytes, pipe: int | None = None, *, no_ack: bool = False) -> None:
        """Append to the TX FIFO; a fourth payload is lost, as in the bank."""
        if len(self.tx) < FIFO_LEVELS and payload:
            if pipe is None:
                self._pid = self._pid + 1 & 3
            self.repeats = False
            self.tx.append(Entry(payload[:PAYLOAD_BYTES], self._pid, pipe, no_ack))

    def flush_tx(self) -> None:
        """Empty the TX FIFO; what is in the air goes on."""
        self.tx.clear()
        self.repeats = False

    def flush_rx(self) -> None:
        """Empty the RX FIFO."""
        self.rx.clear()

    def reuse(self) -> None:
        """Send the newest payload again and again while CE is high."""
        self.repeats = bool(self.tx)

    @property
    def dynamic_acks(self) -> bool:
        """Whether W_TX_PAYLOAD_NOACK is switched on."""
        return bool(self._registers[FEATURE] & EN_DYN_ACK)


class Transaction:
    """One command on the bus, from select to deselect."""

    def __init__(self, bank: Bank) -> None:
        self._bank = bank
        self._command: int | None = None
        self._data = bytearray()
        self._answer = b""

    def transfer(self, byte: int) -> int:
        """One byte each way; the first is the command, and the chip's status."""
        if self._command is None:
            self._command = byte
            self._answer = self._prepare(byte)
            return self._bank.status
        index = len(self._data)
        self._data.append(byte)
        return self._answer[index] if index < len(self._answer) else 0

    def _prepare(self, command: int) -> bytes:
        """What the chip shifts out after the status."""
        if command < W_REGISTER:
            return self._bank.read(command)
        if command == R_RX_PAYLOAD:
            return self._bank.front()
        if command == R_RX_PL_WID:
            return bytes([len(self._bank.front())])
        return b""

    def finish(self) -> None:
        """The command takes effect."""
        bank, command, data = self._bank, self._command, bytes(self._data)
        if command is None:
            return
        if W_REGISTER <= command < 2 * W_REGISTER and data:
            bank.write(command & 0x1F, data)
        elif command == R_RX_PAYLOAD and data:
            bank.drop_front()
        elif command == W_TX_PAYLOAD:
            bank.push(data)
        elif command == W_TX_PAYLOAD_NOACK and bank.dynamic_acks:
            bank.push(data, no_ack=True)
        elif W_ACK_PAYLOAD <= command < W_ACK_PAYLOAD + 6:
            bank.push(data, command & 7)
        elif command == FLUSH_TX:
            bank.flush_tx()
        elif command == FLUSH_RX:
            bank.flush_rx()
        elif command == REUSE_TX_PL:
            bank.reuse()

"""Drivers for the chip model, as short as they get: a sender that writes a payload, a receiver with answers loaded."""

from __future__ import annotations

from .chip import Chip
from .chipbank import (
    CONFIG,
    DYNPD,
    EN_RXADDR,
    FEATURE,
    FIFO_STATUS,
    FLAGS,
    FLUSH_TX,
    NOP,
    OBSERVE_TX,
    R_RX_PAYLOAD,
    R_RX_PL_WID,
    RF_CH,
    RF_SETUP,
    RX_ADDR_P0,
    RX_ADDR_P1,
    SETUP_RETR,
    STATUS,
    TX_ADDR,
    W_ACK_PAYLOAD,
    W_REGISTER,
    W_TX_PAYLOAD,
)
from .ether import Ether

HOST_CONFIG, NODE_CONFIG = 0x0E, 0x0F
RATES = {"250kbps": 0x26, "1Mbps": 0x06, "2Mbps": 0x0E}
RETRIES_3_500US, RETRIES_3_1500US = 0x13, 0x53


def write(chip: Chip, register: int, *data: int) -> None:
    chip.command(bytes([W_REGISTER | register, *data]))


def read(chip: Chip, register: int) -> int:
    return chip.command(bytes([register, NOP]))[1]


def set_up(chip: Chip, config: int, channel: int = 76, rate: str = "1Mbps") -> None:
    """Everything but addresses, as both ends need it."""
    write(chip, SETUP_RETR, RETRIES_3_1500US if rate == "250kbps" else RETRIES_3_500US)
    write(chip, RF_CH, channel)
    write(chip, RF_SETUP, RATES[rate])
    write(chip, FEATURE, 0x06)
    write(chip, DYNPD, 0x03)
    write(chip, CONFIG, config)


class Host:
    """A sending chip."""

    def __init__(self, ether: Ether, rate: str = "1Mbps", channel: int = 76) -> None:
        self.ether = ether
        self.chip = Chip(ether, "host")
        set_up(self.chip, HOST_CONFIG, channel, rate)
        ether.advance(ether.now_us + 5000)

    def send(self, address: bytes, payload: bytes) -> int:
        """Send one payload; the flags that came up."""
        write(self.chip, TX_ADDR, *address)
        write(self.chip, RX_ADDR_P0, *address)
        self.chip.command(bytes([W_TX_PAYLOAD]) + payload)
        self.chip.ce = 1
        return self.wait()

    def wait(self, limit_us: int = 50_000) -> int:
        """Let time pass until the chip is done with its packet; takes CE down, then the flags."""
        end_us = self.ether.now_us + limit_us
        while self.chip.irq and self.ether.now_us < end_us:
            self.ether.advance(self.ether.now_us + 10)
        self.chip.ce = 0
        flags = self.chip.command(bytes([NOP]))[0] & FLAGS
        write(self.chip, STATUS, FLAGS)
        return flags

    def flush(self) -> None:
        """Drop what could not be sent."""
        self.chip.command(bytes([FLUSH_TX]))

    def answers(self) -> list[bytes]:
        """Drain the RX FIFO."""
        return drain(self.chip)

    @property
    def retries(self) -> int:
        """Retries of the last packet."""
        return read(self.chip, OBSERVE_TX) & 0x0F


class Listener:
    """A receiving chip on pipe 1, switched on and listening."""

    def __init__(self, ether: Ether, address: bytes, rate: str = "1Mbps", channel: int = 76) -> None:
        self.ether = ether
        self.address = address
        self.chip = Chip(ether, address.hex())
        set_up(self.chip, NODE_CONFIG, channel, rate)
        write(self.chip, RX_ADDR_P1, *address)
        write(self.chip, EN_RXADDR, 0x02)
        ether.advance(ether.now_us + 5000)
        self.chip.ce = 1
        ether.advance(ether.now_us + 200)

    def load(self, payload: bytes) -> None:
        """Append an answer."""
        self.chip.command(bytes([W_ACK_PAYLOAD | 1]) + payload)

    def reload(self, payload: bytes) -> None:
        """Make this the only answer."""
        self.chip.command(bytes([FLUSH_TX]))
        self.load(payload)

    def heard(self) -> list[bytes]:
        """Drain the RX FIFO and take the flags down."""
        payloads = drain(self.chip)
        write(self.chip, STATUS, FLAGS)
        return payloads


def drain(chip: Chip) -> list[bytes]:
    """All payloads in the RX FIFO, oldest first."""
    payloads = []
    while not read(chip, FIFO_STATUS) & 1:
        width = chip.command(bytes([R_RX_PL_WID, NOP]))[1]
        payloads.append(chip.command(bytes([R_RX_PAYLOAD]) + bytes(width))[1:])
    return payloads

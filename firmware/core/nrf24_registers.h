/* Registers and commands of the nRF24L01+, with the numbers of its product specification: for the node's driver and the
 * dongle's. */
#ifndef CL_NRF24_REGISTERS_H
#define CL_NRF24_REGISTERS_H

enum {
    REG_CONFIG = 0x00,
    REG_EN_AA = 0x01,
    REG_EN_RXADDR = 0x02,
    REG_SETUP_AW = 0x03,
    REG_SETUP_RETR = 0x04,
    REG_RF_CH = 0x05,
    REG_RF_SETUP = 0x06,
    REG_STATUS = 0x07,
    REG_OBSERVE_TX = 0x08,
    REG_RPD = 0x09,
    REG_RX_ADDR_P0 = 0x0A,
    REG_RX_ADDR_P1 = 0x0B,
    REG_TX_ADDR = 0x10,
    REG_DYNPD = 0x1C,
    REG_FEATURE = 0x1D
};

enum {
    CMD_WRITE = 0x20,
    CMD_ACTIVATE = 0x50,
    CMD_RX_WIDTH = 0x60,
    CMD_RX_PAYLOAD = 0x61,
    CMD_TX_PAYLOAD = 0xA0,
    CMD_ACK_PAYLOAD_1 = 0xA9, /* for pipe 1 */
    CMD_FLUSH_TX = 0xE1,
    CMD_FLUSH_RX = 0xE2,
    CMD_NOP = 0xFF
};

/* What follows CMD_ACTIVATE: chips without the plus, and some copies, have no FEATURE register before it. */
#define ACTIVATE_KEY 0x73u

#endif

#include "nrf24.h"

#include "board.h"
#include "nrf24_registers.h"
#include "spi.h"
#include "tick.h"

#define STATUS_FLAGS 0x70u
#define STATUS_RX_PIPE 0x0Eu
#define POWER_UP_US 2000u /* 1.5 ms with most crystals */
#define FIXED_COUNT 9u

typedef struct {
    uint8_t number, value;
} setting;

/* Registers of one byte in the order they are written; power comes up with the first. */
static void wanted(const cl_listening *settings, setting list[FIXED_COUNT]) {
    static const uint8_t rates[3] = {0x26, 0x06, 0x0E};   /* full power */
    static const uint8_t retries[3] = {0x53, 0x13, 0x13}; /* unused by a receiver, set all the same */
    const setting all[FIXED_COUNT] = {
        {REG_CONFIG, 0x3F}, /* CRC-16, power up, receiver; only received packets pull the request line */
        {REG_EN_AA, 0x02},
        {REG_EN_RXADDR, 0x02},
        {REG_SETUP_AW, 0x03},
        {REG_SETUP_RETR, retries[settings->rate]},
        {REG_RF_CH, settings->channel},
        {REG_RF_SETUP, rates[settings->rate]},
        {REG_FEATURE, 0x06}, /* dynamic length, answers with payload */
        {REG_DYNPD, 0x02},
    };
    for (unsigned i = 0; i < FIXED_COUNT; i++) {
        list[i] = all[i];
    }
}

static uint8_t command(uint8_t code) {
    spi_select();
    uint8_t status = spi_transfer(code);
    spi_deselect();
    return status;
}

static uint8_t exchange(uint8_t code, uint8_t value) {
    spi_select();
    spi_transfer(code);
    uint8_t answer = spi_transfer(value);
    spi_deselect();
    return answer;
}

static uint8_t read_register(uint8_t number) { return exchange(number, CMD_NOP); }

static void write_register(uint8_t number, uint8_t value) { exchange((uint8_t)(CMD_WRITE | number), value); }

static bool holds_address(const cl_listening *settings) {
    bool same = true;
    spi_select();
    spi_transfer(REG_RX_ADDR_P1);
    for (unsigned i = 0; i < sizeof settings->address; i++) {
        same &= spi_transfer(CMD_NOP) == settings->address[i];
    }
    spi_deselect();
    return same;
}

static void write_address(const cl_listening *settings) {
    spi_select();
    spi_transfer(CMD_WRITE | REG_RX_ADDR_P1);
    for (unsigned i = 0; i < sizeof settings->address; i++) {
        spi_transfer(settings->address[i]);
    }
    spi_deselect();
}

static void listen(bool on) {
    if (on) {
        GPIO_PSOR(CE_PORT) = 1u << CE_PIN;
    } else {
        GPIO_PCOR(CE_PORT) = 1u << CE_PIN;
    }
}

void nrf24_pins(void) {
    listen(false);
    GPIO_PDDR(CE_PORT) |= 1u << CE_PIN;
    PORT_PCR(CE_PORT, CE_PIN) = PCR_GPIO;
    PORT_PCR(RADIO_IRQ_PORT, RADIO_IRQ_PIN) = PCR_GPIO | PCR_PULL_UP | PCR_IRQ_FALLING;
    spi_start();
}

bool nrf24_start(const cl_listening *settings) {
    setting list[FIXED_COUNT];
    wanted(settings, list);
    listen(false);
    write_register(REG_FEATURE, 0x06);
    if (read_register(REG_FEATURE) != 0x06) {
        exchange(CMD_ACTIVATE, ACTIVATE_KEY); /* chips before the plus hide this register until told */
    }
    for (unsigned i = 0; i < FIXED_COUNT; i++) {
        write_register(list[i].number, list[i].value);
    }
    write_address(settings);
    command(CMD_FLUSH_RX);
    command(CMD_FLUSH_TX);
    write_register(REG_STATUS, STATUS_FLAGS);
    delay_us(POWER_UP_US);
    listen(true);
    return nrf24_intact(settings);
}

bool nrf24_intact(const cl_listening *settings) {
    setting list[FIXED_COUNT];
    wanted(settings, list);
    for (unsigned i = 0; i < FIXED_COUNT; i++) {
        if (read_register(list[i].number) != list[i].value) {
            return false;
        }
    }
    return holds_address(settings);
}

bool nrf24_calls(void) { return (GPIO_PDIR(RADIO_IRQ_PORT) >> RADIO_IRQ_PIN & 1u) == 0; }

/* The flag is cleared before the queue is read: what arrives in between raises it again. */
uint8_t nrf24_receive(uint8_t payload[NRF24_PAYLOAD_BYTES]) {
    uint8_t status = exchange(CMD_WRITE | REG_STATUS, STATUS_FLAGS);
    status = command(CMD_NOP);
    if ((status & STATUS_RX_PIPE) == STATUS_RX_PIPE) {
        return 0;
    }
    uint8_t width = exchange(CMD_RX_WIDTH, CMD_NOP);
    if (width == 0 || width > NRF24_PAYLOAD_BYTES) {
        command(CMD_FLUSH_RX); /* as the specification demands: the queue is corrupt */
        return 0;
    }
    spi_select();
    spi_transfer(CMD_RX_PAYLOAD);
    for (unsigned i = 0; i < width; i++) {
        payload[i] = spi_transfer(CMD_NOP);
    }
    spi_deselect();
    return width;
}

void nrf24_load(const uint8_t *payload, uint8_t length) {
    command(CMD_FLUSH_TX);
    if (length == 0) {
        return;
    }
    spi_select();
    spi_transfer(CMD_ACK_PAYLOAD_1);
    for (unsigned i = 0; i < length; i++) {
        spi_transfer(payload[i]);
    }
    spi_deselect();
}

/* Turn-around, then preamble, address, control, 32 bytes and CRC: 329 bits. */
uint32_t nrf24_answer_us(const cl_listening *settings) {
    static const uint16_t times[3] = {130 + 1316, 130 + 329, 130 + 165};
    return times[settings->rate] + 20u; /* until the processor has noticed, at least, and a little more */
}

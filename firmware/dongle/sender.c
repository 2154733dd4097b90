/* See sender.h. Times are those of the nRF24L01+ product specification. */
#include "sender.h"

#include "nrf24_registers.h"

enum {
    FLAG_RECEIVED = 0x40,
    FLAG_SENT = 0x20,
    FLAG_GIVEN_UP = 0x10,
    FLAGS = 0x70,
    CONFIG_SEND = 0x7E,   /* CRC-16, power up, sender, no interrupts */
    CONFIG_LISTEN = 0x7F, /* the same as a receiver */
    FEATURES = 0x06       /* dynamic length, answers with payload */
};

#define SETTINGS_COUNT 9u
#define POWER_UP_US 5000u /* with the slowest crystals */
#define PULSE_US 15u
#define LOOK_US 20u
#define TURN_US 130u
#define PACKET_BITS 329u
#define SPARE_US 2000u
#define CHECK_US 1000000u
#define CARRIER_US 1000u /* a sender that polls sends something within this time */

typedef struct {
    uint8_t number, value;
} setting;

static void wanted(const cl_dongle_settings *settings, setting list[SETTINGS_COUNT]) {
    static const uint8_t rates[3] = {0x20, 0x00, 0x08};
    const setting all[SETTINGS_COUNT] = {
        {REG_CONFIG, CONFIG_SEND},
        {REG_EN_AA, 0x01},
        {REG_EN_RXADDR, 0x01},
        {REG_SETUP_AW, (uint8_t)(settings->width - 2)},
        {REG_SETUP_RETR, (uint8_t)((settings->delay_us / 250 - 1) << 4 | settings->retries)},
        {REG_RF_CH, settings->channel},
        {REG_RF_SETUP, (uint8_t)(rates[settings->rate] | settings->power << 1)},
        {REG_FEATURE, FEATURES},
        {REG_DYNPD, 0x01},
    };
    for (unsigned index = 0; index < SETTINGS_COUNT; index++)
        list[index] = all[index];
}

/* The bus */

static uint8_t exchange(const cl_sender_pins *pins, uint8_t code, uint8_t value) {
    pins->select(pins->self);
    (void)pins->transfer(pins->self, code);
    uint8_t answer = pins->transfer(pins->self, value);
    pins->deselect(pins->self);
    return answer;
}

static uint8_t command(const cl_sender_pins *pins, uint8_t code) {
    pins->select(pins->self);
    uint8_t status = pins->transfer(pins->self, code);
    pins->deselect(pins->self);
    return status;
}

static void send_bytes(const cl_sender_pins *pins, uint8_t code, const uint8_t *bytes, uint8_t length) {
    pins->select(pins->self);
    (void)pins->transfer(pins->self, code);
    for (unsigned index = 0; index < length; index++)
        (void)pins->transfer(pins->self, bytes[index]);
    pins->deselect(pins->self);
}

static uint8_t read_register(const cl_sender_pins *pins, uint8_t number) { return exchange(pins, number, CMD_NOP); }

static void write_register(const cl_sender_pins *pins, uint8_t number, uint8_t value) {
    (void)exchange(pins, (uint8_t)(CMD_WRITE | number), value);
}

/* Settings */

static bool intact(const cl_sender *sender) {
    setting list[SETTINGS_COUNT];
    wanted(&sender->settings, list);
    for (unsigned index = 0; index < SETTINGS_COUNT; index++)
        if (read_register(&sender->pins, list[index].number) != list[index].value)
            return false;
    return true;
}

void cl_sender_init(cl_sender *sender, const cl_sender_pins *pins) {
    *sender = (cl_sender){.pins = *pins};
    pins->enable(pins->self, false);
}

bool cl_sender_configure(cl_sender *sender, const cl_dongle_settings *settings) {
    const cl_sender_pins *pins = &sender->pins;
    setting list[SETTINGS_COUNT];
    sender->settings = *settings;
    sender->addressed = false;
    wanted(settings, list);
    pins->enable(pins->self, false);
    bool asleep = (read_register(pins, REG_CONFIG) & 0x02u) == 0;
    write_register(pins, REG_FEATURE, FEATURES);
    if (read_register(pins, REG_FEATURE) != FEATURES)
        (void)exchange(pins, CMD_ACTIVATE, ACTIVATE_KEY); /* chips before the plus hide this register until told */
    for (unsigned index = 0; index < SETTINGS_COUNT; index++)
        write_register(pins, list[index].number, list[index].value);
    (void)command(pins, CMD_FLUSH_TX);
    (void)command(pins, CMD_FLUSH_RX);
    write_register(pins, REG_STATUS, FLAGS);
    if (asleep)
        pins->wait_us(pins->self, POWER_UP_US);
    sender->checked_us = pins->now_us(pins->self);
    return intact(sender);
}

/* What to say when a transmission came to nothing: a chip that has lost its settings, by a dip in its supply, gets
 * them again; only one that does not take them is broken. */
static cl_dongle_outcome without_answer(cl_sender *sender) {
    const cl_dongle_settings settings = sender->settings;
    sender->checked_us = sender->pins.now_us(sender->pins.self);
    return intact(sender) || cl_sender_configure(sender, &settings) ? CL_DONGLE_NOTHING : CL_DONGLE_BROKEN;
}

/* Transmissions */

static void point_at(cl_sender *sender, const uint8_t *address) {
    const cl_sender_pins *pins = &sender->pins;
    bool same = sender->addressed;
    for (unsigned index = 0; index < CL_DONGLE_ADDRESS; index++) {
        same = same && sender->address[index] == address[index];
        sender->address[index] = address[index];
    }
    if (!same) { /* the acknowledgement comes back to pipe 0, under the same address */
        send_bytes(pins, CMD_WRITE | REG_TX_ADDR, address, sender->settings.width);
        send_bytes(pins, CMD_WRITE | REG_RX_ADDR_P0, address, sender->settings.width);
        sender->addressed = true;
    }
}

/* The longest that the chip may take by its settings, and a little more. */
static uint32_t patience_us(const cl_dongle_settings *settings) {
    static const uint8_t us_per_bit_x2[3] = {8, 2, 1};
    uint32_t packet_us = PACKET_BITS * us_per_bit_x2[settings->rate] / 2u;
    return (1u + settings->retries) * (TURN_US + packet_us + settings->delay_us) + SPARE_US;
}

static uint8_t await_end(const cl_sender *sender) {
    const cl_sender_pins *pins = &sender->pins;
    uint32_t began_us = pins->now_us(pins->self), limit_us = patience_us(&sender->settings);
    uint8_t status;
    do {
        pins->wait_us(pins->self, LOOK_US);
        status = command(pins, CMD_NOP);
        if ((status & 0x80u) == 0 && (status & (FLAG_SENT | FLAG_GIVEN_UP)) != 0)
            return status;
    } while (pins->now_us(pins->self) - began_us < limit_us);
    return 0;
}

static void take_answer(const cl_sender_pins *pins, cl_dongle_reply *reply) {
    uint8_t width = exchange(pins, CMD_RX_WIDTH, CMD_NOP);
    if (width == 0 || width > CL_DONGLE_PAYLOAD)
        return; /* the queue is corrupt; the next transmission empties it */
    pins->select(pins->self);
    (void)pins->transfer(pins->self, CMD_RX_PAYLOAD);
    for (unsigned index = 0; index < width; index++)
        reply->payload[index] = pins->transfer(pins->self, CMD_NOP);
    pins->deselect(pins->self);
    reply->length = width;
}

cl_dongle_outcome cl_sender_transmit(cl_sender *sender, const uint8_t *address, const uint8_t *payload,
                                     cl_dongle_reply *reply) {
    const cl_sender_pins *pins = &sender->pins;
    reply->length = reply->retries = 0;
    if (pins->now_us(pins->self) - sender->checked_us > CHECK_US && without_answer(sender) == CL_DONGLE_BROKEN)
        return CL_DONGLE_BROKEN;
    point_at(sender, address);
    (void)command(pins, CMD_FLUSH_RX); /* an answer left behind by another transmission is not one to this */
    send_bytes(pins, CMD_TX_PAYLOAD, payload, CL_DONGLE_PAYLOAD);
    pins->enable(pins->self, true);
    pins->wait_us(pins->self, PULSE_US);
    pins->enable(pins->self, false);
    uint8_t status = await_end(sender);
    reply->retries = read_register(pins, REG_OBSERVE_TX) & 0x0Fu;
    if ((status & FLAG_SENT) != 0 && (status & FLAG_RECEIVED) != 0)
        take_answer(pins, reply);
    write_register(pins, REG_STATUS, FLAGS);
    if ((status & FLAG_SENT) != 0)
        return CL_DONGLE_ACKED;
    (void)command(pins, CMD_FLUSH_TX); /* the chip keeps what it could not deliver, and would send it next time */
    return without_answer(sender);
}

bool cl_sender_carrier(cl_sender *sender, uint8_t channel) {
    const cl_sender_pins *pins = &sender->pins;
    pins->enable(pins->self, false);
    write_register(pins, REG_EN_AA, 0); /* or it would acknowledge what another host sends to the node it last sent to */
    write_register(pins, REG_CONFIG, CONFIG_LISTEN);
    write_register(pins, REG_RF_CH, channel);
    pins->enable(pins->self, true);
    pins->wait_us(pins->self, CARRIER_US);
    pins->enable(pins->self, false);
    return (read_register(pins, REG_RPD) & 1u) != 0;
}

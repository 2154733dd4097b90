// The USB dongle of curveline: a Teensy (LC, 3.x or 4.x) with an nRF24L01+ on its SPI bus. See README.md.
//
// All that it does is in dongle.c and sender.c; here are only the pins, the clock and the USB line.
#include <Arduino.h>
#include <SPI.h>

extern "C" {
#include "dongle.h"
#include "sender.h"
}

static const uint8_t CE_PIN = 9;
static const uint8_t CSN_PIN = 10;
static const uint8_t LIGHT_PIN = 14; // pin 13 has the board's own light, but is the clock of the SPI bus
static const uint32_t SPI_HZ = 8000000;

static cl_sender sender;
static cl_dongle dongle;

static void select_chip(void *) {
    SPI.beginTransaction(SPISettings(SPI_HZ, MSBFIRST, SPI_MODE0));
    digitalWrite(CSN_PIN, LOW);
}

static uint8_t transfer_byte(void *, uint8_t byte) { return SPI.transfer(byte); }

static void deselect_chip(void *) {
    digitalWrite(CSN_PIN, HIGH);
    SPI.endTransaction();
}

static void enable_chip(void *, bool on) { digitalWrite(CE_PIN, on ? HIGH : LOW); }

static void wait_us(void *, uint32_t duration_us) { delayMicroseconds(duration_us); }

static uint32_t now_us(void *) { return micros(); }

static bool configure(void *, const cl_dongle_settings *settings) { return cl_sender_configure(&sender, settings); }

static cl_dongle_outcome transmit(void *, const uint8_t *address, const uint8_t *payload, cl_dongle_reply *reply) {
    return cl_sender_transmit(&sender, address, payload, reply);
}

static bool carrier(void *, uint8_t channel) { return cl_sender_carrier(&sender, channel); }

// Each answer leaves at once: the host counts the time since the last one. Serial.write gives up by itself when the host
// takes nothing.
static bool emit(void *, const uint8_t *bytes, size_t length) {
    bool taken = Serial.write(bytes, length) == length;
    Serial.send_now();
    return taken;
}

// What the manufacturer wrote into the chip: no two are the same.
static void read_unique(uint8_t unique[CL_DONGLE_UNIQUE]) {
#if defined(__IMXRT1062__)
    const uint32_t words[4] = {HW_OCOTP_CFG0, HW_OCOTP_CFG1, 0, 0};
#elif defined(KINETISL)
    const uint32_t words[4] = {SIM_UIDL, SIM_UIDML, SIM_UIDMH, 0};
#else
    const uint32_t words[4] = {SIM_UIDL, SIM_UIDML, SIM_UIDMH, SIM_UIDH};
#endif
    for (unsigned index = 0; index < CL_DONGLE_UNIQUE; index++)
        unique[index] = (uint8_t)(words[index / 4] >> 8 * (index % 4));
}

void setup() {
    static const cl_sender_pins pins = {nullptr,     select_chip, transfer_byte, deselect_chip,
                                        enable_chip, wait_us,     now_us};
    static const cl_dongle_radio radio = {nullptr, configure, transmit, carrier};
    static const cl_dongle_line line = {nullptr, emit};
    uint8_t unique[CL_DONGLE_UNIQUE];
    pinMode(CE_PIN, OUTPUT);
    pinMode(CSN_PIN, OUTPUT);
    pinMode(LIGHT_PIN, OUTPUT);
    digitalWrite(CSN_PIN, HIGH);
    SPI.begin();
    Serial.begin(115200);
    read_unique(unique);
    cl_sender_init(&sender, &pins);
    cl_dongle_init(&dongle, &radio, &line, unique);
}

void loop() {
    static bool open = false;
    uint8_t bytes[64];
    size_t length = 0;
    if (open && !Serial.dtr()) // the program at the other end has closed the port, or was killed
        cl_dongle_abandon(&dongle);
    open = Serial.dtr();
    while (length < sizeof bytes && Serial.available() > 0)
        bytes[length++] = (uint8_t)Serial.read();
    cl_dongle_feed(&dongle, bytes, length);
    digitalWrite(LIGHT_PIN, cl_dongle_step(&dongle, millis()) ? HIGH : LOW);
}

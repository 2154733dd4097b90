/* An nRF24L01+ that sends: the radio of the dongle. The chip's pins are function pointers, so that the same source runs
 * on any board and against a model of the chip. Every call returns within a bounded time, whatever the chip does. */
#ifndef CL_SENDER_H
#define CL_SENDER_H

#include <stdbool.h>
#include <stdint.h>

#include "dongle.h"

/* The SPI bus with the chip's select line, its CE line, and a clock. */
typedef struct {
    void *self;
    void (*select)(void *self);
    uint8_t (*transfer)(void *self, uint8_t byte);
    void (*deselect)(void *self);
    void (*enable)(void *self, bool on);
    void (*wait_us)(void *self, uint32_t duration_us);
    uint32_t (*now_us)(void *self);
} cl_sender_pins;

typedef struct {
    cl_sender_pins pins;
    cl_dongle_settings settings;
    uint8_t address[CL_DONGLE_ADDRESS];
    bool addressed;
    uint32_t checked_us; /* when the registers were last seen to be right */
} cl_sender;

void cl_sender_init(cl_sender *sender, const cl_sender_pins *pins);

/* Set every register, and see that it took; false if the chip is not there. */
bool cl_sender_configure(cl_sender *sender, const cl_dongle_settings *settings);

/* Send 32 bytes and wait for the acknowledgement. */
cl_dongle_outcome cl_sender_transmit(cl_sender *sender, const uint8_t *address, const uint8_t *payload,
                                     cl_dongle_reply *reply);

/* Whether there is a carrier on a channel; configure before the next transmission. */
bool cl_sender_carrier(cl_sender *sender, uint8_t channel);

#endif

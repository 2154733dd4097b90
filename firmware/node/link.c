#include "link.h"

#include "tick.h"

#define CHECK_MS 1000
#define RETRY_MS 100 /* a chip takes up to 100 ms from power-on until it listens to anything */
#define DRAIN_MOST 3 /* as many as the chip can queue: a flood must not keep the main loop here */

static const cl_listening *settings;
static bool there;
static bool stale; /* the chip may not hold the newest answer */
static int64_t check_ms;
static uint32_t serial;

void link_start(const cl_listening *radio) {
    settings = radio;
    nrf24_pins();
}

bool link_there(void) { return there; }
bool link_busy(void) { return there && nrf24_calls(); }

static void check(int64_t now_ms) {
    if (now_ms < check_ms) {
        return;
    }
    if (!there || !nrf24_intact(settings)) {
        there = nrf24_start(settings);
        stale = true;
    }
    check_ms = now_ms + (there ? CHECK_MS : RETRY_MS);
}

/* A packet that came in is acknowledged with the answer that was loaded before it; the chip is sending that while the
 * packet is being looked at. Emptying its queue before it is done would spoil the answer. */
static void load(const cl_node *node, uint32_t begin_us) {
    uint32_t since_us = tick_us() - begin_us;
    uint32_t answer_us = nrf24_answer_us(settings);
    if (since_us < answer_us) {
        delay_us(answer_us - since_us);
    }
    nrf24_load(node->ack, node->ack_length);
    serial = node->ack_serial;
    stale = false;
}

void link_serve(cl_node *node, int64_t now_ms) {
    check(now_ms);
    if (!there) {
        return;
    }
    uint32_t begin_us = tick_us();
    for (int count = 0; count < DRAIN_MOST; count++) {
        uint8_t payload[NRF24_PAYLOAD_BYTES];
        uint8_t length = nrf24_receive(payload);
        if (length == 0) {
            break;
        }
        cl_node_receive(node, now_ms, payload, length);
        stale = true; /* the chip drops an answer once it has been delivered */
    }
    if (stale) {
        load(node, begin_us);
    } else if (serial != node->ack_serial) {
        nrf24_load(node->ack, node->ack_length);
        serial = node->ack_serial;
    }
}

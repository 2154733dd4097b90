#include "lamp.h"

#include <stdbool.h>

#include "board.h"

#define SLOT_MS 200
#define FLICKER_MS 40u
#define TRIAL_MS 1000u
#define PAUSE_SLOTS 5
#define BOARD_PORT PORT_C
#define BOARD_PIN 5

static bool borrowed;

static void put(uint8_t port, uint8_t pin, bool on) {
    if (on) {
        GPIO_PSOR(port) = 1u << pin;
    } else {
        GPIO_PCOR(port) = 1u << pin;
    }
}

static void output(uint8_t port, uint8_t pin) {
    put(port, pin, false);
    GPIO_PDDR(port) |= 1u << pin;
    PORT_PCR(port, pin) = PCR_GPIO;
}

void lamp_start(void) { output(LAMP_PORT, LAMP_PIN); }

void lamp_borrow_board(void) {
    output(BOARD_PORT, BOARD_PIN);
    borrowed = true;
}

/* A code is so many flashes, then a pause. */
void lamp_show(uint8_t code, int64_t now_ms) {
    if (code == LAMP_HERE || code == LAMP_TRIAL) {
        uint32_t half_ms = code == LAMP_HERE ? FLICKER_MS : TRIAL_MS;
        put(LAMP_PORT, LAMP_PIN, ((uint32_t)now_ms / half_ms & 1u) == 0);
        return;
    }
    uint32_t slots = code == LAMP_HOMING ? 2u : 2u * code + PAUSE_SLOTS;
    uint32_t slot = (uint32_t)now_ms / SLOT_MS % slots;
    bool on = code == LAMP_STEADY || ((slot & 1u) == 0 && slot < 2u * code);
    put(LAMP_PORT, LAMP_PIN, on);
    if (borrowed) {
        put(BOARD_PORT, BOARD_PIN, on);
    }
}

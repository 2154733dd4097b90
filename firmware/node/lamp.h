/* One lamp that tells a person what the node is up to; firmware/README.md explains its codes. */
#ifndef LAMP_H
#define LAMP_H

#include <stdint.h>

enum {
    LAMP_UNHOMED = 1,
    LAMP_NO_SETTINGS = 2,
    LAMP_NO_RADIO = 3,
    LAMP_FAULT = 4,
    LAMP_POSITION_LOST = 5,
    LAMP_ESTOP = 6,
    LAMP_NO_MEMORY = 7,
    LAMP_TRIAL = 0xFC,  /* one second on, one off: other settings are being tried */
    LAMP_HERE = 0xFD,   /* flickers: a host wants to see which node this is */
    LAMP_HOMING = 0xFE, /* flashes without a pause */
    LAMP_STEADY = 0xFF,
};

void lamp_start(void);

/* Use the LED on the board, too; possible only while the radio does not need its pin. */
void lamp_borrow_board(void);

void lamp_show(uint8_t code, int64_t now_ms);

#endif

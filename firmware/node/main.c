#include "board.h"
#include "encoder.h"
#include "nrf24.h"
#include "program.h"
#include "pwm.h"
#include "settings.h"
#include "tick.h"

static node_settings settings;

void program_tick(void) {}

_Noreturn void program_main(void) {
    clock_start();
    tick_start();
    pwm_start();
    encoder_start();
    nrf24_pins();
    NVIC_ISER = 1u << IRQ_PORT_CD;
    cpu_allow_interrupts();
    bool set = settings_read(&settings);
    bool there = set && nrf24_start(&settings.radio);
    (void)there;
    for (;;) {
        watchdog_main();
        cpu_sleep();
    }
}

#include "tick.h"

#include "kl26.h"
#include "motors.h"
#include "program.h"
#include "supply.h"

#define CORE_MHZ 48u
#define PERIOD (1000u * CORE_MHZ)

static volatile int64_t ticks;

void tick_start(void) {
    SCB_SHPR3 = 0x80000000u; /* below the pins' interrupt, which has priority 0 from reset */
    SYST_RVR = PERIOD - 1;
    SYST_CVR = 0;
    SYST_CSR = 7; /* core clock, interrupt, on */
}

void tick_handler(void) {
    int64_t now = ticks + 1;
    ticks = now;
    watchdog_tick();
    supply_tick();
    motors_tick(now);
}

/* Two words that the interrupt may change between their loads: read until they stay the same. */
int64_t tick_ms(void) {
    for (;;) {
        int64_t now = ticks;
        if (now == ticks) {
            return now;
        }
    }
}

/* If the counter wrapped between the two readings of `ticks`, its value belongs to an unknown one of them. */
uint32_t tick_us(void) {
    for (;;) {
        int64_t before = tick_ms();
        uint32_t left = SYST_CVR;
        if (tick_ms() == before) {
            return (uint32_t)before * 1000u + (PERIOD - 1 - left) / CORE_MHZ;
        }
    }
}

/* Three cycles a turn: what interrupts take is added, so the wait is never too short. */
void delay_us(uint32_t us) {
    uint32_t turns = us * (CORE_MHZ / 3u);
    while (turns-- != 0) {
        __asm__ volatile("");
    }
}

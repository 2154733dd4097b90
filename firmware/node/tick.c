#include "tick.h"

#include "kl26.h"
#include "program.h"

#define CORE_MHZ 48u
#define PERIOD (1000u * CORE_MHZ)

static volatile uint32_t ticks;

void tick_start(void) {
    SCB_SHPR3 = 0x80000000u; /* below the pins' interrupt, which has priority 0 from reset */
    SYST_RVR = PERIOD - 1;
    SYST_CVR = 0;
    SYST_CSR = 7; /* core clock, interrupt, on */
}

void tick_handler(void) {
    ticks++;
    watchdog_tick();
    program_tick();
}

/* 32 bits of milliseconds are 49 days and are read in one go; the rest is kept by the main loop, the only caller. */
int64_t tick_ms(void) {
    static uint32_t last;
    static int64_t epoch;
    uint32_t now = ticks;
    if (now < last) {
        epoch += (int64_t)1 << 32;
    }
    last = now;
    return epoch + now;
}

/* If the counter wrapped between the two readings of `ticks`, its value belongs to an unknown one of them. */
uint32_t tick_us(void) {
    for (;;) {
        uint32_t before = ticks;
        uint32_t left = SYST_CVR;
        if (ticks == before) {
            return before * 1000u + (PERIOD - 1 - left) / CORE_MHZ;
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

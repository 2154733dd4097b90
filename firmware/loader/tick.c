/* Time without interrupts: the loader looks at the core's counter often enough. */
#include "tick.h"

#include "kl26.h"

#define CORE_MHZ 48u
#define CYCLES_PER_MS (1000u * CORE_MHZ)
#define COUNTER_MASK 0xFFFFFFu /* it wraps after 350 ms */

static int64_t ms;
static uint32_t last, cycles;

void tick_start(void) {
    SYST_RVR = COUNTER_MASK;
    SYST_CVR = 0;
    SYST_CSR = 5; /* core clock, no interrupt, on */
    last = SYST_CVR;
}

int64_t tick_ms(void) {
    uint32_t now = SYST_CVR;
    cycles += (last - now) & COUNTER_MASK;
    last = now;
    while (cycles >= CYCLES_PER_MS) {
        cycles -= CYCLES_PER_MS;
        ms++;
    }
    return ms;
}

uint32_t tick_us(void) {
    uint32_t whole = (uint32_t)tick_ms() * 1000u;
    return whole + cycles / CORE_MHZ;
}

void delay_us(uint32_t us) {
    uint32_t turns = us * (CORE_MHZ / 3u);
    while (turns-- != 0) {
        __asm__ volatile("");
    }
}

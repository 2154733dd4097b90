#include "supply.h"

#include "kl26.h"
#include "program.h"
#include "reset.h"
#include "tick.h"

#define LEVEL_2V1 3u /* below the lower reset level */
#define LEVEL_2V9 2u /* below the higher one; what feeds the board is allowed 3.0 V */
#define RISE_MS 200
#define STEADY_MS 50u

#define MEASURE_MS 100
#define BANDGAP_MV 1000u
#define FULL_SCALE 4095u
#define CFG1_12_BITS_3_MHZ 0x74u /* long samples, as so weak a source needs them */
#define SC3_MEAN_OF_32 0x07u

static volatile uint16_t low_ms, good_ms;
static uint16_t measured_mv;
static int64_t measure_ms;

static bool low(uint8_t level) {
    PMC_LVDSC2 = (uint8_t)(PMC_LVDSC2_LEVEL(level) | PMC_LVDSC2_CLEAR);
    return (PMC_LVDSC2 & PMC_LVDSC2_FLAG) != 0;
}

/* A supply that rises slowly would be reset again and again at the higher level: it is given time, and if it needs more, the
 * resets are taken for what they are. That the chip is reset at all may be set once only, and the warning's levels hang on
 * the reset's. No reset but that at power-on brings the lower level back. */
void supply_start(void) {
    if ((PMC_LVDSC1 & PMC_LVDSC1_HIGH) == 0) {
        for (int64_t end_ms = tick_ms() + RISE_MS; low(LEVEL_2V1) && tick_ms() < end_ms;) {
            watchdog_main();
            cpu_sleep();
        }
    }
    reset_supply_rises();
    PMC_LVDSC1 = PMC_LVDSC1_RESET | PMC_LVDSC1_HIGH;
    PMC_LVDSC2 = PMC_LVDSC2_LEVEL(LEVEL_2V9) | PMC_LVDSC2_CLEAR;
    good_ms = 0;
    PMC_REGSC |= PMC_REGSC_BANDGAP;
    SIM_SCGC6 |= SIM_SCGC6_ADC0;
    ADC0_CFG1 = CFG1_12_BITS_3_MHZ;
    ADC0_SC3 = SC3_MEAN_OF_32;
}

/* The chip measures its own reference of 1.00 V in parts of the supply: the lower the supply, the larger the part. */
void supply_serve(int64_t now_ms) {
    if (now_ms < measure_ms) {
        return;
    }
    if ((ADC0_SC1A & ADC_SC1_DONE) != 0) {
        uint32_t part = ADC0_RA;
        measured_mv = part == 0 ? 0 : (uint16_t)((BANDGAP_MV * FULL_SCALE + part / 2u) / part);
    }
    ADC0_SC1A = ADC_CHANNEL_BANDGAP; /* begins the next, which is done long before it is looked at */
    measure_ms = now_ms + MEASURE_MS;
}

uint16_t supply_mv(void) { return measured_mv; }

/* The flag stays until it is cleared, which it only is if the supply is back: no dip is too short to be seen. */
void supply_tick(void) {
    uint8_t status = PMC_LVDSC2;
    if ((status & PMC_LVDSC2_FLAG) != 0) {
        PMC_LVDSC2 = (uint8_t)(status | PMC_LVDSC2_CLEAR);
        good_ms = supply_is_up() ? STEADY_MS : 0;
        low_ms = low_ms < UINT16_MAX ? (uint16_t)(low_ms + 1) : low_ms;
        return;
    }
    low_ms = 0;
    if (good_ms < STEADY_MS && ++good_ms == STEADY_MS) {
        reset_supply_stands();
    }
}

uint16_t supply_low_ms(void) { return low_ms; }

bool supply_is_up(void) { return good_ms == STEADY_MS; }

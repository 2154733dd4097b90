/* 48 MHz from the 16 MHz crystal: core 48 MHz, bus and flash 24 MHz, timers 48 MHz. */
#include "program.h"
#include "kl26.h"

/* The waits below have no bound of their own: a crystal that does not start leaves the motors off and the watchdog,
 * which runs from a clock of its own, tries again four times a second. */
void clock_start(void) {
    OSC0_CR = 0x8Au; /* 10 pF of load, and the oscillator on */
    MCG_C2 = 0x24u;  /* 8 to 32 MHz crystal */
    MCG_C1 = 0xA0u;  /* run from the crystal; 16 MHz / 512 for the FLL, which the switch demands */
    while ((MCG_S & MCG_S_OSCINIT0) == 0) {
    }
    while ((MCG_S & MCG_S_IREFST) != 0) {
    }
    while ((MCG_S & MCG_S_CLKST) != MCG_S_CLKST_EXTERNAL) {
    }
    MCG_C5 = 0x03u; /* 16 MHz / 4 */
    MCG_C6 = 0x40u; /* times 24: 96 MHz */
    while ((MCG_S & MCG_S_PLLST) == 0) {
    }
    while ((MCG_S & MCG_S_LOCK0) == 0) {
    }
    SIM_CLKDIV1 = 0x10010000u; /* core 96 / 2, bus core / 2 */
    MCG_C1 = 0x20u;            /* run from the PLL */
    while ((MCG_S & MCG_S_CLKST) != MCG_S_CLKST_PLL) {
    }
    SIM_SOPT2 = 0x01010000u;   /* timers from PLL / 2 */
    SIM_SCGC4 |= 0x00400000u;  /* SPI0 */
    SIM_SCGC5 |= 0x00003E00u;  /* ports A to E */
    SIM_SCGC6 |= 0x07000001u;  /* timers, flash */
}

/* The tick writes the first half of the watchdog's password and the main loop the second: if either hangs, it bites. */
void watchdog_tick(void) { SIM_SRVCOP = 0x55u; }
void watchdog_main(void) { SIM_SRVCOP = 0xAAu; }

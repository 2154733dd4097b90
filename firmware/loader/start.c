/* From reset to the program, or to the loader's own loop. Until it is known which, nothing is touched that a program expects
 * as a reset leaves it: memory, watchdog, clocks. */
#include "board.h"
#include "layout.h"
#include "loader.h"
#include "program.h"
#include "reset.h"
#include "update.h"

#define SCB_VTOR REG32(0xE000ED08u)

/* Regions of 2 KB, a bit each that is 0 where flash commands are refused, the lowest ones in the last register. Until the
 * next reset bits can only be cleared. */
#define FTFA_FPROT(number) REG8(0x40020010u + (number))
#define LOADER_ONLY 0xE0u      /* region 0 to 4 */
#define WHAT_IS_WRITTEN 0xE0u  /* all but region 29 to 31: description, settings, positions */

/* Somebody holds it while the node is switched on: the way out of a program that turned out bad. */
static bool button_held(void) {
    PORT_PCR(BUTTON_PORT, BUTTON_PIN) = PCR_GPIO | PCR_PULL_UP;
    for (volatile unsigned turns = 0; turns < 50; turns++) { /* the line charges through the pull-up */
    }
    return (GPIO_PDIR(BUTTON_PORT) >> BUTTON_PIN & 1u) == 0;
}

static bool asked_for(void) {
    bool asked = REG32(REQUEST) == REQUEST_WORD && REG32(REQUEST + 4u) == ~REQUEST_WORD;
    REG32(REQUEST) = 0;
    return asked;
}

_Noreturn static void run_program(void) {
    const uint32_t *vectors = (const uint32_t *)PROGRAM_BEGIN;
    FTFA_FPROT(0) = WHAT_IS_WRITTEN;
    FTFA_FPROT(1) = 0;
    FTFA_FPROT(2) = 0;
    FTFA_FPROT(3) = 0;
    SCB_VTOR = PROGRAM_BEGIN;
    __asm__ volatile("msr msp, %0\n\tbx %1" : : "r"(vectors[0]), "r"(vectors[1]) : "memory");
    for (;;) {
    }
}

_Noreturn void reset_handler(void) {
    cpu_mask_interrupts();
    startup_motors_off();
    FTFA_FPROT(3) = LOADER_ONLY;
    bool stays = asked_for() || button_held() || !update_runnable();
    if (!stays && update_kept()) {
        run_program();
    }
    startup_memory();
    if (!stays && update_try()) {
        run_program();
    }
    SIM_COPC = COP_256_MS;
    reset_begin();
    loader_main();
}

/* From reset to the program, or to the loader's own loop. Until it is known which, nothing is touched that a program expects
 * as a reset leaves it: memory, watchdog, clocks. */
#include "board.h"
#include "layout.h"
#include "loader.h"
#include "program.h"
#include "reset.h"
#include "update.h"

extern uint32_t stack_end[], data_source[], data_begin[], data_end[], bss_begin[], bss_end[];

#define SCB_VTOR REG32(0xE000ED08u)

/* Regions of 2 KB, a bit each that is 0 where flash commands are refused, the lowest ones in the last register. Until the
 * next reset bits can only be cleared. */
#define FTFA_FPROT(number) REG8(0x40020010u + (number))
#define LOADER_ONLY 0xE0u      /* region 0 to 4 */
#define WHAT_IS_WRITTEN 0xE0u  /* all but region 29 to 31: description, settings, positions */

#define RAM_BEGIN 0x1FFFF800u
#define RAM_END 0x20001800u
#define COP_256_MS 0x08u

uint32_t startup_noise __attribute__((section(".noinit")));

/* As in the program: what memory holds at power-up goes into the node's nonces. */
static uint32_t ram_noise(void) {
    uint32_t hash = SIM_UIDL;
    for (uintptr_t address = RAM_BEGIN; address < RAM_END; address += 4) {
        hash = (hash ^ *(const volatile uint32_t *)address) * 16777619u;
        hash ^= hash >> 15;
    }
    return hash;
}

static void motors_off(void) {
    SIM_SCGC5 |= 0x3E00u;
    PORT_PCR(NSLEEP_PORT, NSLEEP_PIN) = PCR_GPIO;
    GPIO_PCOR(NSLEEP_PORT) = 1u << NSLEEP_PIN;
    GPIO_PDDR(NSLEEP_PORT) |= 1u << NSLEEP_PIN;
}

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

static void set_up_memory(void) {
    startup_noise = ram_noise();
    const uint32_t *source = data_source;
    for (uint32_t *word = data_begin; word < data_end; word++) {
        *word = *source++;
    }
    for (uint32_t *word = bss_begin; word < bss_end; word++) {
        *word = 0;
    }
}

_Noreturn void loader_reset(void) {
    cpu_mask_interrupts();
    motors_off();
    FTFA_FPROT(3) = LOADER_ONLY;
    bool stays = asked_for() || button_held() || !update_runnable();
    if (!stays && update_kept()) {
        run_program();
    }
    set_up_memory();
    if (!stays && update_try()) {
        run_program();
    }
    SIM_COPC = COP_256_MS;
    reset_begin();
    loader_main();
}

_Noreturn static void fault_handler(void) {
    cpu_mask_interrupts();
    motors_off();
    for (;;) {
    }
}

typedef union {
    uint32_t *stack;
    void (*call)(void);
} vector;

#define FAULT {.call = fault_handler}

__attribute__((section(".vectors"), used)) static const vector vectors[48] = {
    {.stack = stack_end}, {.call = loader_reset}, FAULT, FAULT, FAULT, FAULT, FAULT, FAULT,
    FAULT, FAULT, FAULT, FAULT, FAULT, FAULT, FAULT, {.call = tick_handler},
    FAULT, FAULT, FAULT, FAULT, FAULT, FAULT, FAULT, FAULT,
    FAULT, FAULT, FAULT, FAULT, FAULT, FAULT, FAULT, FAULT,
    FAULT, FAULT, FAULT, FAULT, FAULT, FAULT, FAULT, FAULT,
    FAULT, FAULT, FAULT, FAULT, FAULT, FAULT, FAULT, {.call = pins_handler},
};

/* As in the program. */
__attribute__((section(".flashconfig"), used)) static const uint32_t flash_configuration[4] = {
    0xFFFFFFFFu, 0xFFFFFFFFu, 0xFFFFFFFFu, 0xFFFFF9DEu,
};

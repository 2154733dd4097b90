/* What program and loader have in common at their start: vector table, flash protection, memory; and what happens when one
 * goes astray. */
#include "board.h"
#include "program.h"

extern uint32_t stack_end[], data_source[], data_begin[], data_end[], bss_begin[], bss_end[];

#define RAM_BEGIN 0x1FFFF800u
#define RAM_END 0x20001800u

uint32_t startup_noise __attribute__((section(".noinit")));

/* What RAM holds at power-up differs a little each time, and with it the noise in the node's nonces. Freshness does
 * not hang on it: the boot number makes nonces unique. */
static uint32_t ram_noise(void) {
    uint32_t hash = SIM_UIDL;
    for (uintptr_t address = RAM_BEGIN; address < RAM_END; address += 4) {
        hash = (hash ^ *(const volatile uint32_t *)address) * 16777619u;
        hash ^= hash >> 15;
    }
    return hash;
}

void startup_motors_off(void) {
    SIM_SCGC5 |= 0x3E00u; /* the pins' clocks may not be on yet */
    PORT_PCR(NSLEEP_PORT, NSLEEP_PIN) = PCR_GPIO;
    GPIO_PCOR(NSLEEP_PORT) = 1u << NSLEEP_PIN;
    GPIO_PDDR(NSLEEP_PORT) |= 1u << NSLEEP_PIN;
}

/* Fill memory as the program in C expects it; what it held before is the noise. */
void startup_memory(void) {
    startup_noise = ram_noise();
    const uint32_t *source = data_source;
    for (uint32_t *word = data_begin; word < data_end; word++) {
        *word = *source++;
    }
    for (uint32_t *word = bss_begin; word < bss_end; word++) {
        *word = 0;
    }
}

/* Every exception that should not happen ends here: motors off, then the watchdog, which nobody feeds any more, resets
 * the chip. The mark in flash that a move had begun makes the next boot distrust the position. */
_Noreturn static void fault_handler(void) {
    cpu_mask_interrupts();
    startup_motors_off();
    for (;;) {
    }
}

typedef void (*handler)(void);

/* The first entry is the initial stack pointer, the rest are handlers. */
typedef union {
    uint32_t *stack;
    handler call;
} vector;

#define FAULT {.call = fault_handler}

__attribute__((section(".vectors"), used)) static const vector vectors[48] = {
    {.stack = stack_end}, {.call = reset_handler}, FAULT, FAULT, FAULT, FAULT, FAULT, FAULT,
    FAULT, FAULT, FAULT, FAULT, FAULT, FAULT, FAULT, {.call = tick_handler},
    FAULT, FAULT, FAULT, FAULT, FAULT, FAULT, FAULT, FAULT,
    FAULT, FAULT, FAULT, FAULT, FAULT, FAULT, FAULT, FAULT,
    FAULT, FAULT, FAULT, FAULT, FAULT, FAULT, FAULT, FAULT,
    FAULT, FAULT, FAULT, FAULT, FAULT, FAULT, FAULT, {.call = pins_handler},
};

/* No backdoor key, nothing protected, not secured, NMI pin off, reset pin on: as the Teensy's loader demands. */
__attribute__((section(".flashconfig"), used)) static const uint32_t flash_configuration[4] = {
    0xFFFFFFFFu, 0xFFFFFFFFu, 0xFFFFFFFFu, 0xFFFFF9DEu,
};

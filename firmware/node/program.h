/* What the parts of the node program call each other by. */
#ifndef PROGRAM_H
#define PROGRAM_H

#include <stdbool.h>
#include <stdint.h>

/* Number of this program, by which a host knows what it can ask of it. */
#define FIRMWARE 4u

/* startup.c, of program and loader alike. */
extern uint32_t startup_noise;
void startup_motors_off(void);
void startup_memory(void);

/* chip.c */
uint32_t chip_id(void);

/* clock.c */
void clock_start(void);
void watchdog_tick(void);
void watchdog_main(void);

/* Handlers named in the vector table; the program and the loader have each their own. */
_Noreturn void reset_handler(void);
void tick_handler(void);
void pins_handler(void);

/* main.c */
_Noreturn void program_main(void);

#endif

/* What the parts of the node program call each other by. */
#ifndef PROGRAM_H
#define PROGRAM_H

#include <stdbool.h>
#include <stdint.h>

/* Number of this program, by which a host knows what it can ask of it. */
#define FIRMWARE 4u

/* startup.c */
extern uint32_t startup_noise;

/* clock.c */
void clock_start(void);
void watchdog_tick(void);
void watchdog_main(void);

/* Handlers named in the vector table. */
void tick_handler(void);
void pins_handler(void);

/* main.c */
_Noreturn void program_main(void);

#endif

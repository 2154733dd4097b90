/* Time: milliseconds since power-on, counted by the 1 kHz interrupt that also runs the motors. */
#ifndef TICK_H
#define TICK_H

#include <stdint.h>

void tick_start(void);
int64_t tick_ms(void);

/* Microseconds, wrapping at 2^32. */
uint32_t tick_us(void);

/* Do nothing for a while; interrupts go on. */
void delay_us(uint32_t us);

#endif

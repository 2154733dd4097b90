/* The 3.3 V that processor, encoders and radio live on, watched from above: at 2.9 V encoders are no longer sure to count,
 * at 2.56 V the chip is held in reset. The levels are the chip's own, give or take 80 mV. */
#ifndef SUPPLY_H
#define SUPPLY_H

#include <stdbool.h>
#include <stdint.h>

/* Wait for the supply to come up and set the levels; the tick must run. */
void supply_start(void);

/* From the tick interrupt, once a ms. */
void supply_tick(void);

/* For how many ms in a row the supply has been low. */
uint16_t supply_low_ms(void);

/* How high it is [mV], give or take 3 %; 0 if that is not known yet. */
uint16_t supply_mv(void);

/* From the main loop: measures now and then. */
void supply_serve(int64_t now_ms);

/* Whether it has been up for a while since the program began. */
bool supply_is_up(void);

#endif

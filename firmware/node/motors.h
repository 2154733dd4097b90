/* The motors of the node: the core's drive, ticked at 1 kHz, on real encoders and real drivers. */
#ifndef MOTORS_H
#define MOTORS_H

#include <stdbool.h>
#include <stdint.h>

#include "motion.h"
#include "plant.h"

void motors_start(void);

/* From the tick interrupt, once a ms. */
void motors_tick(int64_t now_ms);

/* The motors as the node's state machine sees them; for the main loop only. */
cl_plant motors_plant(void);

/* Whether there is news for the node since the last call. */
bool motors_news(void);

/* Nothing turns, nothing is about to. */
bool motors_still(void);

/* Let the drivers work, or put them to sleep. */
void motors_allow(void);
void motors_forbid(void);

void motors_where(cl_counts *encoders);

#endif

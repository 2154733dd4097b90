/* The motors of the node: the core's drive, ticked at 1 kHz, on real encoders and real drivers. */
#ifndef MOTORS_H
#define MOTORS_H

#include <stdbool.h>
#include <stdint.h>

#include "homing.h"
#include "motion.h"
#include "plant.h"

void motors_start(void);

/* From the tick interrupt, once a ms. */
void motors_tick(int64_t now_ms);

/* The motors as the node's state machine sees them, but for searches (home.h); for the main loop only. */
cl_plant motors_plant(void);

/* Whether there is news for the node since the last call. */
bool motors_news(void);

/* Nothing turns, nothing is about to. */
bool motors_still(void);

/* Let the drivers work, or put them to sleep. */
void motors_allow(void);
void motors_forbid(void);

void motors_where(cl_counts *encoders);

/* Whether the encoders have kept up, as far as anybody can tell: false from an encoder's fault, or a low supply, to the
 * next homing. */
bool motors_sure(void);

/* Whether the supply has been too low since the last call: for too long at rest, or at all in motion. */
bool motors_underfed(void);

/* Look for the zeros of the axes of `which` (bit 0 for the first); `axes` has to stay. Until it has ended, the plant does
 * nothing. */
void motors_seek(const cl_homing_axis axes[CL_AXES], uint8_t which);

/* How that goes. Once it has ended, `reasons` say what came of it, counts are those from the new zeros, and the plant works
 * again. */
cl_homing_status motors_sought(cl_reasons *reasons);

/* Stop looking; motors off. */
void motors_abandon(void);

/* Whether the switch at the end of the rod is fitted: it is closed unless the rod is at its end. */
bool motors_rod_switch(void);

#endif

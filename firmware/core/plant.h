/* Motors and encoders of a node: the seam through which a node moves. */
#ifndef CL_PLANT_H
#define CL_PLANT_H

#include <stdbool.h>
#include <stdint.h>

#include "motion.h"
#include "workbench.h"

typedef struct {
    int64_t at_ms;
    uint8_t fault, axis; /* CL_FAULT_..., axis from 1 */
} cl_plant_fault;

/* How a search for zeros ends, and when; `reasons` of the sought axes only. */
typedef struct {
    int64_t at_ms;
    cl_reasons reasons;
} cl_sought;

/* What a plant sees of itself: encoder counts, lines (CL_LINE_...), supply; the rest is of one axis: missed edges, duty now,
   largest lag of the last move, threshold of the last turn, kept samples, and some of them. */
typedef struct {
    cl_counts counts;
    uint8_t lines, samples;
    uint16_t supply_mv; /* 0 if the chip cannot tell */
    uint16_t missed, lag, threshold;
    int16_t duty;
    int16_t trace[CL_READING_SAMPLES];
} cl_look;

/* What a node runs under: whether on trial, its generation, and that which is stored and was not tried, or the same. */
typedef struct {
    bool on_trial;
    uint16_t generation, stored;
} cl_standing;

/* All times are milliseconds since the node was switched on. */
typedef struct cl_plant {
    void *self;
    /* From now on track the set-points of `move`, which began at `start_ms`. */
    void (*follow)(void *self, int64_t now_ms, int64_t start_ms, const cl_move *move);
    void (*positions)(void *self, int64_t now_ms, cl_counts *counts);
    /* When all axes are or will be at rest; false if that is not known (yet). */
    bool (*settles)(void *self, int64_t *at_ms);
    /* The fault that the present move has met or will meet; false if none is known (yet). */
    bool (*fault)(void *self, cl_plant_fault *fault);
    /* Find the zeros of some axes (bit 0 for the first) and go there. */
    void (*seek)(void *self, int64_t now_ms, uint8_t axes);
    /* How and when the search ends; false if that is not known (yet) or there is none. */
    bool (*sought)(void *self, cl_sought *sought);
    /* End the search, or the turn, where it is. */
    void (*give_up)(void *self, int64_t now_ms);
    /* Turn one motor without a loop. */
    void (*turn)(void *self, int64_t now_ms, const cl_turn *turn);
    /* When the turn ends; false if that is not known (yet) or there is none. */
    bool (*turned)(void *self, int64_t *at_ms);
    /* Where an axis (from 1) rests is `counts` from now on. */
    void (*place)(void *self, int64_t now_ms, uint8_t axis, int32_t counts);
    /* What can be seen of the motors, of an axis (from 1), and of the samples of the last turn from `first` on. */
    void (*look)(void *self, int64_t now_ms, uint8_t axis, uint8_t first, cl_look *seen);
    /* Put other settings, a record, aside: CL_OUTCOME_..., BEYOND if it is not the next one and a good one, FAILED if it did
       not hold. */
    uint8_t (*store)(void *self, const uint8_t *record);
    /* Let the next start be under what is stored: BEYOND if there is nothing. */
    uint8_t (*request)(void *self);
    /* The settings on trial are those of the node from now on. */
    uint8_t (*keep)(void *self);
    /* Forget what is stored and was not tried. */
    void (*drop)(void *self);
    void (*standing)(void *self, cl_standing *now);
    /* Let the loader go on the air at the next start; null if there is none. */
    void (*loader)(void *self);
} cl_plant;

#endif

/* Motors and encoders of a node as its state machine sees them; curveline/radio/plant.py says the same in Python. */
#ifndef CL_PLANT_H
#define CL_PLANT_H

#include <stdbool.h>
#include <stdint.h>

#include "motion.h"

/* Why a node is in FAULT or POSITION_LOST: the codes of a STATUS frame, the same as frames.py's Fault. */
typedef enum {
    CL_FAULT_NONE = 0,
    CL_FAULT_CONFLICT = 1,
    CL_FAULT_LIMIT = 2,
    CL_FAULT_STALL = 3,
    CL_FAULT_RUNAWAY = 4,
    CL_FAULT_ENCODER = 5,
    CL_FAULT_DRIVER = 6,
    CL_FAULT_BROWN_OUT = 7
} cl_fault;

typedef struct {
    int64_t at_ms; /* when, in ms since power-on */
    uint8_t fault; /* a cl_fault */
    uint8_t axis;  /* from 1, 0 for none in particular */
} cl_plant_fault;

typedef struct cl_plant {
    void *self;
    /* From now on track the set-points of `move`, which began at `start_ms`. */
    void (*follow)(void *self, int64_t now_ms, int64_t start_ms, const cl_move *move);
    /* Encoder counts now. */
    void (*positions)(void *self, int64_t now_ms, cl_counts *counts);
    /* When all axes are at rest; false if that is not known (yet). */
    bool (*settles)(void *self, int64_t *at_ms);
    /* The fault that the present move ran into; false if there is none. */
    bool (*fault)(void *self, cl_plant_fault *fault);
} cl_plant;

#endif

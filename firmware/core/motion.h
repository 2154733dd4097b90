/* Synchronised trapezoids in integers, the same to the count as curveline/radio/protocol/motion.py. */
#ifndef CL_MOTION_H
#define CL_MOTION_H

#include <stdint.h>

#include "frames.h"

enum { CL_UNBRAKED = -1 };

/* Speeds and accelerations [counts/s, counts/s^2] between which all products fit 64 bits, as long as targets stay within
   CL_POSITION_LIMIT and positions within twice that. Whatever else a plant says makes a wrong move, but a defined one. */
#define CL_LEAST_RATE 100
#define CL_MOST_RATE 1000000

typedef struct {
    int32_t low, high;    /* counts */
    int32_t speed;        /* counts/s */
    int32_t acceleration; /* counts/s^2 */
} cl_axis_limits;

typedef struct {
    cl_counts start, target;
    int32_t duration_ms;
    int32_t ramp_ms;
    int32_t brake_ms; /* when it is broken off, CL_UNBRAKED if it is not */
} cl_move;

/* 16 bits that differ when host and node disagree about limits. */
uint16_t cl_config_hash(const cl_axis_limits axes[CL_AXES]);

/* Number (from 1) of the first axis that `target` would take out of its limits, 0 if none. */
uint8_t cl_outside(const cl_axis_limits axes[CL_AXES], const cl_counts *target);

/* The quickest move within the limits of all axes, stretched at cruise speed to last `least_ms` at least. */
void cl_plan_move(cl_move *move, const cl_counts *target, const cl_axis_limits axes[CL_AXES], int32_t least_ms);

/* Slow down from `at_ms` on at the rate of the move's own ramp; a braked move stays as it is. */
void cl_move_brake(cl_move *move, int64_t at_ms);

/* When the axes stand still again [ms from the start of the move]. */
int32_t cl_move_end_ms(const cl_move *move);

/* Set-points `at_ms` after the start. */
void cl_move_at(const cl_move *move, int64_t at_ms, cl_counts *counts);

/* Share of a braked move's duration that is still to be done [ms], rounded up. */
int32_t cl_move_rest_ms(const cl_move *move);

#endif

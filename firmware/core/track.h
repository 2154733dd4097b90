/* Set-points of a move, one ms after the other, without a division.

   Duty: the same counts as `cl_move_at` gives, to the count, for about a tenth of its time on a processor that divides
   64 bits in a thousand cycles. It walks: the numerator of the set-point grows by a product of 32-bit numbers per ms,
   and whole counts are taken out of it as they come up (a handful per ms).
   Units: counts, ms; speeds in counts/s.
   Source: the formulas of curveline/radio/protocol/motion.py. */
#ifndef CL_TRACK_H
#define CL_TRACK_H

#include <stdbool.h>

#include "motion.h"

typedef struct {
    uint64_t rest;     /* of the set-point's division by `half_length` */
    uint32_t distance; /* counts from start to target */
    uint32_t part;     /* counts from the start */
    int32_t rise;      /* counts/s per ms while the speed rises, with as many binary places as 32 bits have room for */
    uint8_t places;
} cl_track_axis;

typedef struct {
    cl_move move;
    uint64_t half_length;
    int32_t at_ms;
    int32_t end_ms;
    int32_t speed, next; /* along the path, now and 1 ms later; rises by 1 per ms */
    cl_track_axis axis[CL_AXES];
} cl_track;

typedef struct {
    int32_t at;    /* counts */
    int32_t speed; /* counts/s */
    int32_t lead;  /* counts/s: speed that a motor has to be asked for now in order to have `speed` */
    bool moving;   /* the set-point is still on its way */
} cl_setpoint;

/* Stand still at `counts`. */
void cl_track_rest(cl_track *track, const cl_counts *counts);

/* Begin a move; the set-point is at its start. */
void cl_track_begin(cl_track *track, const cl_move *move);

/* The move that is under way will be broken off as `move` says. */
void cl_track_brake(cl_track *track, const cl_move *move);

/* Walk to `at_ms` of the move, also backwards. */
void cl_track_to(cl_track *track, int64_t at_ms);

/* Where the set-point of an axis (from 0) is, and how fast; `lead_ms` is the time constant of the motor,
   255 at most. */
void cl_track_setpoint(const cl_track *track, unsigned axis, int32_t lead_ms, cl_setpoint *setpoint);

#endif

/* Set-points walked ms by ms against the same computed afresh. */
#include <stdlib.h>

#include "track.h"

/* A move, and what happens to it: `stride` ms between looks; broken off at `brake_ms` (CL_UNBRAKED for never), which
   becomes known `late_ms` later. */
typedef struct {
    cl_move move;
    int32_t stride, brake_ms, late_ms;
} walk;

int32_t walk_differs(const walk *way);
int32_t walk_speed_error(const cl_move *move);

/* The first ms at which walked and computed set-points differ, -1 if they never do. */
int32_t walk_differs(const walk *way) {
    cl_track track;
    cl_move move = way->move;
    bool known = way->brake_ms == CL_UNBRAKED;
    cl_track_begin(&track, &move);
    for (int32_t at_ms = 0; at_ms <= cl_move_end_ms(&move) + 2 * way->stride; at_ms += way->stride) {
        cl_track_to(&track, at_ms);
        if (!known && at_ms >= way->brake_ms + way->late_ms) {
            known = true;
            cl_move_brake(&move, way->brake_ms);
            cl_track_brake(&track, &move);
        }
        cl_counts wanted;
        cl_move_at(&move, at_ms, &wanted);
        for (unsigned axis = 0; axis < CL_AXES; axis++) {
            cl_setpoint setpoint;
            cl_track_setpoint(&track, axis, 30, &setpoint);
            if (setpoint.at != wanted.at[axis]) return at_ms;
            if (setpoint.moving != (at_ms < cl_move_end_ms(&move) && move.start.at[axis] != move.target.at[axis])) return at_ms;
        }
    }
    return -1;
}

/* By how much the walked speed is at odds with the counts of 64 ms, at worst [counts/s]. */
int32_t walk_speed_error(const cl_move *move) {
    enum { SPAN_MS = 64 };
    cl_track track;
    int32_t worst = 0;
    cl_track_begin(&track, move);
    for (int32_t at_ms = SPAN_MS / 2; at_ms + SPAN_MS / 2 <= move->duration_ms; at_ms++) {
        cl_counts before, after;
        cl_move_at(move, at_ms - SPAN_MS / 2, &before);
        cl_move_at(move, at_ms + SPAN_MS / 2, &after);
        cl_track_to(&track, at_ms);
        for (unsigned axis = 0; axis < CL_AXES; axis++) {
            cl_setpoint setpoint;
            cl_track_setpoint(&track, axis, 30, &setpoint);
            int32_t mean = (after.at[axis] - before.at[axis]) * 1000 / SPAN_MS;
            worst = abs(mean - setpoint.speed) > worst ? abs(mean - setpoint.speed) : worst;
        }
    }
    return worst;
}

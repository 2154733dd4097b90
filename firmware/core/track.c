#include "track.h"

#define FRACTION 16
#define MOST_SPEED (1 << 24) /* counts/s: beyond any motor, and small enough for 32-bit products with gains */

/* The product of two 32-bit numbers out of four 16-bit ones, which a Cortex-M0+ multiplies in a cycle each. */
static uint64_t product(uint32_t one, uint32_t other) {
    uint32_t low = (one & 0xFFFF) * (other & 0xFFFF), high = (one >> 16) * (other >> 16);
    uint32_t cross = (one >> 16) * (other & 0xFFFF), across = (one & 0xFFFF) * (other >> 16);
    uint64_t sum = ((uint64_t)high << 32 | low) + ((uint64_t)cross << 16);
    return sum + ((uint64_t)across << 16);
}

static int32_t least(int32_t one, int32_t other) { return one < other ? one : other; }

/* Speed along the path at a moment, in units that rise by 1 per ms. */
static int32_t path_speed(const cl_track *track, int32_t at_ms) {
    int32_t speed = least(least(at_ms, track->move.ramp_ms), track->move.duration_ms - at_ms);
    if (track->move.brake_ms != CL_UNBRAKED && at_ms > track->move.brake_ms) {
        speed = least(speed, track->end_ms - at_ms);
    }
    return speed;
}

void cl_track_rest(cl_track *track, const cl_counts *counts) {
    const cl_move none = {*counts, *counts, 2, 1, CL_UNBRAKED};
    cl_track_begin(track, &none);
    track->at_ms = track->end_ms;
}

void cl_track_begin(cl_track *track, const cl_move *move) {
    uint32_t spread = (uint32_t)(move->duration_ms - move->ramp_ms);
    track->move = *move;
    track->half_length = product((uint32_t)move->ramp_ms, spread);
    track->at_ms = 0;
    track->end_ms = cl_move_end_ms(move);
    for (unsigned index = 0; index < CL_AXES; index++) {
        cl_track_axis *axis = &track->axis[index];
        int64_t way = (int64_t)move->target.at[index] - move->start.at[index];
        axis->distance = (uint32_t)(way < 0 ? -way : way);
        axis->part = 0;
        axis->rest = track->half_length; /* half of what makes a count: rounding */
        uint64_t rise = (product(axis->distance, 1000) << FRACTION) / track->half_length;
        axis->rise = rise > UINT32_MAX ? UINT32_MAX : (uint32_t)rise;
    }
}

void cl_track_brake(cl_track *track, const cl_move *move) {
    int32_t at_ms = track->at_ms;
    if (move->brake_ms != CL_UNBRAKED) cl_track_to(track, least(at_ms, move->brake_ms));
    track->move.brake_ms = move->brake_ms;
    track->end_ms = cl_move_end_ms(move);
    cl_track_to(track, at_ms);
}

/* Take whole counts out of the rest: a binary division that starts at the few bits a ms can bring. */
static void carry(cl_track_axis *axis, uint64_t length) {
    while (axis->rest >= length << 3) {
        axis->rest -= length << 3;
        axis->part += 8;
    }
    for (unsigned bit = 3; bit-- > 0;) {
        if (axis->rest >= length << bit) {
            axis->rest -= length << bit;
            axis->part += (uint32_t)1 << bit;
        }
    }
}

static void borrow(cl_track_axis *axis, uint64_t take, uint64_t length) {
    while (axis->rest < take) {
        axis->rest += length;
        axis->part--;
    }
    axis->rest -= take;
}

void cl_track_to(cl_track *track, int64_t at_ms) {
    int32_t goal = at_ms < 0 ? 0 : at_ms > track->end_ms ? track->end_ms : (int32_t)at_ms;
    while (track->at_ms != goal) {
        bool ahead = track->at_ms < goal;
        int32_t next = track->at_ms + (ahead ? 1 : -1);
        uint32_t way = (uint32_t)(path_speed(track, track->at_ms) + path_speed(track, next));
        for (unsigned index = 0; index < CL_AXES; index++) {
            cl_track_axis *axis = &track->axis[index];
            uint64_t step = product(axis->distance, way);
            if (ahead) {
                axis->rest += step;
                carry(axis, 2 * track->half_length);
            } else {
                borrow(axis, step, 2 * track->half_length);
            }
        }
        track->at_ms = next;
    }
}

static int32_t speed_of(const cl_track_axis *axis, int32_t path) {
    uint64_t speed = product(axis->rise, (uint32_t)(path < 0 ? -path : path)) >> FRACTION;
    int32_t capped = speed > MOST_SPEED ? MOST_SPEED : (int32_t)speed;
    return path < 0 ? -capped : capped;
}

void cl_track_setpoint(const cl_track *track, unsigned axis, int32_t lead_ms, cl_setpoint *setpoint) {
    const cl_track_axis *walk = &track->axis[axis];
    const cl_move *move = &track->move;
    bool forward = move->target.at[axis] >= move->start.at[axis];
    uint32_t start = (uint32_t)move->start.at[axis];
    setpoint->at = (int32_t)(forward ? start + walk->part : start - walk->part);
    setpoint->moving = track->at_ms < track->end_ms && walk->distance > 0;
    int32_t path = path_speed(track, track->at_ms), lead = 0;
    if (setpoint->moving) lead = path + lead_ms * (path_speed(track, track->at_ms + 1) - path);
    setpoint->speed = speed_of(walk, forward ? path : -path);
    setpoint->lead = speed_of(walk, forward ? lead : -lead);
}


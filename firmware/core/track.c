#include "track.h"

enum { MOST_PLACES = 16, MOST_LEAD_MS = 255 };

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

static void look(cl_track *track) {
    track->speed = path_speed(track, track->at_ms);
    track->next = track->at_ms < track->end_ms ? path_speed(track, track->at_ms + 1) : track->speed;
}

void cl_track_rest(cl_track *track, const cl_counts *counts) {
    const cl_move none = {*counts, *counts, 2, 1, CL_UNBRAKED};
    cl_track_begin(track, &none);
    track->at_ms = track->end_ms;
    look(track);
}

/* Counts/s per ms of rising speed; no speed of the move, and no lead over it, may need more than 31 bits. */
static void set_rise(cl_track *track, cl_track_axis *axis) {
    uint64_t rise = (product(axis->distance, 1000) << MOST_PLACES) / track->half_length;
    uint32_t most = (uint32_t)INT32_MAX / ((uint32_t)track->move.ramp_ms + MOST_LEAD_MS);
    axis->places = MOST_PLACES;
    while (rise > most && axis->places > 0) {
        rise >>= 1;
        axis->places--;
    }
    axis->rise = (int32_t)(rise > most ? most : rise);
}

void cl_track_begin(cl_track *track, const cl_move *move) {
    track->move = *move;
    track->half_length = product((uint32_t)move->ramp_ms, (uint32_t)(move->duration_ms - move->ramp_ms));
    track->at_ms = 0;
    track->end_ms = cl_move_end_ms(move);
    for (unsigned index = 0; index < CL_AXES; index++) {
        cl_track_axis *axis = &track->axis[index];
        int64_t way = (int64_t)move->target.at[index] - move->start.at[index];
        axis->distance = (uint32_t)(way < 0 ? -way : way);
        axis->part = 0;
        axis->rest = track->half_length; /* half of what makes a count: rounding */
        set_rise(track, axis);
    }
    look(track);
}

void cl_track_brake(cl_track *track, const cl_move *move) {
    int32_t at_ms = track->at_ms;
    if (move->brake_ms != CL_UNBRAKED) cl_track_to(track, least(at_ms, move->brake_ms));
    track->move.brake_ms = move->brake_ms;
    track->end_ms = cl_move_end_ms(move);
    look(track);
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

static void step(cl_track *track, uint32_t way, bool ahead) {
    uint64_t length = 2 * track->half_length;
    for (unsigned index = 0; index < CL_AXES; index++) {
        cl_track_axis *axis = &track->axis[index];
        if (axis->distance == 0) continue;
        uint64_t grown = product(axis->distance, way);
        if (ahead) {
            axis->rest += grown;
            carry(axis, length);
        } else {
            borrow(axis, grown, length);
        }
    }
}

void cl_track_to(cl_track *track, int64_t at_ms) {
    int32_t goal = at_ms < 0 ? 0 : at_ms > track->end_ms ? track->end_ms : (int32_t)at_ms;
    while (track->at_ms < goal) {
        step(track, (uint32_t)(track->speed + track->next), true);
        track->at_ms++;
        look(track);
    }
    while (track->at_ms > goal) {
        track->at_ms--;
        look(track);
        step(track, (uint32_t)(track->speed + track->next), false);
    }
}

void cl_track_setpoint(const cl_track *track, unsigned axis, int32_t lead_ms, cl_setpoint *setpoint) {
    const cl_track_axis *walk = &track->axis[axis];
    uint32_t start = (uint32_t)track->move.start.at[axis];
    bool forward = track->move.target.at[axis] >= track->move.start.at[axis];
    setpoint->at = (int32_t)(forward ? start + walk->part : start - walk->part);
    setpoint->moving = track->at_ms < track->end_ms && walk->distance > 0;
    setpoint->speed = setpoint->lead = 0;
    if (setpoint->moving) {
        int32_t rise = forward ? walk->rise : -walk->rise;
        setpoint->speed = rise * track->speed >> walk->places;
        setpoint->lead = rise * (track->speed + lead_ms * (track->next - track->speed)) >> walk->places;
    }
}

#include "motion.h"

#include "blake2s.h"
#include "bytes.h"

/* Further than any target can be from any position that makes sense; durations then fit 31 bits. */
#define FARTHEST 0x1000000

/* Distances are taken in 64 bits, because two 32-bit counts may be further apart than 32 bits tell. */
static uint64_t apart(int32_t one, int32_t other) {
    int64_t difference = (int64_t)one - other;
    if (difference < 0) difference = -difference;
    return difference < FARTHEST ? (uint64_t)difference : FARTHEST;
}

static uint64_t ceil_div(uint64_t number, uint64_t divisor) { return (number + divisor - 1) / divisor; }

/* The least whole number whose square is `number` at least. */
static uint64_t ceil_root(uint64_t number) {
    uint64_t root = 0, rest = number - 1;
    for (uint64_t bit = (uint64_t)1 << 62; bit > 0; bit >>= 2) {
        uint64_t tried = root + bit;
        root >>= 1;
        if (rest >= tried) {
            rest -= tried;
            root += bit;
        }
    }
    return root + 1;
}

uint16_t cl_config_hash(const cl_axis_limits axes[CL_AXES]) {
    uint8_t packed[CL_AXES * 32], digest[2];
    for (unsigned axis = 0; axis < CL_AXES; axis++) {
        uint8_t *to = packed + 32 * axis;
        cl_put64(to, (uint64_t)(int64_t)axes[axis].low);
        cl_put64(to + 8, (uint64_t)(int64_t)axes[axis].high);
        cl_put64(to + 16, (uint64_t)axes[axis].speed);
        cl_put64(to + 24, (uint64_t)axes[axis].acceleration);
    }
    cl_blake2s((cl_bytes){0, 0}, (cl_bytes){packed, sizeof packed}, digest, sizeof digest);
    return cl_get16(digest);
}

uint8_t cl_outside(const cl_axis_limits axes[CL_AXES], const cl_counts *target) {
    for (uint8_t axis = 0; axis < CL_AXES; axis++) {
        if (target->at[axis] < axes[axis].low || target->at[axis] > axes[axis].high) return (uint8_t)(axis + 1);
    }
    return 0;
}

void cl_plan_move(cl_move *move, const cl_counts *target, const cl_axis_limits axes[CL_AXES], int32_t least_ms) {
    uint64_t spread = 1, product = 1; /* duration - ramp; ramp x (duration - ramp) */
    for (unsigned axis = 0; axis < CL_AXES; axis++) {
        uint64_t distance = apart(target->at[axis], move->start.at[axis]);
        uint64_t at_speed = ceil_div(1000 * distance, (uint64_t)axes[axis].speed);
        uint64_t at_acceleration = ceil_div(1000000 * distance, (uint64_t)axes[axis].acceleration);
        if (at_speed > spread) spread = at_speed;
        if (at_acceleration > product) product = at_acceleration;
    }
    if (spread * spread < product) spread = ceil_root(product);
    uint64_t ramp = ceil_div(product, spread);
    move->target = *target;
    move->duration_ms = (int32_t)(spread + ramp);
    if (move->duration_ms < least_ms) move->duration_ms = least_ms;
    move->ramp_ms = (int32_t)ramp;
    move->brake_ms = CL_UNBRAKED;
}

static int32_t clamped(int64_t value, int32_t high) {
    if (value < 0) return 0;
    return value > high ? high : (int32_t)value;
}

static int32_t least(int32_t one, int32_t other) { return one < other ? one : other; }

/* Speed along the path, which rises by 1 per ms. */
static int32_t speed(const cl_move *move, int32_t at_ms) {
    return least(least(at_ms, move->ramp_ms), move->duration_ms - at_ms);
}

/* Path length in the units of `travelled`. */
static uint64_t path_length(const cl_move *move) {
    return 2 * (uint64_t)move->ramp_ms * (uint64_t)(move->duration_ms - move->ramp_ms);
}

static uint64_t unbraked(const cl_move *move, int32_t at_ms) {
    uint64_t time = (uint64_t)at_ms, ramp = (uint64_t)move->ramp_ms;
    if (at_ms <= move->ramp_ms) return time * time;
    if (at_ms <= move->duration_ms - move->ramp_ms) return ramp * (2 * time - ramp);
    uint64_t left = (uint64_t)(move->duration_ms - at_ms);
    return path_length(move) - left * left;
}

/* How far along the path the set-point is: twice the integral of speed. */
static uint64_t travelled(const cl_move *move, int64_t at_ms) {
    int32_t at = clamped(at_ms, move->duration_ms);
    if (move->brake_ms == CL_UNBRAKED || at <= move->brake_ms) return unbraked(move, at);
    int32_t begins_at = speed(move, move->brake_ms);
    uint64_t braking = (uint64_t)least(at - move->brake_ms, begins_at);
    return unbraked(move, move->brake_ms) + 2 * (uint64_t)begins_at * braking - braking * braking;
}

void cl_move_brake(cl_move *move, int64_t at_ms) {
    if (move->brake_ms == CL_UNBRAKED) move->brake_ms = clamped(at_ms, move->duration_ms);
}

int32_t cl_move_end_ms(const cl_move *move) {
    if (move->brake_ms == CL_UNBRAKED) return move->duration_ms;
    return move->brake_ms + speed(move, move->brake_ms);
}

void cl_move_at(const cl_move *move, int64_t at_ms, cl_counts *counts) {
    uint64_t done = travelled(move, at_ms), length = path_length(move);
    for (unsigned axis = 0; axis < CL_AXES; axis++) {
        int32_t start = move->start.at[axis], target = move->target.at[axis];
        int64_t part = (int64_t)((2 * apart(target, start) * done + length) / (2 * length));
        counts->at[axis] = (int32_t)(target > start ? start + part : start - part);
    }
}

/* The product of duration and rest may have more than 64 bits if a move takes days: it is divided in two parts. */
int32_t cl_move_rest_ms(const cl_move *move) {
    uint64_t length = path_length(move), rest = length - travelled(move, cl_move_end_ms(move));
    uint32_t duration = (uint32_t)move->duration_ms;
    uint64_t high = (duration >> 16) * rest;
    return (int32_t)((high / length << 16) + ceil_div((high % length << 16) + (duration & 0xFFFFu) * rest, length));
}

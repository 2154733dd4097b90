/* Test bench for homing: three modelled motors between stops, with switches that bounce, in virtual time. */
#include <stdlib.h>

#include "homing.h"
#include "motor.h"

typedef struct {
    int64_t now_ms;
    int32_t switch_at[3];  /* motor position below which the switch is closed */
    int32_t bounce_ms[3];  /* for how long it bounces */
    int32_t broken[3];     /* 0 works, 1 never closes, 2 never opens, 3 closes at random places */
    int32_t reasons[3], status, phase;
    int32_t driver_low;
    uint32_t random;
    int16_t pwm[3];
    int32_t since_ms[3];   /* since the contact changed */
    int32_t closed[3];
    motor motors[3];
    cl_homing_axis axes[3];
    cl_homing homing;
} bench;

bench *bench_new(uint32_t seed);
void bench_free(bench *b);
motor *bench_motor(bench *b, int axis);
cl_homing_axis *bench_axis(bench *b, int axis);
void bench_start(bench *b, uint8_t which);
int64_t bench_run(bench *b, int64_t ms);
void bench_positions(const bench *b, int32_t at[3]);
void bench_abort(bench *b);

bench *bench_new(uint32_t seed) {
    bench *b = calloc(1, sizeof *b);
    if (b == NULL) abort();
    b->random = seed * 2654435761u + 1;
    for (int axis = 0; axis < 3; axis++) {
        b->motors[axis] = (motor)MOTOR_NEW;
        b->axes[axis] = cl_homing_standard[axis];
        b->bounce_ms[axis] = 3;
    }
    return b;
}

void bench_free(bench *b) { free(b); }

motor *bench_motor(bench *b, int axis) { return &b->motors[axis]; }

cl_homing_axis *bench_axis(bench *b, int axis) { return &b->axes[axis]; }

static uint32_t draw(bench *b) {
    b->random = b->random * 1664525u + 1013904223u;
    return b->random >> 16;
}

/* What the pin of a switch reads: while it bounces, anything. */
static bool contact(bench *b, int axis) {
    int32_t closed = b->motors[axis].position < b->switch_at[axis];
    if (b->broken[axis] == 1) return false;
    if (b->broken[axis] == 2) return true;
    if (b->broken[axis] == 3) closed = b->motors[axis].position < b->switch_at[axis] - (int32_t)(b->now_ms / 1000 % 2 * 400);
    if (closed != b->closed[axis]) b->since_ms[axis] = 0;
    b->closed[axis] = closed;
    return b->since_ms[axis]++ < b->bounce_ms[axis] ? draw(b) & 1 : closed != 0;
}

static cl_homing_input look(bench *b) {
    cl_homing_input input = {.driver_fault = b->driver_low > 0 && b->driver_low-- > 0};
    for (int axis = 0; axis < 3; axis++) {
        input.encoders.at[axis] = b->motors[axis].count;
        if (contact(b, axis)) input.switches |= (uint8_t)(1 << axis);
    }
    return input;
}

static void see(bench *b) {
    for (int axis = 0; axis < 3; axis++) b->reasons[axis] = b->homing.reasons.of[axis];
    b->status = b->homing.status;
    b->phase = b->homing.phase;
}

void bench_start(bench *b, uint8_t which) {
    for (int axis = 0; axis < 3; axis++) {
        turn(&b->motors[axis], 0.0);
        b->closed[axis] = b->motors[axis].position < b->switch_at[axis];
        b->since_ms[axis] = 1000;
    }
    cl_homing_input input = look(b);
    cl_homing_start(&b->homing, b->axes, which, &input);
    see(b);
}

/* Let up to `ms` pass, less if homing ends; how many did. */
int64_t bench_run(bench *b, int64_t ms) {
    for (int64_t passed = 1; passed <= ms; passed++) {
        b->now_ms++;
        for (int axis = 0; axis < 3; axis++) turn(&b->motors[axis], b->pwm[axis] / 2400.0);
        cl_homing_input input = look(b);
        cl_homing_tick(&b->homing, &input, b->pwm);
        see(b);
        if (b->status != CL_HOMING_BUSY) return passed;
    }
    return ms;
}

void bench_positions(const bench *b, int32_t at[3]) {
    cl_counts counts;
    cl_homing_positions(&b->homing, &counts);
    for (int axis = 0; axis < 3; axis++) at[axis] = counts.at[axis];
}

void bench_abort(bench *b) { cl_homing_abort(&b->homing); }

/* Test bench for the drive: three modelled gear motors, in virtual time. */
#include <stdlib.h>
#include <string.h>

#include "drive.h"
#include "motor.h"

typedef struct {
    int64_t now_ms;
    int64_t settled_ms;     /* -1 while unknown */
    int64_t fault_ms;       /* -1 for none */
    int64_t driver_low_ms;  /* how long the driver's pin will be low */
    int32_t fault, fault_axis;
    int32_t worst[3];       /* largest distance from the set-point since rig_reset_worst */
    int32_t off_ms[3];      /* ms with PWM 0 in a row */
    int32_t setpoint[3];
    int16_t pwm[3];
    motor motors[3];
    cl_drive drive;
    cl_plant plant;
    cl_servo_config own[3]; /* of axes that were given other gains */
    cl_move move;
    int64_t start_ms;
    bool moving;
} rig;

static void encoders(const rig *r, cl_counts *counts) {
    for (int axis = 0; axis < 3; axis++) counts->at[axis] = r->motors[axis].count;
}

rig *rig_new(void);
void rig_free(rig *r);
motor *rig_motor(rig *r, int axis);
void rig_gain(rig *r, int axis, const int16_t gains[6]);
void rig_place(rig *r, const int32_t at[3]);
void rig_plan(rig *r, const int32_t target[3], const cl_axis_limits axes[3], int32_t least_ms);
void rig_brake(rig *r);
int64_t rig_run(rig *r, int64_t ms);
void rig_skip(rig *r, int64_t ms);
void rig_fail(rig *r, uint8_t fault, uint8_t axis);
void rig_positions(rig *r, int32_t at[3]);
bool rig_still(const rig *r);
bool rig_coasts(const rig *r, int axis);

rig *rig_new(void) {
    static const cl_servo_config *const configs[3] = {&cl_servo_linear, &cl_servo_bias, &cl_servo_linear};
    rig *r = calloc(1, sizeof *r);
    if (r == NULL) abort();
    for (int axis = 0; axis < 3; axis++) r->motors[axis] = (motor)MOTOR_NEW;
    r->settled_ms = r->fault_ms = -1;
    cl_counts zero = {{0, 0, 0}};
    cl_drive_init(&r->drive, configs, &zero);
    r->plant = cl_drive_plant(&r->drive);
    return r;
}

void rig_free(rig *r) { free(r); }

motor *rig_motor(rig *r, int axis) { return &r->motors[axis]; }

/* Other gains for an axis: proportional, integral, damping, forward, lead_ms, kick. */
void rig_gain(rig *r, int axis, const int16_t gains[6]) {
    cl_servo_config *own = &r->own[axis];
    *own = *r->drive.servo[axis].config;
    own->proportional = gains[0];
    own->integral = gains[1];
    own->damping = gains[2];
    own->forward = gains[3];
    own->lead_ms = gains[4];
    own->kick = gains[5];
    r->drive.servo[axis].config = own;
}

void rig_place(rig *r, const int32_t at[3]) {
    cl_counts counts;
    for (int axis = 0; axis < 3; axis++) {
        r->motors[axis].position = at[axis] + 0.5;
        r->motors[axis].count = counts.at[axis] = at[axis];
    }
    cl_drive_place(&r->drive, &counts);
    r->fault = 0;
    r->moving = false;
    r->settled_ms = r->fault_ms = -1;
}

/* What the node does on news: it asks only while it moves. */
static void learn(rig *r) {
    cl_plant_fault found;
    int64_t at_ms;
    if (!r->moving) return;
    if (r->plant.fault(r->plant.self, &found)) {
        r->fault_ms = found.at_ms;
        r->fault = found.fault;
        r->fault_axis = found.axis;
    }
    if (r->plant.settles(r->plant.self, &at_ms)) {
        r->settled_ms = at_ms;
        r->moving = false;
    }
}

/* What the node does when it sets off. */
void rig_plan(rig *r, const int32_t target[3], const cl_axis_limits axes[3], int32_t least_ms) {
    cl_counts to = {{target[0], target[1], target[2]}};
    r->plant.positions(r->plant.self, r->now_ms, &r->move.start);
    cl_plan_move(&r->move, &to, axes, least_ms);
    r->start_ms = r->now_ms;
    r->settled_ms = r->fault_ms = -1;
    r->fault = r->fault_axis = 0;
    memset(r->worst, 0, sizeof r->worst);
    r->moving = true;
    r->plant.follow(r->plant.self, r->now_ms, r->start_ms, &r->move);
    learn(r);
}

void rig_brake(rig *r) {
    cl_move_brake(&r->move, r->now_ms - r->start_ms);
    r->settled_ms = -1;
    r->plant.follow(r->plant.self, r->now_ms, r->start_ms, &r->move);
}

/* Let up to `ms` pass, less if there is news; how many did. */
int64_t rig_run(rig *r, int64_t ms) {
    for (int64_t passed = 1; passed <= ms; passed++) {
        cl_counts counts, wanted;
        r->now_ms++;
        for (int axis = 0; axis < 3; axis++) turn(&r->motors[axis], r->pwm[axis] / 2400.0);
        encoders(r, &counts);
        bool low = r->driver_low_ms > 0 && r->driver_low_ms-- > 0;
        bool news = cl_drive_tick(&r->drive, r->now_ms, &counts, low, r->pwm);
        if (r->move.duration_ms > 0) cl_move_at(&r->move, r->now_ms - r->start_ms, &wanted);
        else wanted = counts;
        for (int axis = 0; axis < 3; axis++) {
            int32_t off = abs(counts.at[axis] - wanted.at[axis]);
            if (off > r->worst[axis]) r->worst[axis] = off;
            r->off_ms[axis] = r->pwm[axis] == 0 ? r->off_ms[axis] + 1 : 0;
            r->setpoint[axis] = wanted.at[axis];
        }
        if (news) {
            learn(r);
            return passed;
        }
    }
    return ms;
}

/* The motors turn on, but nobody looks after them. */
void rig_skip(rig *r, int64_t ms) {
    for (r->now_ms += ms; ms > 0; ms--) {
        for (int axis = 0; axis < 3; axis++) turn(&r->motors[axis], r->pwm[axis] / 2400.0);
    }
}

void rig_fail(rig *r, uint8_t fault, uint8_t axis) { cl_drive_fail(&r->drive, r->now_ms, fault, axis); }

void rig_positions(rig *r, int32_t at[3]) {
    cl_counts counts;
    r->plant.positions(r->plant.self, r->now_ms, &counts);
    memcpy(at, counts.at, sizeof counts.at);
}

bool rig_still(const rig *r) { return cl_drive_still(&r->drive); }

bool rig_coasts(const rig *r, int axis) { return cl_servo_coasts(&r->drive.servo[axis]); }

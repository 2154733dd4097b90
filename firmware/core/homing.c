#include "homing.h"

enum { LEAVE, SEEK, BACK, APPROACH, REST };

enum {
    GENTLE = CL_PWM_FULL * 35 / 100,
    AHEAD_COUNTS = 100,   /* the set-point waits for an axis that is held up: PWM is at its limit by then */
    STUCK_MS = 100,
    STUCK_COUNTS = 2,     /* per speed window */
    LIFE_COUNTS = 4,      /* fewer may be the noise of a dead channel */
    BOUNCE_MS = 5,
    REST_MS = 100,
    GRACE_MS = 1000,      /* added to what a phase should last */
    DRIVER_MS = 2,
    MILLI = 1000
};

const cl_homing_axis cl_homing_standard[CL_AXES] = {
    {.servo = &cl_servo_linear, .home = CL_HOME_HERE, .direction = -1},
    {.servo = &cl_servo_bias, .home = CL_HOME_STOP, .direction = -1, .reach = 14000, .seek = 1390, .approach = 348,
     .back_off = 348, .agree = 35},
    {.servo = &cl_servo_linear, .home = CL_HOME_SWITCH, .direction = -1, .reach = 111000, .seek = 1328,
     .approach = 1107, .back_off = 443, .agree = 110},
};

const cl_homing_axis cl_homing_rod_end = {
    .servo = &cl_servo_linear, .home = CL_HOME_SWITCH, .direction = -1, .reach = 443000, .seek = 1328,
    .approach = 1107, .back_off = 443, .agree = 110,
};

static int32_t size(int32_t value) { return value < 0 ? -value : value; }

static const cl_homing_axis *axis_of(const cl_homing *homing) { return &homing->axes[homing->axis]; }

static void enter(cl_homing *homing, uint8_t phase) {
    homing->phase = phase;
    homing->phase_ms = homing->stuck_ms = 0;
    homing->begin = homing->servo.position;
    homing->setpoint = (int64_t)homing->begin * MILLI;
    homing->servo.integral = 0; /* what held it against a stop must not keep it there */
}

/* Let the switch come to rest before it is believed; the place is where it began to close for good. */
static void debounce(cl_homing *homing, bool closed, int32_t position) {
    if (closed == homing->closed) {
        homing->bounce_ms = 0;
        return;
    }
    if (homing->bounce_ms == 0) homing->closing = position;
    if (++homing->bounce_ms >= BOUNCE_MS) {
        homing->closed = closed;
        homing->bounce_ms = 0;
    }
}

static bool switched(const cl_homing *homing, const cl_homing_input *input) {
    return (input->switches >> homing->axis & 1) != 0;
}

static void take_turn(cl_homing *homing, const cl_homing_input *input) {
    homing->gentle = *axis_of(homing)->servo;
    homing->gentle.limit = GENTLE;
    cl_servo_place(&homing->servo, &homing->gentle, input->encoders.at[homing->axis]);
    homing->closed = switched(homing, input);
    homing->bounce_ms = 0;
    enter(homing, axis_of(homing)->home == CL_HOME_SWITCH && homing->closed ? LEAVE : SEEK);
}

/* The zero is found: `counts` of the encoder are what the axis calls its place. */
static void take_place(cl_homing *homing, int32_t counts) {
    homing->shift.at[homing->axis] = axis_of(homing)->place - counts;
    homing->reasons.of[homing->axis] = 0;
}

static void next_axis(cl_homing *homing, const cl_homing_input *input) {
    while (homing->waiting != 0) {
        homing->axis = homing->waiting & 4 ? 2 : homing->waiting & 2 ? 1 : 0;
        homing->waiting &= (uint8_t)~(1u << homing->axis);
        if (axis_of(homing)->home != CL_HOME_HERE) {
            take_turn(homing, input);
            return;
        }
        take_place(homing, input->encoders.at[homing->axis]);
    }
    homing->status = CL_HOMING_DONE;
}

/* The axis stays without a zero; the others have their turn. */
static void give_up(cl_homing *homing, const cl_homing_input *input, uint8_t fault) {
    homing->reasons.of[homing->axis] = fault;
    next_axis(homing, input);
}

/* The end for all axes that have not found their zeros; the drivers are common to them. */
static void fail(cl_homing *homing, uint8_t fault) {
    homing->status = CL_HOMING_FAILED;
    homing->reasons.of[homing->axis] = fault;
    for (unsigned axis = 0; axis < CL_AXES; axis++) {
        if (fault == CL_FAULT_DRIVER && homing->waiting >> axis & 1) homing->reasons.of[axis] = fault;
    }
}

void cl_homing_start(cl_homing *homing, const cl_homing_axis axes[CL_AXES], uint8_t which,
                     const cl_homing_input *input) {
    *homing = (cl_homing){.axes = axes, .which = which, .waiting = which, .status = CL_HOMING_BUSY, .seen = input->encoders};
    for (unsigned axis = 0; axis < CL_AXES; axis++) homing->reasons.of[axis] = which >> axis & 1 ? CL_NOT_HOMED : 0;
    next_axis(homing, input);
}

void cl_homing_abort(cl_homing *homing) { homing->status = CL_HOMING_IDLE; }

void cl_homing_positions(const cl_homing *homing, cl_counts *counts) {
    for (unsigned axis = 0; axis < CL_AXES; axis++) counts->at[axis] = homing->seen.at[axis] + homing->shift.at[axis];
}

/* The speed of a phase [counts/s] and how far it may go [counts]. */
static int32_t pace(const cl_homing *homing, int32_t *most) {
    const cl_homing_axis *axis = axis_of(homing);
    *most = homing->phase == SEEK ? axis->reach : homing->phase == LEAVE ? 5 * axis->back_off : 2 * axis->back_off;
    int32_t speed = homing->phase == APPROACH ? axis->approach : axis->seek;
    return homing->phase == SEEK || homing->phase == APPROACH ? speed * axis->direction : -speed * axis->direction;
}

/* Move the set-point on, but not far ahead of an axis that does not come along. */
static void run(cl_homing *homing, int32_t speed) {
    int64_t most = ((int64_t)homing->servo.position + AHEAD_COUNTS) * MILLI;
    int64_t least = ((int64_t)homing->servo.position - AHEAD_COUNTS) * MILLI;
    homing->setpoint += speed;
    if (homing->setpoint > most) homing->setpoint = most;
    if (homing->setpoint < least) homing->setpoint = least;
}

static void drive(cl_homing *homing, int32_t speed, int32_t position) {
    cl_setpoint setpoint = {(int32_t)(homing->setpoint / MILLI), speed, speed, speed != 0};
    cl_servo_tick(&homing->servo, &setpoint, position, 1);
    bool stuck = size(homing->servo.pwm) >= GENTLE && size(homing->servo.moved) <= STUCK_COUNTS;
    homing->stuck_ms = stuck ? (uint16_t)(homing->stuck_ms + 1) : 0;
}

/* The axis does not go on: for a hard stop that is the goal. What is in the way of a switch will be so again, at the
   approach; but first the way back tells whether the encoder lives. */
static void held_up(cl_homing *homing, const cl_homing_input *input) {
    int32_t moved = size(homing->servo.position - homing->begin);
    if (homing->phase == BACK || homing->phase == LEAVE) {
        give_up(homing, input, moved < LIFE_COUNTS ? CL_FAULT_ENCODER : CL_FAULT_STALL);
    } else if (homing->phase == SEEK) {
        homing->first = homing->servo.position;
        enter(homing, BACK);
    } else if (axis_of(homing)->home == CL_HOME_STOP) {
        homing->closing = homing->servo.position;
        enter(homing, REST);
    } else {
        give_up(homing, input, CL_FAULT_STALL);
    }
}

static void found(cl_homing *homing) {
    if (homing->phase == SEEK) {
        homing->first = homing->closing;
        enter(homing, BACK);
    } else {
        enter(homing, REST);
    }
}

static void rest(cl_homing *homing, const cl_homing_input *input) {
    const cl_homing_axis *axis = axis_of(homing);
    homing->servo.pwm = 0;
    if (homing->phase_ms < REST_MS) return;
    if (size(homing->closing - homing->first) > axis->agree) {
        give_up(homing, input, CL_FAULT_ENCODER);
        return;
    }
    take_place(homing, homing->closing);
    next_axis(homing, input);
}

/* Whether the phase has reached what it is for; `gone` counts since it began. */
static void advance(cl_homing *homing, const cl_homing_input *input, int32_t gone) {
    const cl_homing_axis *axis = axis_of(homing);
    bool on_switch = axis->home == CL_HOME_SWITCH && homing->closed;
    if (homing->phase == LEAVE && !on_switch) {
        enter(homing, SEEK);
    } else if (homing->phase == BACK && gone >= axis->back_off && !on_switch) {
        enter(homing, APPROACH);
    } else if ((homing->phase == SEEK || homing->phase == APPROACH) && on_switch) {
        found(homing);
    } else if (homing->stuck_ms >= STUCK_MS) {
        held_up(homing, input);
    }
}

static void control(cl_homing *homing, const cl_homing_input *input) {
    int32_t most, speed = pace(homing, &most), position = input->encoders.at[homing->axis];
    uint32_t time_ms = 2 * MILLI * (uint32_t)most / (uint32_t)size(speed) + GRACE_MS; /* twice what it needs */
    run(homing, speed);
    debounce(homing, switched(homing, input), position);
    drive(homing, speed, position);
    int32_t gone = size(position - homing->begin);
    if (homing->servo.fault == CL_FAULT_RUNAWAY) {
        fail(homing, CL_FAULT_RUNAWAY);
    } else if (homing->servo.fault != CL_FAULT_NONE) {
        give_up(homing, input, homing->servo.fault);
    } else if (gone > most || homing->phase_ms > time_ms) {
        give_up(homing, input, CL_FAULT_STALL);
    } else {
        advance(homing, input, gone);
    }
}

static void watch_drivers(cl_homing *homing, bool driver_fault) {
    homing->driver_ms = driver_fault ? (uint16_t)(homing->driver_ms + 1) : 0;
    if (homing->driver_ms > DRIVER_MS) fail(homing, CL_FAULT_DRIVER);
}

cl_homing_status cl_homing_tick(cl_homing *homing, const cl_homing_input *input, int16_t pwm[CL_AXES]) {
    homing->seen = input->encoders;
    for (unsigned axis = 0; axis < CL_AXES; axis++) pwm[axis] = 0;
    if (homing->status == CL_HOMING_BUSY) watch_drivers(homing, input->driver_fault);
    if (homing->status == CL_HOMING_BUSY) {
        homing->phase_ms++;
        if (homing->phase == REST) {
            rest(homing, input);
        } else {
            control(homing, input);
        }
    }
    if (homing->status == CL_HOMING_BUSY && homing->phase != REST) pwm[homing->axis] = homing->servo.pwm;
    return (cl_homing_status)homing->status;
}

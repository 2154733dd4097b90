#include "motors.h"

#include "drive.h"
#include "encoder.h"
#include "pwm.h"

/* Missed edges that are forgiven within a second: one may come from a shock, more mean noise or a bad contact. */
#define MISSED_MOST 8u
#define MISSED_WINDOW_MS 1000

static cl_drive drive;
static cl_plant inner;
static volatile bool gate, news;

/* The main loop's calls and the tick must not interrupt each other. The tick gives way: a drive that misses one ms
 * makes up for it in the next, and no interrupt has to be masked. */
static void close_gate(void) {
    gate = true;
    __asm__ volatile("" ::: "memory");
}

static void open_gate(void) {
    __asm__ volatile("" ::: "memory");
    gate = false;
}

static void follow(void *self, int64_t now_ms, int64_t start_ms, const cl_move *move) {
    (void)self;
    close_gate();
    inner.follow(inner.self, now_ms, start_ms, move);
    open_gate();
}

static void positions(void *self, int64_t now_ms, cl_counts *counts) {
    (void)self;
    close_gate();
    inner.positions(inner.self, now_ms, counts);
    open_gate();
}

static bool settles(void *self, int64_t *at_ms) {
    (void)self;
    close_gate();
    bool known = inner.settles(inner.self, at_ms);
    open_gate();
    return known;
}

static bool fault(void *self, cl_plant_fault *found) {
    (void)self;
    close_gate();
    bool known = inner.fault(inner.self, found);
    open_gate();
    return known;
}

void motors_start(void) {
    static const cl_servo_config *const configs[CL_AXES] = {&cl_servo_linear, &cl_servo_bias, &cl_servo_linear};
    cl_counts at;
    encoder_read(&at);
    cl_drive_init(&drive, configs, &at);
    inner = cl_drive_plant(&drive);
}

static void watch_edges(int64_t now_ms) {
    static int64_t begin_ms;
    static uint32_t missed[CL_AXES];
    bool fresh = now_ms - begin_ms >= MISSED_WINDOW_MS;
    for (unsigned axis = 0; axis < CL_AXES; axis++) {
        uint32_t total = encoder_illegal(axis);
        if (total - missed[axis] > MISSED_MOST) {
            cl_drive_fail(&drive, now_ms, CL_FAULT_ENCODER, (uint8_t)(axis + 1));
            fresh = true;
        }
        if (fresh) {
            missed[axis] = total;
        }
    }
    if (fresh) {
        begin_ms = now_ms;
    }
}

/* Motors whose drivers sleep stand where they are, wherever somebody turns them to. */
void motors_tick(int64_t now_ms) {
    if (gate || inner.self == 0) {
        return;
    }
    int16_t pwm[CL_AXES] = {0};
    cl_counts at;
    encoder_read(&at);
    watch_edges(now_ms);
    if (!pwm_awake() && drive.fault.fault == CL_FAULT_NONE) {
        cl_drive_place(&drive, &at);
    } else if (cl_drive_tick(&drive, now_ms, &at, pwm_driver_fault(), pwm)) {
        news = true;
    }
    for (unsigned axis = 0; axis < CL_AXES; axis++) {
        if (cl_servo_coasts(&drive.servo[axis])) {
            pwm_release(axis);
        } else {
            pwm_set(axis, pwm[axis]);
        }
    }
}

cl_plant motors_plant(void) { return (cl_plant){0, follow, positions, settles, fault}; }

bool motors_news(void) {
    bool any = news;
    news = false;
    return any;
}

bool motors_still(void) {
    close_gate();
    bool still = cl_drive_still(&drive);
    open_gate();
    return still;
}

void motors_allow(void) { pwm_wake(); }
void motors_forbid(void) { pwm_sleep(); }
void motors_where(cl_counts *encoders) { encoder_read(encoders); }

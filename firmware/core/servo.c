#include "servo.h"

/* How the faults are told apart. A jammed axis and a dead encoder look alike at first: PWM rises, counts stand still.
   So after DEAD_MS without a count at more than half of full PWM the motor is reversed for a moment (PROBE_MS, half
   PWM). The encoder sits on the motor: whatever holds the axis, the play of the gears lets the motor run back a few
   counts, so counts mean a living encoder and a STALL; none mean that motor or encoder are dead: ENCODER, the stricter
   verdict, because the position cannot be trusted. That settles a stand-still within 160 ms. STALL also comes without
   the probe from an axis that still creeps: following error over its limit, PWM over 60 %, and less than 5 % of the
   speed asked for, all for STALL_MS. An axis that moves, but ever further behind its set-point, is out of step with the
   others; that is a STALL, too, after LAG_MS. */
enum {
    STALL_MS = 150,
    DEAD_MS = 100,
    PROBE_MS = 60,
    LAG_MS = 200,
    BRAKE_MS = 50,
    STRONG = CL_PWM_FULL * 6 / 10,
    HALF = CL_PWM_FULL / 2,
    PROBE_COUNTS = 4,    /* noise of one dead channel is one count to and fro */
    SLOW_COUNTS = 2,     /* per speed window: nothing slower can be told from standing still */
    CREEP_COUNTS = 4,    /* per speed window: slow enough to be stopped by shorting the motor */
    FIRM = CL_PWM_FULL / 4, /* more than the loads that a gear motor should be given */
    AGAINST_COUNTS = 50, /* motion against the PWM that no honest motor makes */
    STEADY_MS = 8,       /* firm PWM of one sign for so long must slow a motor that turns the other way */
    CALM_MS = 20,        /* at rest for so long: arrived */
    ERROR_MOST = 8191    /* counts: keeps products within 32 bits */
};

/* All three motors are the same, so their gains are. */
#define GAINS \
    .proportional = 12 * 256, .integral = 12, .damping = 3 * 256 / 2, .forward = 88, .lead_ms = 30, .kick = 192, \
    .limit = CL_PWM_FULL, .jump = 20

const cl_servo_config cl_servo_linear = {GAINS, .band = 22, .reengage = 66, .error_limit = 221, .lag_limit = 1107};

const cl_servo_config cl_servo_bias = {GAINS, .band = 10, .reengage = 31, .error_limit = 209, .lag_limit = 695};

static int32_t size(int32_t value) { return value < 0 ? -value : value; }

static int32_t sign(int32_t value) { return value > 0 ? 1 : value < 0 ? -1 : 0; }

static int32_t clamped(int32_t value, int32_t most) { return value > most ? most : value < -most ? -most : value; }

/* Far more than the travel of any axis may wrap round: it is a fault before anybody reckons with it. */
static int32_t apart(int32_t one, int32_t other) { return (int32_t)((uint32_t)one - (uint32_t)other); }

static void later(uint16_t *timer, uint16_t elapsed_ms) {
    *timer = *timer > UINT16_MAX - elapsed_ms ? UINT16_MAX : (uint16_t)(*timer + elapsed_ms);
}

/* Let a timer run while its condition holds; whether it has run for `limit_ms`. */
static bool lasts(uint16_t *timer, bool holds, uint16_t elapsed_ms, uint16_t limit_ms) {
    if (!holds) *timer = 0;
    if (holds) later(timer, elapsed_ms);
    return *timer >= limit_ms;
}

static int32_t ago(const cl_servo *servo, unsigned ms) {
    return servo->past[(servo->newest + CL_SPEED_WINDOW_MS - ms) % CL_SPEED_WINDOW_MS];
}

/* Let go of all that belongs to the present motion. */
static void calm_down(cl_servo *servo) {
    servo->integral = servo->against = 0;
    servo->stood_at = servo->position;
    servo->pwm = 0;
    servo->strong_ms = servo->dead_ms = servo->lag_ms = servo->steady_ms = servo->probe_ms = 0;
}

void cl_servo_place(cl_servo *servo, const cl_servo_config *config, int32_t position) {
    servo->config = config;
    servo->position = position;
    servo->moved = 0;
    for (unsigned ms = 0; ms < CL_SPEED_WINDOW_MS; ms++) servo->past[ms] = position;
    servo->newest = 0;
    servo->resting = true;
    servo->calm_ms = CALM_MS;
    cl_servo_clear(servo);
}

void cl_servo_clear(cl_servo *servo) {
    servo->fault = CL_FAULT_NONE;
    servo->fault_ms = 0;
    calm_down(servo);
}

void cl_servo_fail(cl_servo *servo, uint8_t fault) {
    if (servo->fault != CL_FAULT_NONE) return;
    servo->fault = fault;
    servo->fault_ms = 0;
    servo->resting = false;
    servo->calm_ms = 0;
    calm_down(servo);
}

bool cl_servo_coasts(const cl_servo *servo) { return servo->fault != CL_FAULT_NONE && servo->fault_ms >= BRAKE_MS; }

bool cl_servo_calm(const cl_servo *servo) {
    if (servo->fault == CL_FAULT_NONE) return servo->resting && servo->calm_ms >= CALM_MS;
    return cl_servo_coasts(servo) && servo->moved == 0;
}

/* Take in where the axis is; the window is one of readings, so a missed ms counts as one of constant speed. */
static void observe(cl_servo *servo, int32_t position, uint16_t elapsed_ms) {
    int32_t step = apart(position, servo->position), most = servo->config->jump * (int32_t)elapsed_ms;
    if (step > most || step < -most) {
        cl_servo_fail(servo, CL_FAULT_ENCODER);
        step = 0;
    }
    for (unsigned ms = elapsed_ms < CL_SPEED_WINDOW_MS ? elapsed_ms : CL_SPEED_WINDOW_MS; ms-- > 0;) {
        unsigned slot = (servo->newest + 1u) % CL_SPEED_WINDOW_MS;
        servo->moved = apart(position, servo->past[slot]);
        servo->past[slot] = ms == 0 ? position : position - step * (int32_t)ms / elapsed_ms;
        servo->newest = (uint8_t)slot;
    }
    servo->position = position;
}

/* Whether the motor is off: the set-point has arrived, and so has the axis. Standing still takes a few counts, so the
   way into the band needs room for them. */
static bool rests(cl_servo *servo, const cl_setpoint *setpoint, int32_t error) {
    const cl_servo_config *config = servo->config;
    if (setpoint->moving || size(error) > config->reengage) {
        servo->resting = false;
    } else if (!servo->resting && size(servo->moved) <= CREEP_COUNTS &&
               size(error) + size(servo->moved) <= config->band) {
        servo->resting = true;
        servo->calm_ms = 0;
        calm_down(servo);
    }
    return servo->resting;
}

/* PI, feed-forward and damping; the integral grows only while that can still change the PWM. */
static int32_t control(cl_servo *servo, const cl_setpoint *setpoint, int32_t error, uint16_t elapsed_ms) {
    enum { FRACTION = 256, SPEED_MOST = 200000, PER_WINDOW = 65536 * CL_SPEED_WINDOW_MS / 1000 };
    const cl_servo_config *config = servo->config;
    int32_t wanted = clamped(setpoint->speed, SPEED_MOST) * PER_WINDOW / 65536;
    int32_t push = config->proportional * error + config->damping * (wanted - servo->moved) +
                   config->forward * clamped(setpoint->lead, SPEED_MOST) + servo->integral;
    int32_t heading = setpoint->moving ? setpoint->speed : size(error) > config->band ? error : 0;
    int32_t asked = push / FRACTION + sign(heading) * config->kick;
    int32_t pwm = clamped(asked, config->limit);
    if (pwm == asked || sign(error) != sign(asked)) {
        int32_t grown = servo->integral + config->integral * error * (elapsed_ms < 16 ? elapsed_ms : 16);
        servo->integral = clamped(grown, config->limit * FRACTION);
    }
    return pwm;
}

/* Motion against the PWM that does not slow down: encoder or motor is wired the wrong way round. */
static bool runs_away(cl_servo *servo, int32_t pwm, uint16_t elapsed_ms) {
    bool steady = size(pwm) > FIRM && (pwm > 0) == (servo->pwm > 0);
    bool pushed = lasts(&servo->steady_ms, steady, elapsed_ms, STEADY_MS);
    int32_t recent = apart(servo->position, ago(servo, 7));
    if (recent == 0 || (recent > 0) == (pwm > 0)) {
        servo->against = 0;
    } else if (pushed && size(recent) >= size(apart(ago(servo, 8), ago(servo, 15)))) {
        servo->against += size(apart(servo->position, ago(servo, 1)));
    }
    return servo->against > AGAINST_COUNTS;
}

/* Strong PWM and not a count: begin the probe. */
static void look_for_life(cl_servo *servo, uint16_t elapsed_ms) {
    int32_t gone = apart(servo->position, servo->stood_at);
    bool still = gone >= -1 && gone <= 1;
    if (!still) servo->stood_at = servo->position;
    if (lasts(&servo->dead_ms, still && size(servo->pwm) > HALF, elapsed_ms, DEAD_MS)) {
        servo->stood_at = servo->position;
        servo->probe_ms = 1;
        servo->pwm = (int16_t)(servo->pwm > 0 ? -HALF : HALF);
    }
}

static void probe(cl_servo *servo, uint16_t elapsed_ms) {
    later(&servo->probe_ms, elapsed_ms);
    if (size(apart(servo->position, servo->stood_at)) >= PROBE_COUNTS) {
        cl_servo_fail(servo, CL_FAULT_STALL);
    } else if (servo->probe_ms > PROBE_MS) {
        cl_servo_fail(servo, CL_FAULT_ENCODER);
    }
}

static void judge(cl_servo *servo, const cl_setpoint *setpoint, int32_t error, uint16_t elapsed_ms) {
    enum { TWENTIETH = 20 * 1000 / CL_SPEED_WINDOW_MS };
    int32_t moved = size(servo->moved);
    bool slow = moved <= SLOW_COUNTS || moved * TWENTIETH <= size(setpoint->speed);
    bool jammed = slow && size(servo->pwm) > STRONG && size(error) > servo->config->error_limit;
    bool behind = size(error) > servo->config->lag_limit;
    bool stalled = lasts(&servo->strong_ms, jammed, elapsed_ms, STALL_MS);
    if (lasts(&servo->lag_ms, behind, elapsed_ms, LAG_MS) || stalled) {
        cl_servo_fail(servo, CL_FAULT_STALL);
    } else {
        look_for_life(servo, elapsed_ms);
    }
}

void cl_servo_tick(cl_servo *servo, const cl_setpoint *setpoint, int32_t position, uint16_t elapsed_ms) {
    observe(servo, position, elapsed_ms);
    if (servo->fault != CL_FAULT_NONE) {
        later(&servo->fault_ms, elapsed_ms);
        return;
    }
    if (servo->probe_ms > 0) {
        probe(servo, elapsed_ms);
        return;
    }
    int32_t error = clamped(apart(setpoint->at, position), ERROR_MOST);
    if (rests(servo, setpoint, error)) {
        later(&servo->calm_ms, elapsed_ms);
        return;
    }
    int32_t pwm = control(servo, setpoint, error, elapsed_ms);
    bool away = runs_away(servo, pwm, elapsed_ms);
    servo->pwm = (int16_t)pwm;
    if (away) {
        cl_servo_fail(servo, CL_FAULT_RUNAWAY);
    } else {
        judge(servo, setpoint, error, elapsed_ms);
    }
}

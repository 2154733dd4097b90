#include "motors.h"

#include "board.h"
#include "drive.h"
#include "encoder.h"
#include "persist.h"
#include "program.h"
#include "pwm.h"
#include "supply.h"
#include "tick.h"
#include "workbench.h"

/* Missed edges that are forgiven within a second: one may come from a shock, more mean noise or a bad contact. */
#define MISSED_MOST 8u
#define MISSED_WINDOW_MS 1000

/* How long the supply may be low while nothing moves [ms]: encoders that stand come back to where they were. While it
 * comes up, it may take its time. */
#define LOW_AT_REST_MS 20u
#define LOW_AT_FIRST_MS 2000u

static cl_drive drive;
static cl_plant inner;
static cl_homing homing;
static cl_workbench bench;
static int64_t turned_ms; /* when the last turn ended, valid if `turned_known` */
static uint16_t lag[CL_AXES]; /* largest following error of the last move */
static volatile bool gate, news, seeking, turning, turned_known, underfed;
static volatile uint8_t noisy; /* axes that have missed edges since the last search began, bit 0 for the first */

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

/* A move whose beginning cannot be written down must not begin: a later boot would believe the old position. */
static void follow(void *self, int64_t now_ms, int64_t start_ms, const cl_move *move) {
    (void)self;
    bool written = persist_moving();
    pwm_wake(); /* before the next tick, which takes motors of sleeping drivers for ones that have no move to make */
    close_gate();
    if (supply_low_ms() != 0) {
        cl_drive_fail(&drive, now_ms, CL_FAULT_BROWN_OUT, 0);
    } else if (!written) {
        cl_drive_fail(&drive, now_ms, CL_FAULT_DRIVER, 0);
    }
    inner.follow(inner.self, now_ms, start_ms, move);
    if (move->brake_ms == CL_UNBRAKED) {
        lag[0] = lag[1] = lag[2] = 0;
    }
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

bool motors_rod_switch(void) { return (GPIO_PDIR(ROD_SWITCH_PORT) >> ROD_SWITCH_PIN & 1u) == 0; }

static void look(cl_homing_input *input) {
    bool translate = (GPIO_PDIR(TRANSLATE_SWITCH_PORT) >> TRANSLATE_SWITCH_PIN & 1u) == 0;
    encoder_read(&input->encoders);
    input->switches = (uint8_t)((motors_rod_switch() ? 0 : 1) | (translate ? 4 : 0));
    input->driver_fault = pwm_driver_fault();
}

void motors_start(void) {
    PORT_PCR(TRANSLATE_SWITCH_PORT, TRANSLATE_SWITCH_PIN) = PCR_GPIO | PCR_PULL_UP;
    PORT_PCR(ROD_SWITCH_PORT, ROD_SWITCH_PIN) = PCR_GPIO | PCR_PULL_UP;
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
            noisy |= (uint8_t)(1u << axis);
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

/* With a low supply encoders may miss edges without a sign of it: at once in motion, in the long run at rest. */
static void watch_supply(int64_t now_ms) {
    static bool told;
    bool rests = !seeking && !turning && cl_drive_still(&drive);
    uint16_t forgiven = rests ? (supply_is_up() ? LOW_AT_REST_MS : LOW_AT_FIRST_MS) : 1u;
    bool fails = supply_low_ms() >= forgiven;
    if (fails && !told) {
        cl_drive_fail(&drive, now_ms, CL_FAULT_BROWN_OUT, 0);
        underfed = true;
    }
    told = fails;
}

/* No axis can be sure of a zero that it finds now. */
static void end_for_supply(void) {
    homing.status = CL_HOMING_FAILED;
    for (unsigned axis = 0; axis < CL_AXES; axis++) {
        homing.shift.at[axis] = 0;
        homing.reasons.of[axis] = homing.which >> axis & 1u ? CL_FAULT_BROWN_OUT : 0;
    }
}

static void seek(int16_t pwm[CL_AXES]) {
    cl_homing_input input;
    look(&input);
    if (supply_low_ms() != 0) {
        end_for_supply();
    } else {
        cl_homing_tick(&homing, &input, pwm);
    }
    if (homing.status != CL_HOMING_BUSY) {
        seeking = false;
    }
}

static void note_lag(void) {
    for (unsigned axis = 0; axis < CL_AXES; axis++) {
        cl_setpoint setpoint;
        cl_track_setpoint(&drive.track, axis, 0, &setpoint);
        int32_t error = setpoint.at - drive.position.at[axis];
        uint32_t size = error < 0 ? 0u - (uint32_t)error : (uint32_t)error;
        if (size > lag[axis]) {
            lag[axis] = size > UINT16_MAX ? UINT16_MAX : (uint16_t)size;
        }
    }
}

/* Motors whose drivers sleep stand where they are, wherever somebody turns them to. */
static void track(int64_t now_ms, int16_t pwm[CL_AXES]) {
    cl_counts at;
    encoder_read(&at);
    if (!pwm_awake() && drive.fault.fault == CL_FAULT_NONE) {
        cl_drive_place(&drive, &at);
    } else {
        if (cl_drive_tick(&drive, now_ms, &at, pwm_driver_fault(), pwm)) {
            news = true;
        }
        if (!drive.settled) {
            note_lag();
        }
    }
}

/* The drive takes over where the axes are. Edges that were missed meanwhile still count against those that kept their
 * position. */
static void hand_over(uint8_t kept) {
    cl_counts at;
    encoder_read(&at);
    cl_drive_place(&drive, &at);
    for (uint8_t axis = 0; axis < CL_AXES; axis++) {
        if ((noisy & kept) >> axis & 1u) {
            cl_drive_fail(&drive, tick_ms(), CL_FAULT_ENCODER, (uint8_t)(axis + 1));
        }
    }
}

static void work(int64_t now_ms, int16_t pwm[CL_AXES]) {
    cl_counts at;
    encoder_read(&at);
    bool ends = pwm_driver_fault() || supply_low_ms() != 0;
    pwm[bench.turn.axis - 1u] = (int16_t)(cl_workbench_tick(&bench, &at, ends) * CL_PWM_FULL / 1000);
    if (!bench.busy) {
        turning = false;
        turned_ms = now_ms;
        turned_known = news = true;
        hand_over(CL_ALL_AXES);
    }
}

void motors_tick(int64_t now_ms) {
    if (gate || inner.self == 0) {
        return;
    }
    int16_t pwm[CL_AXES] = {0};
    watch_edges(now_ms);
    watch_supply(now_ms);
    if (seeking) {
        seek(pwm);
    } else if (turning) {
        work(now_ms, pwm);
    } else {
        track(now_ms, pwm);
    }
    for (unsigned axis = 0; axis < CL_AXES; axis++) {
        if (cl_servo_coasts(&drive.servo[axis])) {
            pwm_release(axis);
        } else {
            pwm_set(axis, pwm[axis]);
        }
    }
}

/* As with a move, a turn whose beginning cannot be written down comes to nothing. */
static void turn(void *self, int64_t now_ms, const cl_turn *wanted) {
    (void)self;
    bool written = persist_moving();
    cl_counts at;
    pwm_wake();
    close_gate();
    encoder_read(&at);
    cl_drive_place(&drive, &at);
    cl_workbench_start(&bench, wanted, &at);
    turned_ms = now_ms;
    turned_known = !written;
    turning = written;
    open_gate();
}

static bool turned(void *self, int64_t *at_ms) {
    (void)self;
    *at_ms = turned_ms;
    return turned_known;
}

/* What was written of the old position is marked first. */
static void place(void *self, int64_t now_ms, uint8_t axis, int32_t counts) {
    (void)self;
    bool written = persist_moving();
    cl_counts at, shift = {{0}};
    close_gate();
    encoder_read(&at);
    shift.at[axis - 1u] = counts - at.at[axis - 1u];
    encoder_shift(&shift);
    noisy &= (uint8_t)~(1u << (axis - 1u));
    hand_over(CL_ALL_AXES);
    if (!written) {
        cl_drive_fail(&drive, now_ms, CL_FAULT_DRIVER, 0);
    }
    open_gate();
}

static void see(void *self, int64_t now_ms, uint8_t axis, uint8_t first, cl_look *seen) {
    cl_homing_input input;
    uint32_t missed = encoder_illegal(axis - 1u);
    (void)self;
    (void)now_ms;
    close_gate();
    look(&input);
    bool benched = turning && bench.turn.axis == axis;
    *seen = (cl_look){
        .counts = input.encoders,
        .lines = (uint8_t)(input.switches | (input.driver_fault ? CL_LINE_DRIVER : 0) | (pwm_awake() ? CL_LINE_AWAKE : 0)),
        .samples = bench.samples,
        .supply_mv = supply_mv(),
        .missed = missed > UINT16_MAX ? UINT16_MAX : (uint16_t)missed,
        .lag = lag[axis - 1u],
        .threshold = bench.threshold,
        .duty = benched ? bench.duty : (int16_t)(drive.servo[axis - 1u].pwm * 1000 / CL_PWM_FULL),
    };
    cl_workbench_samples(&bench, first, seen->trace);
    open_gate();
}

cl_plant motors_plant(void) {
    return (cl_plant){
        .follow = follow, .positions = positions, .settles = settles, .fault = fault,
        .turn = turn, .turned = turned, .place = place, .look = see,
    };
}

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
bool motors_sure(void) { return drive.fault.fault != CL_FAULT_ENCODER && drive.fault.fault != CL_FAULT_BROWN_OUT; }

bool motors_underfed(void) {
    bool any = underfed;
    underfed = false;
    return any;
}

void motors_seek(const cl_homing_axis axes[CL_AXES], uint8_t which) {
    cl_homing_input input;
    close_gate();
    look(&input);
    cl_drive_place(&drive, &input.encoders); /* ends what fault there was */
    noisy = 0;
    cl_homing_start(&homing, axes, which, &input);
    seeking = homing.status == CL_HOMING_BUSY;
    open_gate();
}

cl_homing_status motors_sought(cl_reasons *reasons) {
    if (seeking || homing.status == CL_HOMING_IDLE) {
        return seeking ? CL_HOMING_BUSY : CL_HOMING_IDLE;
    }
    cl_homing_status status = (cl_homing_status)homing.status;
    close_gate();
    encoder_shift(&homing.shift);
    *reasons = homing.reasons;
    for (unsigned axis = 0; axis < CL_AXES; axis++) {
        bool spoiled = reasons->of[axis] == 0 && (noisy & homing.which) >> axis & 1u;
        if (spoiled) {
            reasons->of[axis] = CL_FAULT_ENCODER;
        }
    }
    hand_over((uint8_t)~homing.which);
    homing.status = CL_HOMING_IDLE;
    open_gate();
    return status;
}

void motors_abandon(void) {
    close_gate();
    seeking = turning = turned_known = false;
    cl_workbench_stop(&bench);
    cl_homing_abort(&homing);
    hand_over((uint8_t)~homing.which);
    open_gate();
}

#include "drive.h"

enum {
    DRIVER_MS = 2,   /* over-current protection tries again after about 1 ms by itself */
    LATE_MS = 3000,  /* an axis that has not found its place by then after the set-point never will */
    ELAPSED_MOST = 1000 /* ms: keeps counters in range, nothing more */
};

void cl_drive_place(cl_drive *drive, const cl_counts *encoders) {
    for (unsigned axis = 0; axis < CL_AXES; axis++) {
        cl_servo_place(&drive->servo[axis], drive->servo[axis].config, encoders->at[axis]);
    }
    cl_track_rest(&drive->track, encoders);
    drive->position = *encoders;
    drive->fault = (cl_plant_fault){0, CL_FAULT_NONE, 0};
    drive->driver_ms = drive->late_ms = 0;
    drive->settled = drive->ticking = drive->told = drive->news = false;
}

void cl_drive_init(cl_drive *drive, const cl_servo_config *const configs[CL_AXES], const cl_counts *encoders) {
    for (unsigned axis = 0; axis < CL_AXES; axis++) drive->servo[axis].config = configs[axis];
    drive->start_ms = drive->last_ms = drive->settled_ms = 0;
    cl_drive_place(drive, encoders);
}

void cl_drive_fail(cl_drive *drive, int64_t now_ms, uint8_t fault, uint8_t axis) {
    for (uint8_t number = 1; number <= CL_AXES; number++) {
        if (axis == 0 || axis == number) cl_servo_fail(&drive->servo[number - 1], fault);
    }
    if (drive->fault.fault != CL_FAULT_NONE) return;
    drive->fault = (cl_plant_fault){now_ms, fault, axis};
    drive->told = false;
    drive->news = true;
}

static uint16_t elapsed(cl_drive *drive, int64_t now_ms) {
    int64_t since = drive->ticking ? now_ms - drive->last_ms : 1;
    drive->ticking = true;
    drive->last_ms = now_ms;
    return (uint16_t)(since > ELAPSED_MOST ? ELAPSED_MOST : since);
}

/* The drivers pull their pin when a motor takes too much current or they get too hot. */
static void watch_drivers(cl_drive *drive, bool driver_fault, uint16_t elapsed_ms) {
    drive->driver_ms = driver_fault ? (uint16_t)(drive->driver_ms + elapsed_ms) : 0;
    if (drive->driver_ms > DRIVER_MS) {
        cl_drive_fail(drive, drive->last_ms, CL_FAULT_DRIVER, 0);
        drive->driver_ms = DRIVER_MS;
    }
}

static void run_servos(cl_drive *drive, uint16_t elapsed_ms) {
    for (uint8_t axis = 0; axis < CL_AXES; axis++) {
        cl_servo *servo = &drive->servo[axis];
        cl_setpoint setpoint;
        cl_track_setpoint(&drive->track, axis, servo->config->lead_ms, &setpoint);
        cl_servo_tick(servo, &setpoint, drive->position.at[axis], elapsed_ms);
        if (servo->fault != CL_FAULT_NONE) cl_drive_fail(drive, drive->last_ms, servo->fault, (uint8_t)(axis + 1));
    }
}

/* See whether all axes are at rest; one that cannot find its place is as good as jammed. */
static void settle(cl_drive *drive, uint16_t elapsed_ms) {
    if (drive->settled || drive->track.at_ms < drive->track.end_ms) return;
    uint8_t restless = 0;
    for (uint8_t axis = 1; axis <= CL_AXES; axis++) {
        if (!cl_servo_calm(&drive->servo[axis - 1])) restless = axis;
    }
    if (restless == 0) {
        drive->settled = drive->news = true;
        drive->settled_ms = drive->last_ms;
    } else if ((drive->late_ms = (uint16_t)(drive->late_ms + elapsed_ms)) >= LATE_MS) {
        cl_drive_fail(drive, drive->last_ms, CL_FAULT_STALL, restless);
        drive->late_ms = 0;
    }
}

bool cl_drive_tick(cl_drive *drive, int64_t now_ms, const cl_counts *encoders, bool driver_fault,
                   int16_t pwm[CL_AXES]) {
    bool due = !drive->ticking || now_ms > drive->last_ms;
    if (due) {
        uint16_t elapsed_ms = elapsed(drive, now_ms);
        drive->position = *encoders;
        watch_drivers(drive, driver_fault, elapsed_ms);
        cl_track_to(&drive->track, now_ms - drive->start_ms);
        run_servos(drive, elapsed_ms);
        settle(drive, elapsed_ms);
    }
    for (unsigned axis = 0; axis < CL_AXES; axis++) pwm[axis] = drive->servo[axis].pwm;
    bool news = drive->news;
    drive->news = false;
    return news;
}

bool cl_drive_still(const cl_drive *drive) {
    if (drive->track.at_ms < drive->track.end_ms) return false;
    for (unsigned axis = 0; axis < CL_AXES; axis++) {
        if (!cl_servo_calm(&drive->servo[axis])) return false;
    }
    return true;
}

static bool same(const cl_counts *one, const cl_counts *other) {
    return one->at[0] == other->at[0] && one->at[1] == other->at[1] && one->at[2] == other->at[2];
}

/* The node sets off again: what it knew of is over, what it did not know of belongs to this move. */
static void set_off(cl_drive *drive, int64_t now_ms) {
    if (drive->fault.fault != CL_FAULT_NONE && !drive->told) {
        drive->fault.at_ms = now_ms;
        return;
    }
    drive->fault = (cl_plant_fault){0, CL_FAULT_NONE, 0};
    for (unsigned axis = 0; axis < CL_AXES; axis++) cl_servo_clear(&drive->servo[axis]);
}

static void follow(void *self, int64_t now_ms, int64_t start_ms, const cl_move *move) {
    cl_drive *drive = self;
    const cl_move *old = &drive->track.move;
    bool braked = move->brake_ms != CL_UNBRAKED;
    if (braked && start_ms == drive->start_ms && same(&move->start, &old->start) && same(&move->target, &old->target)) {
        cl_track_brake(&drive->track, move);
    } else {
        if (!braked) set_off(drive, now_ms);
        cl_track_begin(&drive->track, move);
        cl_track_to(&drive->track, now_ms - start_ms);
        drive->start_ms = start_ms;
    }
    drive->settled = false;
    drive->late_ms = 0;
}

static void positions(void *self, int64_t now_ms, cl_counts *counts) {
    const cl_drive *drive = self;
    (void)now_ms;
    *counts = drive->position;
    for (unsigned axis = 0; axis < CL_AXES; axis++) {
        cl_setpoint setpoint;
        cl_track_setpoint(&drive->track, axis, 0, &setpoint);
        if (drive->servo[axis].resting) counts->at[axis] = setpoint.at;
    }
}

static bool settles(void *self, int64_t *at_ms) {
    const cl_drive *drive = self;
    *at_ms = drive->settled_ms;
    return drive->settled;
}

static bool fault(void *self, cl_plant_fault *fault) {
    cl_drive *drive = self;
    *fault = drive->fault;
    bool failed = drive->fault.fault != CL_FAULT_NONE;
    drive->told = drive->told || failed;
    return failed;
}

cl_plant cl_drive_plant(cl_drive *drive) {
    return (cl_plant){
        .self = drive, .follow = follow, .positions = positions, .settles = settles, .fault = fault,
    };
}

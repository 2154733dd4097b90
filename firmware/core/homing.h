/* Finding the zero of the axes, one after the other, at 1 kHz.

   Duty: an axis runs gently onto its switch or a hard stop, backs off, comes again slowly, and takes that place for
   the count that its configuration gives it. Each phase ends in time or in a fault. An axis without either is zeroed
   where the operator has put it. An axis that finds none is given up with the fault for a reason; the others go on.
   Units: encoder counts, counts/s, ms, PWM steps.
   Source: 35 % of full PWM, 2 mm back, 5 mm/s again; repeats to about 0.05 mm.

   The order is translate, bias, extrude: out of the way first. Motors of the other axes are shorted meanwhile.

   Faults: impossible jumps as in servo.h; STALL for an axis that met an obstacle, or no switch within its reach; ENCODER
   if there are no counts either way, or if the second approach ends elsewhere than the first: then the counts cannot be
   trusted. A dead encoder or an absent motor looks like a hard stop; it is found out by backing off. RUNAWAY, as in
   servo.h, and DRIVER end the search for all axes: neither tells how much harm the next motor would do. */
#ifndef CL_HOMING_H
#define CL_HOMING_H

#include "servo.h"

typedef enum { CL_HOME_HERE, CL_HOME_SWITCH, CL_HOME_STOP } cl_home;

typedef struct {
    const cl_servo_config *servo;
    int32_t place;    /* count of the switch or stop */
    int32_t reach;    /* counts: it is no further away than this */
    int16_t seek;     /* counts/s */
    int16_t approach; /* counts/s */
    int16_t back_off; /* counts */
    int16_t agree;    /* counts by which two approaches may differ */
    int8_t direction; /* 1 or -1: which way it is */
    uint8_t home;     /* a cl_home */
} cl_homing_axis;

/* Translate down onto its switch, bias onto its lower stop, extrude where it is; `place` is the program's to set. */
extern const cl_homing_axis cl_homing_standard[CL_AXES];
/* For an extrude axis whose rod ends in a switch. */
extern const cl_homing_axis cl_homing_rod_end;

/* DONE: every axis has had its turn; FAILED: it ended before. */
typedef enum { CL_HOMING_IDLE, CL_HOMING_BUSY, CL_HOMING_DONE, CL_HOMING_FAILED } cl_homing_status;

typedef struct {
    cl_counts encoders;
    uint8_t switches;  /* bit 0 for the first axis: 1 is closed */
    bool driver_fault; /* the drivers pull their pin */
} cl_homing_input;

typedef struct {
    const cl_homing_axis *axes;
    cl_servo servo;
    cl_servo_config gentle;
    cl_counts shift; /* what to add to the encoder of each axis, 0 for one that has not found its zero */
    cl_counts seen;  /* encoders at the last tick */
    int64_t setpoint; /* thousandths of a count */
    int32_t begin;    /* where the phase began */
    int32_t closing;  /* where the switch began to close */
    int32_t first;    /* where the first approach ended */
    uint32_t phase_ms;
    uint16_t stuck_ms, driver_ms;
    uint8_t which;   /* axes to be homed, bit 0 for the first */
    uint8_t waiting; /* those that have not had their turn */
    uint8_t axis, phase, status;
    cl_reasons reasons; /* of the axes to be homed: 0 once the zero is found */
    uint8_t bounce_ms;
    bool closed; /* the switch, debounced */
} cl_homing;

/* Begin with the axes of `which` (bit 0 for the first); `axes` has to stay. */
void cl_homing_start(cl_homing *homing, const cl_homing_axis axes[CL_AXES], uint8_t which,
                     const cl_homing_input *input);

/* One control step of 1 ms. */
cl_homing_status cl_homing_tick(cl_homing *homing, const cl_homing_input *input, int16_t pwm[CL_AXES]);

/* Where the axes are, in counts from their new zeros if they have found them. */
void cl_homing_positions(const cl_homing *homing, cl_counts *counts);

/* Motors off: somebody stopped it. */
void cl_homing_abort(cl_homing *homing);

#endif

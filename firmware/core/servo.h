/* One axis: a motor held to a set-point at 1 kHz, and the faults that only the axis itself can notice.

   Duty: PI control with velocity feed-forward, anti-windup and a kick against stiction; at rest the motor is off
   within a band, and on again when the axis has been pushed well out of it. After a fault the motor is shorted for a
   moment, then off, until the fault is cleared.
   Units: encoder counts, ms; PWM in steps of -2400 .. 2400 (20 kHz from a 48 MHz clock), slow decay, so that 0 shorts
   the motor; gains have 8 binary places; speeds in counts/s.
   Sources: 1:298 gear motor with 28 counts per motor turn, 6953 counts/s at full duty, time constant 30 ms (modelled):
   a closed loop of Kp 12 has 34 rad/s. The integral must stay below 0.4 steps per count and ms, or that loop swings. */
#ifndef CL_SERVO_H
#define CL_SERVO_H

#include "frames.h" /* the codes of faults */
#include "track.h"

enum {
    CL_PWM_FULL = 2400,
    CL_SPEED_WINDOW_MS = 16 /* one count per ms would be 4.5 mm/s: too coarse to tell a speed by */
};

typedef struct {
    int16_t proportional; /* PWM steps per count, 8 binary places */
    int16_t integral;     /* PWM steps per count and ms, 8 binary places */
    int16_t damping;      /* PWM steps per count of speed error in the speed window, 8 binary places */
    int16_t forward;      /* PWM steps per count/s of the set-point, 8 binary places */
    int16_t lead_ms;      /* time constant of the motor */
    int16_t kick;         /* PWM steps against stiction */
    int16_t limit;        /* largest PWM */
    int16_t band;         /* counts from the set-point within which a resting motor is off */
    int16_t reengage;     /* counts from the set-point that wake it */
    int16_t error_limit;  /* counts of following error that a stall has at least */
    int16_t lag_limit;    /* counts of following error that are a fault however fast the axis is */
    int16_t jump;         /* counts per ms that no motor can do */
} cl_servo_config;

/* Rack axes of 221 counts/mm: off within 0.1 mm, on again at 0.3 mm, stalled at 1 mm, out of step at 5 mm. */
extern const cl_servo_config cl_servo_linear;
/* The bias axis with its extra 3:1 gear, 69.5 counts/deg: 0.15, 0.45, 3 and 10 deg. */
extern const cl_servo_config cl_servo_bias;

typedef struct {
    const cl_servo_config *config;
    int32_t past[CL_SPEED_WINDOW_MS]; /* positions of the last ms, a ring */
    int32_t position;
    int32_t integral;  /* PWM steps, 8 binary places */
    int32_t moved;     /* counts within the speed window */
    int32_t stood_at;  /* where the axis has been standing for `dead_ms`, give or take a count */
    int32_t against;   /* counts moved against the PWM without slowing down */
    int16_t pwm;
    uint16_t strong_ms, dead_ms, lag_ms, steady_ms, probe_ms, fault_ms, calm_ms;
    uint8_t newest;    /* index into `past` */
    uint8_t fault;     /* CL_FAULT_..., latched */
    bool resting;      /* motor off in the band */
} cl_servo;

/* Stand at `position` with the motor off; clears everything but the configuration. */
void cl_servo_place(cl_servo *servo, const cl_servo_config *config, int32_t position);

/* One control step, `elapsed_ms` (1 unless a step was missed) after the last; the PWM is left in `servo->pwm`. */
void cl_servo_tick(cl_servo *servo, const cl_setpoint *setpoint, int32_t position, uint16_t elapsed_ms);

/* Latch a fault that was noticed elsewhere; an earlier one stays. */
void cl_servo_fail(cl_servo *servo, uint8_t fault);

/* Forget the fault. */
void cl_servo_clear(cl_servo *servo);

/* Whether a failed axis has been shorted for long enough to let it turn freely. */
bool cl_servo_coasts(const cl_servo *servo);

/* Whether the axis has come to rest: in the band with the motor off, or stopped after a fault. */
bool cl_servo_calm(const cl_servo *servo);

#endif

/* Three servos on one move: what the node's state machine knows as its plant.

   Duty: tracks the set-points of a move at 1 kHz, tells when all axes have arrived or which has failed, and keeps
   failed axes off until the node, which latches the fault, sets off again.
   Units: counts, ms since power-on, PWM steps.
   Source: `cl_plant` (plant.h) and the rules of machine.py.

   Where the axes are. `positions` gives encoder counts, except for an axis at rest within the band of its set-point: of
   that it gives the set-point. An axis is as good as where it was told to go once the motor has gone off, and the state
   machine may compare for equality, go on for the rest of a braked move, and plan the next move without carrying
   deadbands along. Encoder counts are reported again as soon as the axis has been pushed out of the band, and after a
   fault.

   What ends a fault. A failed axis is off. The node hears of it through `fault`, brakes, and forgets it when its host
   says so; a move that has not been broken off is therefore the sign that the fault is forgotten, if the node had heard
   of it. If it had not, because nothing moved at that time, it hears of it now, and the move comes to nothing.

   The final approach may come from either side: gear play is left to the mechanics (a spring, or an extra gear).

   `cl_drive_tick` and the functions of the plant must not interrupt each other. */
#ifndef CL_DRIVE_H
#define CL_DRIVE_H

#include "plant.h"
#include "servo.h"

typedef struct {
    cl_servo servo[CL_AXES];
    cl_track track;
    cl_counts position; /* encoders at the last tick */
    int64_t start_ms;   /* of the move */
    int64_t last_ms;    /* of the last tick */
    int64_t settled_ms; /* valid if `settled` */
    cl_plant_fault fault;
    uint16_t driver_ms, late_ms;
    bool settled;
    bool ticking; /* `last_ms` is valid */
    bool told;    /* the node knows of the fault */
    bool news;
} cl_drive;

/* Begin, at power-on, with the axes where they are. */
void cl_drive_init(cl_drive *drive, const cl_servo_config *const configs[CL_AXES], const cl_counts *encoders);

/* The axes are at `encoders` now, whatever was before: after homing or a restored position. Ends any move and fault. */
void cl_drive_place(cl_drive *drive, const cl_counts *encoders);

/* One control step; call it once a ms. `driver_fault` is the fault pin of the motor drivers, true for pulled low.
   True if there is news for the node: all arrived, or something failed. */
bool cl_drive_tick(cl_drive *drive, int64_t now_ms, const cl_counts *encoders, bool driver_fault,
                   int16_t pwm[CL_AXES]);

/* Latch a fault that the program noticed, such as missed encoder edges; axis from 1, 0 for all. The next tick is news. */
void cl_drive_fail(cl_drive *drive, int64_t now_ms, uint8_t fault, uint8_t axis);

/* Whether no motor runs or is about to: time for the flash. */
bool cl_drive_still(const cl_drive *drive);

/* The drive as its node sees it; searching is not its business. */
cl_plant cl_drive_plant(cl_drive *drive);

#endif

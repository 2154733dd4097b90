/* A modelled gear motor with an encoder, as the control numbers describe it: a time constant, friction that holds it up
   to a part of full duty, a load, whole counts. The encoder sits on the motor; a seized axis leaves the motor the play
   of the gears to turn in. */
#ifndef MOTOR_H
#define MOTOR_H

#include <math.h>
#include <stdint.h>

#define STEPS_PER_MS 10

typedef struct {
    double counts_per_s;  /* at full duty, without load */
    double time_constant; /* s */
    double stiction, friction; /* parts of full duty: to break loose, to keep moving */
    double load;          /* part of full duty that pulls at the axis */
    double low, high;     /* obstacles: motor positions that cannot be passed */
    double position, speed;
    int32_t wiring;       /* 1, or -1 for crossed wires */
    int32_t encoder;      /* 1 alive, 0 dead, 2 one channel dead, 3 an axis that trembles by 50 counts */
    int32_t count, jump;  /* what the encoder says; what is added to it */
    int32_t phase;        /* of the trembling [ms] */
} motor;

#define MOTOR_NEW {.counts_per_s = 6953, .time_constant = 0.03, .stiction = 0.08, .friction = 0.06, \
                   .low = -1e9, .high = 1e9, .position = 0.5, .wiring = 1, .encoder = 1}

/* One ms at `duty`. */
static inline void turn(motor *m, double duty) {
    double dt = 0.001 / STEPS_PER_MS, pull = duty * m->wiring + m->load;
    for (int step = 0; step < STEPS_PER_MS; step++) {
        if (m->speed == 0.0 && fabs(pull) <= m->stiction) continue;
        double way = m->speed != 0.0 ? copysign(1.0, m->speed) : copysign(1.0, pull);
        double speed = m->speed + dt / m->time_constant *
                       (m->counts_per_s * (pull - way * m->friction) - m->speed);
        m->speed = speed * way < 0.0 && m->speed != 0.0 ? 0.0 : speed;
        m->position += m->speed * dt;
        if (m->position < m->low || m->position > m->high) m->speed = 0.0;
        m->position = fmin(fmax(m->position, m->low), m->high);
    }
    int32_t count = (int32_t)floor(m->position);
    if (m->encoder == 1) m->count = count + m->jump;
    m->phase = (m->phase + 1) % 100;
    if (m->encoder == 3) m->count = count + 2 * (m->phase < 50 ? m->phase : 100 - m->phase) - 50;
    if (m->encoder == 2) m->count = (m->count & ~1) | (count & 1);
}

#endif

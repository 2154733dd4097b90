/* Random starts for a node: memory, sessions, a plant, mostly such as a run brings about. */
#include <string.h>

#include "maker.h"

uint64_t draw(maker *make) {
    uint64_t z = make->random += 0x9E3779B97F4A7C15u;
    z = (z ^ z >> 30) * 0xBF58476D1CE4E5B9u;
    z = (z ^ z >> 27) * 0x94D049BB133111EBu;
    return z ^ z >> 31;
}

uint32_t below(maker *make, uint32_t end) { return (uint32_t)((draw(make) >> 32) * end >> 32); }

bool chance(maker *make, uint32_t percent) { return below(make, 100) < percent; }

int32_t between(maker *make, int32_t low, int32_t high) {
    return (int32_t)(low + (int64_t)below(make, (uint32_t)((int64_t)high - low + 1)));
}

uint64_t run_tag(maker *make) { return chance(make, 70) ? 0x1111 : below(make, 3); }

void place(maker *make, const int32_t near[CL_AXES], int32_t at[CL_AXES]) {
    const cl_axis_limits *axes = twin_axes[make->start->axes];
    uint32_t kind = below(make, 40);
    for (unsigned axis = 0; axis < CL_AXES; axis++) {
        int32_t low = axes[axis].low, high = axes[axis].high, step = between(make, -200, 200);
        at[axis] = near[axis] + step;
        if (kind == 0 || at[axis] < low || at[axis] > high) at[axis] = between(make, low, high);
        if (kind == 1) at[axis] = chance(make, 50) ? low : high;
        if (kind == 2 && chance(make, 30)) at[axis] = chance(make, 50) ? low - 1 : high + 1;
        if (kind == 3 && chance(make, 10)) at[axis] = chance(make, 50) ? CL_TARGET_LIMIT : -CL_TARGET_LIMIT;
    }
}

static void random_session(maker *make, twin_session *session, int64_t now_ms) {
    uint16_t unit = CL_DEADMAN_UNIT_MS;
    session->exists = 1;
    for (unsigned i = 0; i < CL_KEY_BYTES; i++) session->key[i] = (uint8_t)draw(make);
    session->handshake = draw(make) & ~(uint64_t)CL_ATTEMPT_MASK;
    session->run_tag = run_tag(make);
    session->deadman_ms = (uint16_t)(chance(make, 55) ? 1000 : chance(make, 60) ? 250 : unit * below(make, 256));
    session->flags = (uint8_t)(chance(make, 50) ? below(make, 16) & ~(uint32_t)CL_FLAG_QUERY : CL_FLAG_RESUME);
    session->heard_ms = now_ms - (chance(make, 85) ? below(make, 300) : session->deadman_ms);
    session->order = (uint8_t)(chance(make, 90) ? below(make, 3) : 253 + below(make, 3));
}

static uint16_t session_number(uint32_t offers) { return (uint16_t)((offers - 1) % UINT16_MAX + 1); }

/* How many offers were made before: some, or nearly as many as one session number has room for, or all there are. */
static uint32_t random_offers(maker *make) {
    uint32_t kind = below(make, 20);
    if (kind == 0) return (uint32_t)(CL_OFFERS_END - 1) - below(make, 4);
    if (kind == 1) return UINT16_MAX - 2 + below(make, 4);
    return 1 + (kind < 15 ? below(make, 9) : (uint32_t)draw(make) >> 1);
}

static void random_claims(maker *make, twin_start *start) {
    twin_session *live = &start->live;
    if (chance(make, 88)) {
        random_session(make, live, start->now_ms);
        live->counter = chance(make, 90) ? below(make, 1000) : CL_COUNTER_END - 1 - below(make, 4);
        live->release = chance(make, 80) ? start->staged : (uint16_t)(start->started + below(make, 3));
        live->hold_gen = (uint8_t)(chance(make, 80) ? 2 * below(make, 2) : below(make, 20));
        if (chance(make, 5)) live->hold_gen = (uint8_t)(248 + below(make, 6));
        live->closed = chance(make, 4);
        live->owns_run = chance(make, 70);
        live->number = session_number(start->offers);
    }
    if (chance(make, 30)) {
        random_session(make, &start->offered, 0);
        start->offered.heard_ms = 0;
        start->offered.order = 0;
        if (start->offers < CL_OFFERS_END - 1) start->offers++;
        start->offered.number = session_number(start->offers);
    }
    start->silent = start->started > start->finished ? chance(make, 70) : chance(make, 12);
    start->stopped = chance(make, 8);
    start->lift_above = (uint8_t)(start->silent || start->stopped ? live->hold_gen : below(make, 2) * live->hold_gen);
}

/* As a host that tries out a single node has it: short dead-man, no run, no hold. */
static void errand_claim(maker *make, twin_start *start) {
    twin_session *live = &start->live;
    if (!live->exists || !chance(make, 25)) return;
    live->owns_run = live->closed = live->hold_gen = start->silent = start->stopped = start->lift_above = 0;
    live->deadman_ms = chance(make, 80) ? 250 : (uint16_t)(CL_SERVICE_DEADMAN_MS - 50 + 50 * below(make, 3));
    live->heard_ms = start->now_ms - below(make, 150);
    live->order = (uint8_t)below(make, 3);
}

static void random_steps(maker *make, twin_start *start) {
    uint32_t kind = below(make, 20);
    uint16_t step = (uint16_t)(chance(make, 90) ? below(make, 50) : 65532 + below(make, 4));
    start->finished = start->started = step;
    if (kind < 12 && step < UINT16_MAX) start->staged = (uint16_t)(step + 1);
    if (kind == 12 || kind == 13) start->staged = step;
    if (kind >= 14 && kind < 18 && step > 0) start->finished = (uint16_t)(step - 1);
    if (kind == 18) start->finished = start->started = start->staged = 0;
    if (kind == 19) {
        start->finished = (uint16_t)draw(make);
        start->started = (uint16_t)draw(make);
        start->staged = (uint16_t)draw(make);
    }
    start->move_ms = chance(make, 80) ? between(make, 0, 300) : between(make, 0, 100000);
    start->next_ms = (uint16_t)(chance(make, 90) ? below(make, 300) : draw(make));
}

uint8_t random_reason(maker *make) {
    return (uint8_t)(chance(make, 40) ? 0 : chance(make, 40) ? CL_NOT_HOMED : 3 + below(make, 5));
}

static void random_homing(maker *make, twin_start *start) {
    for (unsigned axis = 0; axis < CL_AXES; axis++) start->found[axis] = chance(make, 75) ? 0 : random_reason(make);
    start->seek_ms = chance(make, 60) ? between(make, 0, 300) : -1;
    if (chance(make, 85)) return;
    for (unsigned axis = 0; axis < CL_AXES; axis++) start->unhomed[axis] = random_reason(make);
    if (chance(make, 60)) start->homing = (uint8_t)(1 + below(make, CL_ALL_AXES));
    for (unsigned axis = 0; axis < CL_AXES; axis++) {
        if (start->homing >> axis & 1) start->unhomed[axis] = CL_NOT_HOMED;
    }
}

/* A node on trial, or one that has got pieces of other settings. */
static void random_settings(maker *make, twin_start *start) {
    static const uint8_t outcomes[8] = {
        CL_OUTCOME_DONE, CL_OUTCOME_DONE, CL_OUTCOME_DONE, CL_OUTCOME_DONE, CL_OUTCOME_DONE, CL_OUTCOME_DONE,
        CL_OUTCOME_BEYOND, CL_OUTCOME_FAILED,
    };
    start->keeps = outcomes[below(make, 8)];
    start->on_trial = chance(make, 8);
    if (start->on_trial || chance(make, 5)) start->trial_ms = chance(make, 70) ? between(make, 1, 900) : 0;
    if (start->live.exists && !start->on_trial) {
        start->pieces = (uint8_t)(chance(make, 30) ? CL_ALL_PIECES : below(make, CL_ALL_PIECES + 1));
    }
}

void random_start(maker *make, twin_start *start) {
    static const int32_t middle[CL_AXES] = {0};
    static const int64_t epochs[4] = {0, 0, (int64_t)1 << 31, (int64_t)1 << 40};
    start->who = (uint8_t)below(make, 3);
    start->axes = (uint8_t)(chance(make, 75) ? 0 : below(make, 4));
    start->now_ms = epochs[below(make, 4)] + below(make, 5000);
    start->run_tag = run_tag(make);
    start->noise = (uint32_t)draw(make);
    start->boot = 1 + below(make, CL_BOOT_END - 1);
    start->cause = (uint8_t)below(make, CL_CAUSE_SOFTWARE + 1);
    start->offers = random_offers(make);
    random_steps(make, start);
    place(make, middle, start->place);
    if (chance(make, 3)) start->place[below(make, 3)] = between(make, -CL_TARGET_LIMIT + 999999, CL_TARGET_LIMIT - 999999);
    place(make, start->place, start->next_target);
    place(make, start->place, start->target);
    if (chance(make, 60)) memcpy(start->target, start->place, sizeof start->target);
    random_homing(make, start);
    start->estop = chance(make, 2);
    start->turning = !start->homing && !start->estop && chance(make, 6);
    start->fault = chance(make, 6) ? (uint8_t)(1 + below(make, 7)) : CL_FAULT_NONE;
    start->fault_axis = start->fault ? (uint8_t)below(make, 4) : 0;
    start->fault_ms = start->fault ? start->now_ms - (chance(make, 90) ? below(make, 9999) : 66000000) : 0;
    start->lag_ms = chance(make, 80) ? between(make, 0, 30) : -1;
    random_claims(make, start);
    errand_claim(make, start);
    random_settings(make, start);
    start->bad_tags = (uint16_t)(chance(make, 90) ? below(make, 9) : UINT16_MAX - below(make, 2));
    start->old_frames = (uint16_t)(chance(make, 90) ? below(make, 9) : UINT16_MAX - below(make, 2));
    start->window_ms = start->now_ms - below(make, 1100);
    start->in_window = (uint8_t)(chance(make, 80) ? below(make, 9) : CL_FLOOD - below(make, 3));
    start->deaf_until_ms = chance(make, 5) ? start->now_ms + below(make, 200) : 0;
}

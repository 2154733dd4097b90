/* Random events for a node: mostly what a host does, often spoiled, at moments that matter. */
#include <string.h>

#include "bytes.h"
#include "maker.h"

/* Frames */

static void sign(uint8_t *payload, const cl_keyed *key, uint64_t clock) {
    cl_tag(key, payload, clock, CL_FROM_HOST, payload + CL_BODY_BYTES);
}

static void put24(uint8_t *to, int32_t value) {
    to[0] = (uint8_t)value;
    to[1] = (uint8_t)((uint32_t)value >> 8);
    to[2] = (uint8_t)((uint32_t)value >> 16);
}

static uint8_t next_hold(maker *make, const cl_session *session) {
    uint8_t now = session->hold_gen;
    if (chance(make, 65)) return now;
    if (chance(make, 5)) return (uint8_t)(CL_HOLD_END + below(make, 2));
    return (uint8_t)(chance(make, 80) ? now + below(make, 4) : below(make, 8));
}

static void fill_drive(maker *make, const cl_session *session, uint8_t *payload) {
    const cl_memory *memory = &make->it.node.memory;
    uint32_t kind = below(make, 10);
    uint16_t done = session->owns_run || chance(make, 10) ? memory->started : 0;
    uint16_t step = kind < 3 ? 0 : (uint16_t)(done + 1);
    cl_counts target = memory->next_target;
    uint16_t move_ms = memory->next_ms;
    if (kind == 9 || (kind >= 3 && memory->staged <= memory->started)) {
        place(make, memory->target.at, target.at);
        move_ms = (uint16_t)(chance(make, 90) ? below(make, 300) : draw(make));
    }
    if (kind == 9 && chance(make, 50)) {
        target = memory->next_target;
        if (chance(make, 50)) target.at[below(make, 3)] += 1;
    }
    if (chance(make, 4)) step = (uint16_t)(done + below(make, 4));
    uint16_t staged = session->owns_run ? memory->staged : step;
    uint16_t release = (uint16_t)(staged + below(make, 2) - (chance(make, 20) ? 1 : 0));
    cl_put16(payload + 8, chance(make, 3) ? (uint16_t)draw(make) : release);
    cl_put16(payload + 10, step);
    for (unsigned axis = 0; axis < CL_AXES; axis++) put24(payload + 12 + 3 * axis, target.at[axis]);
    cl_put16(payload + 21, move_ms);
    payload[23] = next_hold(make, session);
}

static void fill_home(maker *make, const cl_session *session, uint8_t *payload) {
    payload[8] = (uint8_t)(1 + below(make, CL_ALL_AXES));
    payload[9] = (uint8_t)(session->order + (chance(make, 85) ? 1 : 2 * below(make, 2)));
}

static void fill_errand(maker *make, const cl_axis_limits *axis, uint8_t *payload) {
    static const uint16_t rates[3] = {CL_LEAST_RATE, CL_TURN_COUNTS, 1};
    static const uint16_t spans[3] = {CL_TURN_MS, CL_TURN_MS + 1, 0};
    int32_t at = make->it.plant.place.at[payload[10] - 1], amount = between(make, -300, 300);
    if (payload[8] == CL_OPERATION_PLACE) amount = between(make, axis->low, axis->high);
    if (payload[8] != CL_OPERATION_TURN && chance(make, 20)) amount = chance(make, 50) ? axis->low - at : axis->high - at;
    if (payload[8] == CL_OPERATION_TURN && chance(make, 20)) amount = between(make, CL_TURN_DUTY - 1, CL_TURN_DUTY + 1);
    if (chance(make, 10)) amount = between(make, -CL_UNHOMED_COUNTS - 9, CL_UNHOMED_COUNTS + 9);
    if (chance(make, 10)) amount = CL_UNHOMED_COUNTS + between(make, -1, 2);
    if (chance(make, 5)) amount += between(make, -1, 1);
    uint16_t rate = rates[below(make, 3)] + (uint16_t)between(make, -1, 1);
    cl_put32(payload + 12, (uint32_t)amount);
    cl_put16(payload + 16, chance(make, 50) ? (uint16_t)between(make, 100, 1000) : rate);
    cl_put16(payload + 18, chance(make, 75) ? (uint16_t)between(make, 1, CL_TURN_MS) : spans[below(make, 3)]);
}

static void fill_service(maker *make, const cl_session *session, uint8_t *payload) {
    static const uint8_t operations[8] = {0, 1, 2, 2, 2, 3, 3, 4};
    uint8_t axis = (uint8_t)(1 + below(make, CL_AXES));
    payload[8] = operations[below(make, 8)];
    payload[9] = (uint8_t)(session->order + (chance(make, 85) ? 1 : 2 * below(make, 2)));
    payload[10] = payload[8] >= CL_OPERATION_JOG || chance(make, 70) ? axis : 0;
    payload[11] = (uint8_t)(below(make, 5) | (chance(make, 60) ? 16 : 0) | (chance(make, 20) ? 32 : 0));
    if (payload[8] >= CL_OPERATION_JOG) fill_errand(make, &make->it.node.axes[axis - 1], payload);
    if (payload[8] == CL_OPERATION_LOOK) cl_put16(payload + 16, (uint16_t)below(make, 300));
}

/* A piece, hidden as a host hides it, mostly one that the node lacks; or an order. */
static void fill_settings(maker *make, const cl_session *session, uint8_t *payload) {
    const cl_node *node = &make->it.node;
    static const uint8_t operations[11] = {0, 0, 0, 0, 1, 1, 1, 2, 3, 4, 5};
    payload[8] = node->on_trial && chance(make, 60) ? (uint8_t)(3 + below(make, 3)) : operations[below(make, 11)];
    payload[9] = (uint8_t)(session->order + (chance(make, 85) ? 1 : 2 * below(make, 2)));
    if (payload[8] != CL_SETTINGS_PIECE) return;
    payload[9] = (uint8_t)below(make, CL_PIECES);
    uint8_t stream[CL_KEY_BYTES];
    cl_settings_stream(stream, &make->secret, cl_get32(payload + 4));
    for (unsigned i = 0; i < CL_PIECE_BYTES; i++) payload[10 + i] = stream[i] ^ (uint8_t)draw(make);
}

/* The time of the node that a host has heard last [ticks]: a moment ago, or as long ago as `spoil` says. */
static int64_t heard_clock(maker *make, const cl_session *session, uint8_t spoil) {
    int64_t now = make->now_ms >> CL_CLOCK_SHIFT, dead = (make->now_ms - session->deadman_ms) >> CL_CLOCK_SHIFT;
    if (spoil == TWIN_OLD_CLOCK) return chance(make, 60) ? dead : now - 255 + below(make, 56);
    if (spoil == TWIN_FUTURE_CLOCK) return now + 1 + below(make, 9);
    if (spoil == TWIN_WRAPPED_CLOCK) return now - 256 - below(make, 300);
    if (chance(make, 10) && dead < now) return dead + 1 + below(make, (uint32_t)(now - dead));
    return now - (chance(make, 20) ? below(make, 4) : 0);
}

static uint32_t next_counter(maker *make, uint32_t counter) {
    if (chance(make, 90)) return counter + 1;
    if (chance(make, 30)) return counter - below(make, 3);
    if (chance(make, 15)) return (uint32_t)(CL_COUNTER_END - 1 + below(make, 3));
    return counter + below(make, 5);
}

/* The key that a host would sign with: given at the start, or derived from the offer; never the one the node keeps. */
static const cl_keyed *host_key(maker *make, const cl_session *session) {
    const cl_node *node = &make->it.node;
    const twin_start *start = make->start;
    cl_key key = {{0}};
    if (session->number == start->live.number) {
        memcpy(key.bytes, start->live.key, sizeof key.bytes);
    } else if (session->number == start->offered.number) {
        memcpy(key.bytes, start->offered.key, sizeof key.bytes);
    } else {
        uint32_t newest = node->memory.nonce.offers;
        uint32_t since = ((newest - 1) % UINT16_MAX + UINT16_MAX + 1 - session->number) % UINT16_MAX;
        cl_node_nonce nonce = {start->boot, newest - since, start->noise};
        cl_session_key(&key, &node->key, &(cl_handshake){session->handshake, nonce, session->run_tag});
    }
    make->secret = key;
    cl_tag_key(&make->session_key, &key);
    return &make->session_key;
}

/* A DRIVE, a HOME, a SERVICE, a SETTINGS or an ESTOP of the live session, or of the offered one; of none if there is none. */
static const cl_keyed *fill_claim(maker *make, twin_event *event, uint8_t kind) {
    uint8_t *payload = event->payload;
    const cl_node *node = &make->it.node;
    bool live = node->session.exists && (!node->pending.exists || chance(make, 65));
    const cl_session *session = live ? &node->session : &node->pending;
    payload[0] = (uint8_t)(CL_VERSION << 4 | kind);
    payload[1] = node->number;
    if (kind != CL_KIND_ESTOP) {
        make->clock = (uint64_t)heard_clock(make, session, event->spoil);
        payload[1] = (uint8_t)make->clock;
    }
    cl_put16(payload + 2, session->number);
    cl_put32(payload + 4, next_counter(make, session->counter));
    if (kind == CL_KIND_DRIVE) fill_drive(make, session, payload);
    if (kind == CL_KIND_HOME) fill_home(make, session, payload);
    if (kind == CL_KIND_SERVICE) fill_service(make, session, payload);
    const cl_keyed *key = host_key(make, session);
    if (kind == CL_KIND_SETTINGS) fill_settings(make, session, payload);
    return key;
}

static const cl_keyed *fill_hello(maker *make, uint8_t *payload, uint8_t frame) {
    const cl_node *node = &make->it.node;
    if (frame == TWIN_HELLO || make->handshake == 0) make->handshake = draw(make) & ~(uint64_t)CL_ATTEMPT_MASK;
    if (frame == TWIN_HELLO && chance(make, 2)) make->handshake = 0;
    if (frame == TWIN_REPEATED_HELLO && node->pending.exists) make->handshake = node->pending.handshake;
    uint8_t flags = (uint8_t)(below(make, 16) & ~(uint32_t)CL_FLAG_QUERY);
    payload[0] = CL_VERSION << 4 | CL_KIND_HELLO;
    payload[1] = node->number;
    payload[2] = payload[3] = CL_VERSION;
    cl_put64(payload + 4, make->handshake | below(make, 256));
    cl_put64(payload + 12, run_tag(make));
    cl_put16(payload + 20, node->config_hash);
    payload[22] = chance(make, 50) ? 20 : chance(make, 60) ? 5 : (uint8_t)draw(make);
    payload[23] = frame == TWIN_QUERY ? flags | CL_FLAG_QUERY : flags;
    return &node->node_key;
}

static const cl_keyed *fill_open(maker *make, uint8_t *payload, uint8_t frame) {
    const cl_node *node = &make->it.node;
    payload[0] = (uint8_t)(CL_VERSION << 4 | (frame == TWIN_PAGE ? CL_KIND_PAGE : CL_KIND_STOP));
    payload[1] = CL_EVERY_NODE;
    if (frame == TWIN_STOP) {
        payload[2] = (uint8_t)draw(make);
        return &node->stop_key;
    }
    if (chance(make, 50)) payload[1] = node->number;
    payload[2] = chance(make, 90) ? CL_WHO : (uint8_t)draw(make);
    cl_put64(payload + 4, chance(make, 90) ? draw(make) : below(make, 300));
    return &node->open_key;
}

/* A frame that no host sends to a node, under a key that the node knows. */
static const cl_keyed *fill_strange(maker *make, uint8_t *payload) {
    static const uint8_t heads[7] = {0x22, 0x24, 0x20, 0x28, 0x11, 0x2B, 0x2D};
    for (unsigned i = 0; i < CL_BODY_BYTES; i++) payload[i] = (uint8_t)draw(make);
    payload[0] = heads[below(make, 7)];
    return chance(make, 50) ? &make->it.node.node_key : &make->it.node.session.key;
}

static uint8_t frame_kind(maker *make) {
    static const uint8_t parts[TWIN_FRAMES] = {44, 9, 13, 3, 2, 4, 7, 6, 4, 4, 4};
    const cl_session *session = &make->it.node.session;
    uint32_t part = below(make, 100);
    bool tries = session->exists && !session->owns_run && session->deadman_ms <= CL_SERVICE_DEADMAN_MS;
    if (tries && chance(make, 40)) return TWIN_SERVICE;
    if (session->exists && !session->owns_run && chance(make, make->it.node.on_trial ? 40 : 15)) return TWIN_SETTINGS;
    for (uint8_t frame = 0; frame < TWIN_FRAMES; frame++) {
        if (part < parts[frame]) return frame;
        part -= parts[frame];
    }
    return TWIN_DRIVE;
}

static const cl_keyed *fill_frame(maker *make, twin_event *event) {
    uint8_t *payload = event->payload, frame = event->frame;
    make->clock = 0;
    if (frame == TWIN_DRIVE) return fill_claim(make, event, CL_KIND_DRIVE);
    if (frame == TWIN_HOME) return fill_claim(make, event, CL_KIND_HOME);
    if (frame == TWIN_SERVICE) return fill_claim(make, event, CL_KIND_SERVICE);
    if (frame == TWIN_SETTINGS) return fill_claim(make, event, CL_KIND_SETTINGS);
    if (frame == TWIN_ESTOP) return fill_claim(make, event, CL_KIND_ESTOP);
    if (frame == TWIN_PAGE || frame == TWIN_STOP) return fill_open(make, payload, frame);
    if (frame == TWIN_NO_NODES_FRAME) return fill_strange(make, payload);
    return fill_hello(make, payload, frame);
}

static void make_home_odd(maker *make, uint8_t *payload) {
    uint32_t kind = below(make, 3);
    if (kind == 0) payload[8] = 0;
    if (kind == 1) payload[8] |= (uint8_t)(8 << below(make, 5));
    if (kind == 2) payload[10 + below(make, 14)] = 1;
}

static void make_service_odd(maker *make, uint8_t *payload) {
    uint32_t kind = below(make, 6);
    if (kind == 0) payload[8] = (uint8_t)(5 + below(make, 251));
    if (kind == 1) payload[10] = (uint8_t)(payload[8] >= CL_OPERATION_JOG ? 0 : 4 + below(make, 200));
    if (kind == 2) payload[11] |= (uint8_t)(5 + 3 * below(make, 2));
    if (kind == 3) payload[11] |= (uint8_t)(64 << below(make, 2));
    if (kind == 4) payload[20 + below(make, 4)] = 1;
    if (kind == 5) cl_put32(payload + 12, (uint32_t)(chance(make, 50) ? CL_TARGET_LIMIT + 1 : -CL_TARGET_LIMIT - 1));
}

static void make_settings_odd(maker *make, uint8_t *payload) {
    if (chance(make, 40)) payload[8] = (uint8_t)(5 + below(make, 251));
    else if (payload[8] == CL_SETTINGS_PIECE) payload[9] = (uint8_t)(CL_PIECES + below(make, 250));
    else payload[10 + below(make, CL_PIECE_BYTES)] = 1;
}

/* Fields that no encoder would write, before the frame is signed. */
static void make_odd(maker *make, twin_event *event) {
    uint8_t *payload = event->payload;
    if (event->frame == TWIN_DRIVE) put24(payload + 12 + 3 * below(make, 3), -CL_TARGET_LIMIT - 1);
    if (event->frame == TWIN_HOME) make_home_odd(make, payload);
    if (event->frame == TWIN_SERVICE) make_service_odd(make, payload);
    if (event->frame == TWIN_SETTINGS) make_settings_odd(make, payload);
    if (event->frame == TWIN_ESTOP) payload[8 + below(make, 16)] = 1;
    if (event->frame == TWIN_STOP) payload[chance(make, 30) ? 1 : 3 + below(make, 21)] ^= 0x10;
    if (event->frame == TWIN_PAGE) payload[chance(make, 30) ? 3 : 12 + below(make, 12)] = 0x80;
    if (event->frame == TWIN_HELLO) payload[2 + below(make, 2)] = (uint8_t)draw(make);
}

static void spoil_before_signing(maker *make, twin_event *event) {
    if (event->spoil == TWIN_OTHER_NODE) event->payload[1] ^= (uint8_t)(1 + below(make, 255));
    if (event->spoil == TWIN_OTHER_SESSION) cl_put16(event->payload + 2, (uint16_t)draw(make));
    if (event->spoil == TWIN_ODD_FIELD) make_odd(make, event);
}

static void spoil_after_signing(maker *make, twin_event *event) {
    uint32_t bit = below(make, 8 * CL_FRAME_BYTES);
    if (event->spoil == TWIN_FLIPPED_BIT) event->payload[bit / 8] ^= (uint8_t)(1 << bit % 8);
    if (event->spoil == TWIN_FORGED_TAG) cl_put64(event->payload + CL_BODY_BYTES, draw(make));
    if (event->spoil == TWIN_CUT_SHORT) event->length = (uint8_t)below(make, CL_FRAME_BYTES);
    if (event->spoil == TWIN_REPLAYED && make->sent_count > 0) {
        memcpy(event->payload, make->sent[below(make, make->sent_count)], CL_FRAME_BYTES);
    }
}

static void make_frame(maker *make, twin_event *event) {
    event->what = TWIN_RECEIVE;
    event->length = CL_FRAME_BYTES;
    event->frame = frame_kind(make);
    event->spoil = chance(make, 75) ? TWIN_UNSPOILED : (uint8_t)(1 + below(make, TWIN_SPOILS - 1));
    const cl_keyed *key = fill_frame(make, event);
    spoil_before_signing(make, event);
    sign(event->payload, key, make->clock);
    spoil_after_signing(make, event);
    memcpy(make->sent[make->sent_count % REMEMBERED], event->payload, CL_FRAME_BYTES);
    if (make->sent_count < REMEMBERED) make->sent_count++;
}

/* Everything else */

static void make_plant_event(maker *make, twin_event *event) {
    static const int32_t plant_faults[5] = {
        CL_FAULT_STALL, CL_FAULT_RUNAWAY, CL_FAULT_ENCODER, CL_FAULT_DRIVER, CL_FAULT_BROWN_OUT,
    };
    event->what = (uint8_t)(TWIN_SHIFT + below(make, make->it.node.memory.homing || make->it.node.turning ? 4 : 3));
    if (event->what == TWIN_SHIFT) {
        for (unsigned axis = 0; axis < CL_AXES; axis++) event->args[axis] = between(make, -9, 9);
    } else if (event->what == TWIN_SETTLE) {
        event->args[0] = chance(make, 85);
        event->args[1] = between(make, -20, 200);
    } else if (event->what == TWIN_SEARCH) {
        event->args[0] = chance(make, 90);
        event->args[1] = between(make, -20, 200);
        for (unsigned axis = 0; axis < CL_AXES; axis++) event->args[2] |= random_reason(make) << 4 * axis;
    } else {
        event->args[0] = chance(make, 90) ? plant_faults[below(make, 5)] : 0;
        event->args[1] = between(make, 0, 3);
        event->args[2] = between(make, -20, 200);
    }
}

static int64_t next_moment(maker *make, int64_t now_ms) {
    int64_t due_ms = make->it.node.next_ms;
    uint32_t kind = below(make, 20);
    if (kind < 4) return now_ms;
    if (kind < 10) return now_ms + below(make, 20);
    if (kind < 14) return now_ms + below(make, 400);
    if (kind == 14) return now_ms + below(make, 5000);
    if (!make->it.node.moving && !make->it.node.turning && !make->it.node.memory.homing && kind > 15) return now_ms + below(make, 50);
    if (due_ms == INT64_MAX || due_ms > now_ms + 1000000) return now_ms + below(make, 1200);
    due_ms += kind == 15 ? -1 : kind == 16 ? 1 : 0;
    return due_ms < now_ms ? now_ms : due_ms;
}

/* At some moments a dead-man time has passed since the beginning of a tick: frames of that tick have just become old. */
static int64_t on_the_edge(maker *make, int64_t at_ms) {
    const cl_session *session = &make->it.node.session;
    int64_t tick_ms = 1 << CL_CLOCK_SHIFT, over_ms = (at_ms - session->deadman_ms) % tick_ms;
    return chance(make, 6) && over_ms >= 0 ? at_ms + (tick_ms - over_ms) % tick_ms : at_ms;
}

static void make_event(maker *make, twin_event *event, int64_t now_ms) {
    uint32_t kind = below(make, 100);
    memset(event, 0, sizeof *event);
    event->now_ms = make->now_ms = on_the_edge(make, next_moment(make, now_ms));
    if (kind < 64) {
        make_frame(make, event);
    } else if (kind < 76) {
        event->what = TWIN_ADVANCE;
    } else if (kind < 84) {
        event->what = TWIN_NOTICE;
    } else if (kind < 96) {
        make_plant_event(make, event);
    } else {
        event->what = chance(make, make->it.node.memory.homing ? 15 : 80) ? TWIN_START_HOMING : TWIN_STOP_HOMING;
        event->args[0] = 1 + (int32_t)below(make, CL_ALL_AXES);
    }
}

void twin_generate(uint64_t seed, twin_start *start, twin_event *events) {
    maker make = {.random = seed, .start = start};
    memset(start, 0, sizeof *start);
    draw(&make);
    random_start(&make, start);
    start->events = (uint8_t)(2 + below(&make, TWIN_MOST_EVENTS - 3));
    twin_begin(&make.it, start);
    int64_t now_ms = start->now_ms;
    for (unsigned i = 0; i < start->events; i++) {
        make_event(&make, &events[i], now_ms);
        now_ms = events[i].now_ms;
        twin_do(&make.it, &events[i]);
    }
}

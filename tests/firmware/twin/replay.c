/* Runs the C node through sequences of events, with a plant that does as it is told. */
#include <string.h>

#include "bytes.h"
#include "twin.h"

const cl_axis_limits twin_axes[4][CL_AXES] = {
    {{-221326, 221326, 4426, 22132}, {-5215, 5215, 3128, 13906}, {-48691, 48691, 2213, 11066}},
    {{-262136, 262136, 1000000, 1000000}, {-262136, 262136, 100, 1000000}, {-262136, 262136, 1000000, 100}},
    {{0, 1000, 100, 100}, {-3, 3, 997, 1009}, {-262136, -262000, 123456, 100}},
    {{-100000, 100000, 50000, 200000}, {-90, 90, 6000, 40000}, {0, 0, 100, 100}},
};

const cl_identity twin_identities[3] = {
    {1, 0xA0000001, 1, {{0}}},
    {3, 0xA0000003, 7, {{1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15, 16}}},
    {128, 0xFFFFFFFF, 0x01020304, {{0xFF, 0xFE}}},
};

static void follow(void *self, int64_t now_ms, int64_t start_ms, const cl_move *move) {
    twin_plant *plant = self;
    if (now_ms == start_ms) memset(&plant->shift, 0, sizeof plant->shift);
    plant->move = *move;
    plant->start_ms = start_ms;
    plant->following = true;
    plant->follows++;
    plant->settle_known = plant->lag_ms >= 0;
    plant->settles_ms = start_ms + cl_move_end_ms(move) + plant->lag_ms;
    if (plant->settles_ms < now_ms) plant->settles_ms = now_ms;
}

static void positions(void *self, int64_t now_ms, cl_counts *counts) {
    const twin_plant *plant = self;
    *counts = plant->place;
    if (plant->following) cl_move_at(&plant->move, now_ms - plant->start_ms, counts);
    for (unsigned axis = 0; axis < CL_AXES; axis++) counts->at[axis] += plant->shift.at[axis];
}

static bool settles(void *self, int64_t *at_ms) {
    const twin_plant *plant = self;
    *at_ms = plant->settles_ms;
    return plant->settle_known;
}

static bool fault(void *self, cl_plant_fault *fault) {
    const twin_plant *plant = self;
    *fault = plant->fault;
    return plant->fault_known;
}

/* What a search of some axes comes to says nothing about the others. */
static void seek(void *self, int64_t now_ms, uint8_t axes) {
    twin_plant *plant = self;
    plant->sought = axes;
    plant->seeks++;
    plant->search_known = plant->seek_ms >= 0;
    plant->search = (cl_sought){.at_ms = now_ms + plant->seek_ms, .reasons = plant->found};
}

static bool sought(void *self, cl_sought *search) {
    const twin_plant *plant = self;
    *search = plant->search;
    return plant->search_known;
}

static void give_up(void *self, int64_t now_ms) {
    twin_plant *plant = self;
    (void)now_ms;
    plant->search_known = plant->turned_known = false;
    plant->give_ups++;
}

static void turn(void *self, int64_t now_ms, const cl_turn *wanted) {
    twin_plant *plant = self;
    plant->turn = *wanted;
    plant->turns++;
    plant->turned_known = plant->seek_ms >= 0;
    plant->turned_ms = now_ms + plant->seek_ms;
}

static bool turned(void *self, int64_t *at_ms) {
    const twin_plant *plant = self;
    *at_ms = plant->turned_ms;
    return plant->turned_known;
}

static void place(void *self, int64_t now_ms, uint8_t axis, int32_t counts) {
    twin_plant *plant = self;
    cl_counts at;
    positions(self, now_ms, &at);
    plant->shift.at[axis - 1] += counts - at.at[axis - 1];
    plant->places++;
}

/* Numbers that differ with all that they may depend on. */
static void look(void *self, int64_t now_ms, uint8_t axis, uint8_t first, cl_look *seen) {
    twin_plant *plant = self;
    *seen = (cl_look){
        .lines = (uint8_t)(plant->follows & 0x2F),
        .samples = (uint8_t)plant->turns,
        .supply_mv = (uint16_t)(3300 + plant->places),
        .missed = (uint16_t)(axis + plant->seeks),
        .lag = (uint16_t)(7 * axis),
        .threshold = (uint16_t)(plant->give_ups + 9),
        .duty = (int16_t)-axis,
    };
    positions(self, now_ms, &seen->counts);
    for (unsigned number = 0; number < CL_READING_SAMPLES; number++) {
        seen->trace[number] = (int16_t)(10 * axis - first - (int)number);
    }
}

static uint8_t store(void *self, const uint8_t *record) {
    twin_plant *plant = self;
    memcpy(plant->record, record, sizeof plant->record);
    plant->stores++;
    return plant->told;
}

static uint8_t request(void *self) {
    twin_plant *plant = self;
    plant->requests++;
    return plant->told;
}

static uint8_t keep(void *self) {
    twin_plant *plant = self;
    plant->keeps++;
    return plant->told;
}

static void drop(void *self) { ((twin_plant *)self)->drops++; }

static void standing(void *self, cl_standing *now) {
    const twin_plant *plant = self;
    *now = (cl_standing){plant->on_trial, (uint16_t)(0xFE00 + plant->keeps), (uint16_t)(0xFE00 + plant->stores)};
}

static void loader(void *self) { (void)self; }

static cl_plant plant_of(twin_plant *plant) {
    return (cl_plant){
        plant, follow, positions, settles, fault, seek, sought, give_up, turn, turned, place, look,
        store, request, keep, drop, standing, plant->seek_ms & 1 ? loader : 0,
    };
}

static void begin_session(cl_session *session, const twin_session *from) {
    *session = (cl_session){
        .heard_ms = from->heard_ms,
        .handshake = from->handshake,
        .run_tag = from->run_tag,
        .deadman_ms = from->deadman_ms,
        .flags = from->flags,
        .hold_gen = from->hold_gen,
        .number = from->number,
        .release = from->release,
        .counter = from->counter,
        .exists = from->exists,
        .closed = from->closed,
        .owns_run = from->owns_run,
        .order = from->order,
    };
    memcpy(session->secret.bytes, from->key, sizeof session->secret.bytes);
    cl_tag_key(&session->key, &session->secret);
}

void twin_begin(twin *it, const twin_start *start) {
    cl_memory memory = {
        .run_tag = start->run_tag,
        .nonce = {start->boot, start->offers, start->noise},
        .cause = start->cause,
        .fault_ms = start->fault_ms,
        .homing = start->homing,
        .estop = start->estop,
        .fault = start->fault,
        .fault_axis = start->fault_axis,
        .finished = start->finished,
        .started = start->started,
        .staged = start->staged,
        .next_ms = start->next_ms,
        .move_ms = start->move_ms,
    };
    memcpy(memory.unhomed.of, start->unhomed, sizeof start->unhomed);
    memcpy(memory.target.at, start->target, sizeof start->target);
    memcpy(memory.next_target.at, start->next_target, sizeof start->next_target);
    memset(it, 0, sizeof *it);
    memcpy(it->plant.place.at, start->place, sizeof start->place);
    it->plant.lag_ms = start->lag_ms;
    it->plant.seek_ms = start->seek_ms;
    memcpy(it->plant.found.of, start->found, sizeof start->found);
    if (start->homing) seek(&it->plant, start->now_ms, start->homing);
    it->plant.told = start->keeps;
    it->plant.on_trial = start->on_trial;
    cl_plant plant = plant_of(&it->plant);
    cl_node_init(&it->node, &twin_identities[start->who], twin_axes[start->axes], plant, &memory);
    begin_session(&it->node.session, &start->live);
    begin_session(&it->node.pending, &start->offered);
    if (start->turning) {
        turn(&it->plant, start->now_ms, &(cl_turn){.axis = 1});
        it->node.turning = true;
        it->node.outcome = CL_OUTCOME_BUSY;
    }
    it->node.pieces = start->pieces;
    for (unsigned at = 0; at < sizeof it->node.record; at++) it->node.record[at] = (uint8_t)(3 * at + start->who);
    if (start->trial_ms != 0) it->node.trial_ends_ms = start->now_ms + start->trial_ms;
    it->node.silent = start->silent;
    it->node.stopped = start->stopped;
    it->node.lift_above = start->lift_above;
    it->node.tally.bad_tags = start->bad_tags;
    it->node.tally.old_frames = start->old_frames;
    it->node.tally.window_ms = start->window_ms;
    it->node.tally.deaf_until_ms = start->deaf_until_ms;
    it->node.tally.in_window = start->in_window;
}

void twin_do(twin *it, const twin_event *event) {
    cl_node *node = &it->node;
    twin_plant *plant = &it->plant;
    const int32_t *args = event->args;
    if (event->what == TWIN_RECEIVE) cl_node_receive(node, event->now_ms, event->payload, event->length);
    if (event->what == TWIN_ADVANCE) cl_node_advance(node, event->now_ms);
    if (event->what == TWIN_NOTICE) cl_node_notice(node, event->now_ms);
    if (event->what == TWIN_START_HOMING) cl_node_start_homing(node, event->now_ms, (uint8_t)args[0]);
    if (event->what == TWIN_STOP_HOMING) cl_node_stop_homing(node, event->now_ms);
    if (event->what == TWIN_SHIFT) {
        for (unsigned axis = 0; axis < CL_AXES; axis++) plant->shift.at[axis] += args[axis];
    }
    if (event->what == TWIN_SETTLE) {
        plant->settle_known = args[0] != 0;
        plant->settles_ms = event->now_ms + args[1];
    }
    if (event->what == TWIN_FAULT) {
        plant->fault_known = args[0] != 0;
        plant->fault = (cl_plant_fault){event->now_ms + args[2], (uint8_t)args[0], (uint8_t)args[1]};
    }
    if (event->what == TWIN_SEARCH) {
        plant->search_known = plant->turned_known = args[0] != 0;
        plant->search.at_ms = plant->turned_ms = event->now_ms + args[1];
        for (unsigned axis = 0; axis < CL_AXES; axis++) plant->search.reasons.of[axis] = args[2] >> 4 * axis & 15;
    }
}

void twin_look(const twin *it, int64_t now_ms, twin_short *seen) {
    cl_counts setpoint;
    memset(seen, 0, sizeof *seen);
    memcpy(seen->ack, it->node.ack, CL_FRAME_BYTES);
    seen->ack_length = it->node.ack_length;
    seen->state = cl_node_state(&it->node);
    seen->loads = (uint16_t)it->node.ack_serial;
    cl_node_setpoint(&it->node, now_ms, &setpoint);
    memcpy(seen->setpoint, setpoint.at, sizeof seen->setpoint);
}

static void look_at_memory(const cl_memory *memory, twin_full *seen) {
    seen->run_tag = memory->run_tag;
    seen->noise = memory->nonce.noise;
    seen->boot = memory->nonce.boot;
    seen->offers = memory->nonce.offers;
    seen->fault_ms = memory->fault_ms;
    seen->finished = memory->finished;
    seen->started = memory->started;
    seen->staged = memory->staged;
    seen->move_ms = memory->move_ms;
    seen->next_step_ms = memory->next_ms;
    memcpy(seen->unhomed, memory->unhomed.of, sizeof seen->unhomed);
    seen->homing = memory->homing;
    seen->estop = memory->estop;
    seen->fault = memory->fault;
    seen->fault_axis = memory->fault_axis;
    memcpy(seen->target, memory->target.at, sizeof seen->target);
    memcpy(seen->next_target, memory->next_target.at, sizeof seen->next_target);
}

static void look_at_plant(const twin_plant *plant, twin_full *seen) {
    memcpy(seen->plant_start, plant->move.start.at, sizeof seen->plant_start);
    memcpy(seen->plant_target, plant->move.target.at, sizeof seen->plant_target);
    seen->duration_ms = plant->move.duration_ms;
    seen->ramp_ms = plant->move.ramp_ms;
    seen->brake_ms = plant->move.brake_ms;
    seen->follows = plant->follows;
    seen->seeks = plant->seeks;
    seen->give_ups = plant->give_ups;
    seen->sought = plant->sought;
    seen->turns = plant->turns;
    seen->places = plant->places;
    seen->stores = plant->stores;
    seen->requests = plant->requests;
    seen->keeps = plant->keeps;
    seen->drops = plant->drops;
    memcpy(seen->record, plant->record, sizeof seen->record);
    seen->turn[0] = plant->turn.axis | plant->turn.at_once << 8;
    seen->turn[1] = plant->turn.duty;
    seen->turn[2] = plant->turn.counts;
    seen->turn[3] = plant->turn.span_ms;
}

void twin_look_closely(const twin *it, twin_full *seen) {
    const cl_node *node = &it->node;
    memset(seen, 0, sizeof *seen);
    look_at_memory(&node->memory, seen);
    look_at_plant(&it->plant, seen);
    seen->next_ms = node->next_ms == INT64_MAX ? -1 : node->next_ms;
    seen->move_start_ms = node->move_start_ms;
    seen->window_ms = node->tally.window_ms;
    seen->deaf_until_ms = node->tally.deaf_until_ms;
    seen->bad_tags = node->tally.bad_tags;
    seen->old_frames = node->tally.old_frames;
    seen->floods = node->tally.floods;
    seen->in_window = node->tally.in_window;
    seen->moving = node->moving;
    seen->jogging = node->jogging;
    seen->turning = node->turning;
    seen->outcome = node->outcome;
    seen->blink_until_ms = node->blink_until_ms;
    seen->trial_ends_ms = node->trial_ends_ms;
    seen->on_trial = node->on_trial;
    seen->leaves = node->leaves;
    seen->pieces = node->pieces;
    seen->silent = node->silent;
    seen->stopped = node->stopped;
    seen->lift_above = node->lift_above;
    seen->offered = node->pending.exists ? node->pending.number : 0;
    if (!node->session.exists) return;
    seen->heard_ms = node->session.heard_ms;
    seen->counter = node->session.counter;
    seen->number = node->session.number;
    seen->release = node->session.release;
    seen->hold_gen = node->session.hold_gen;
    seen->closed = node->session.closed;
    seen->owns_run = node->session.owns_run;
    seen->order = node->session.order;
}

/* Run one sequence: a twin_short after each event, a twin_full after the last. Returns the bytes written. */
size_t twin_replay(const twin_start *start, const twin_event *events, uint8_t *seen);
size_t twin_replay(const twin_start *start, const twin_event *events, uint8_t *seen) {
    twin it;
    uint8_t *to = seen;
    twin_begin(&it, start);
    for (unsigned i = 0; i < start->events; i++) {
        twin before = it;
        twin_do(&it, &events[i]);
        twin_note(&before, &it, &events[i]);
        twin_look(&it, events[i].now_ms, (twin_short *)(void *)to);
        to += sizeof(twin_short);
    }
    twin_look_closely(&it, (twin_full *)(void *)to);
    return (size_t)(to - seen) + sizeof(twin_full);
}

/* Make and run sequences `first` to `first + count - 1`; returns the bytes written to `seen`. */
size_t twin_batch(uint64_t first, unsigned count, twin_start *starts, twin_event *events, uint8_t *seen);
size_t twin_batch(uint64_t first, unsigned count, twin_start *starts, twin_event *events, uint8_t *seen) {
    uint8_t *to = seen;
    for (unsigned i = 0; i < count; i++) {
        twin_generate(first + i, &starts[i], events);
        to += twin_replay(&starts[i], events, to);
        events += starts[i].events;
    }
    return (size_t)(to - seen);
}

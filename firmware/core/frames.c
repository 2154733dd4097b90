#include "frames.h"

#include <string.h>

#include "bytes.h"

enum { ESTOP_FIELDS_END = 8, HOME_FIELDS_END = 10, SERVICE_FIELDS_END = 20, PIECE = 10, NO_NONCE = 0 };
enum { PAGE_BITS = 15, FLAG_UNHOMED = 16, FLAG_AT_ONCE = 32, FLAGS_END = 64, FACTS = 12 };

static uint8_t head(uint8_t kind) { return (uint8_t)(CL_VERSION << 4 | kind); }

uint8_t cl_kind_of(const uint8_t *payload, size_t length) {
    if (length != CL_FRAME_BYTES || payload[0] >> 4 != CL_VERSION) return 0;
    uint8_t kind = payload[0] & 0xF;
    return kind <= CL_KIND_SETTINGS ? kind : 0;
}

int64_t cl_clock_of(int64_t now_ms) { return now_ms >> CL_CLOCK_SHIFT; }

/* The last tick not after `now` whose low bits a payload carries; below 0 if there has been none yet. */
static int64_t latest_clock(const uint8_t *payload, int64_t now) {
    return now - ((now - payload[1]) & ((1 << CL_DRIVE_CLOCK_BITS) - 1));
}

uint16_t cl_session_of(const uint8_t payload[CL_FRAME_BYTES]) { return cl_get16(payload + 2); }

/* Whether the tag is right; every byte is compared, so that time does not tell a forger how far he got. */
static cl_verdict verify(const uint8_t *payload, uint8_t kind, const cl_keyed *key, uint64_t nonce) {
    if (payload[0] != head(kind)) return CL_REJECT_KIND;
    uint8_t tag[CL_TAG_BYTES], wrong = 0;
    cl_tag(key, payload, nonce, CL_FROM_HOST, tag);
    for (unsigned i = 0; i < CL_TAG_BYTES; i++) wrong |= (uint8_t)(tag[i] ^ payload[CL_BODY_BYTES + i]);
    return wrong ? CL_REJECT_TAG : CL_GOOD;
}

static bool zero_from(const uint8_t *payload, unsigned first) {
    uint8_t any = 0;
    for (unsigned i = first; i < CL_BODY_BYTES; i++) any |= payload[i];
    return any == 0;
}

static int32_t get24(const uint8_t *from) {
    int32_t value = from[0] | from[1] << 8 | from[2] << 16;
    return from[2] & 0x80 ? value - 0x1000000 : value;
}

cl_verdict cl_decode_drive(const uint8_t *payload, const cl_keyed *key, int64_t now, cl_drive_frame *frame) {
    int64_t clock = latest_clock(payload, now);
    cl_verdict verdict = verify(payload, CL_KIND_DRIVE, key, (uint64_t)clock);
    if (verdict != CL_GOOD) return verdict;
    cl_counts target;
    for (unsigned axis = 0; axis < CL_AXES; axis++) {
        target.at[axis] = get24(payload + 12 + 3 * axis);
        if (target.at[axis] < -CL_TARGET_LIMIT) return CL_REJECT_FIELD;
    }
    *frame = (cl_drive_frame){
        .clock = clock,
        .counter = cl_get32(payload + 4),
        .release = cl_get16(payload + 8),
        .load_step = cl_get16(payload + 10),
        .target = target,
        .move_ms = cl_get16(payload + 21),
        .hold_gen = payload[23],
    };
    return CL_GOOD;
}

cl_verdict cl_decode_home(const uint8_t *payload, const cl_keyed *key, int64_t now, cl_home_frame *frame) {
    int64_t clock = latest_clock(payload, now);
    cl_verdict verdict = verify(payload, CL_KIND_HOME, key, (uint64_t)clock);
    if (verdict != CL_GOOD) return verdict;
    uint8_t axes = payload[8];
    if (axes == 0 || axes > CL_ALL_AXES || !zero_from(payload, HOME_FIELDS_END)) return CL_REJECT_FIELD;
    *frame = (cl_home_frame){.clock = clock, .counter = cl_get32(payload + 4), .axes = axes, .order = payload[9]};
    return CL_GOOD;
}

/* Whether the fields of a SERVICE mean something. */
static bool makes_sense(const uint8_t *payload, const cl_service_frame *frame) {
    bool known = frame->operation <= CL_OPERATION_PLACE && frame->page <= CL_PAGE_SETTINGS && payload[11] < FLAGS_END;
    bool has_axis = frame->axis <= CL_AXES && (frame->axis != 0 || frame->operation < CL_OPERATION_JOG);
    bool fits = frame->amount >= -CL_TARGET_LIMIT && frame->amount <= CL_TARGET_LIMIT;
    return known && has_axis && fits && zero_from(payload, SERVICE_FIELDS_END);
}

cl_verdict cl_decode_service(const uint8_t *payload, const cl_keyed *key, int64_t now, cl_service_frame *frame) {
    int64_t clock = latest_clock(payload, now);
    cl_verdict verdict = verify(payload, CL_KIND_SERVICE, key, (uint64_t)clock);
    if (verdict != CL_GOOD) return verdict;
    cl_service_frame found = {
        .clock = clock,
        .counter = cl_get32(payload + 4),
        .operation = payload[8],
        .order = payload[9],
        .axis = payload[10],
        .page = payload[11] & PAGE_BITS,
        .unhomed = (payload[11] & FLAG_UNHOMED) != 0,
        .at_once = (payload[11] & FLAG_AT_ONCE) != 0,
        .amount = (int32_t)cl_get32(payload + 12),
        .rate = cl_get16(payload + 16),
        .span = cl_get16(payload + 18),
    };
    if (!makes_sense(payload, &found)) return CL_REJECT_FIELD;
    *frame = found;
    return CL_GOOD;
}

cl_verdict cl_decode_settings(
    const uint8_t *payload, const cl_keyed *key, const cl_key *secret, int64_t now, cl_settings_frame *frame
) {
    int64_t clock = latest_clock(payload, now);
    cl_verdict verdict = verify(payload, CL_KIND_SETTINGS, key, (uint64_t)clock);
    if (verdict != CL_GOOD) return verdict;
    uint8_t operation = payload[8], index = payload[9], stream[CL_KEY_BYTES];
    bool fits = operation == CL_SETTINGS_PIECE ? index < CL_PIECES : zero_from(payload, PIECE);
    if (operation > CL_SETTINGS_LOADER || !fits) return CL_REJECT_FIELD;
    *frame = (cl_settings_frame){
        .clock = clock, .counter = cl_get32(payload + 4), .operation = operation, .index = index,
    };
    cl_settings_stream(stream, secret, frame->counter);
    for (unsigned i = 0; i < CL_PIECE_BYTES; i++) frame->piece[i] = payload[PIECE + i] ^ stream[i];
    return CL_GOOD;
}

cl_verdict cl_decode_estop(const uint8_t *payload, const cl_keyed *key, cl_estop_frame *frame) {
    cl_verdict verdict = verify(payload, CL_KIND_ESTOP, key, NO_NONCE);
    if (verdict != CL_GOOD) return verdict;
    if (!zero_from(payload, ESTOP_FIELDS_END)) return CL_REJECT_FIELD;
    *frame = (cl_estop_frame){.node = payload[1], .counter = cl_get32(payload + 4)};
    return CL_GOOD;
}

cl_verdict cl_decode_hello(const uint8_t *payload, const cl_keyed *key, cl_hello_frame *frame) {
    cl_verdict verdict = verify(payload, CL_KIND_HELLO, key, NO_NONCE);
    if (verdict != CL_GOOD) return verdict;
    *frame = (cl_hello_frame){
        .node = payload[1],
        .nonce = cl_get64(payload + 4),
        .run_tag = cl_get64(payload + 12),
        .deadman_ms = (uint16_t)(payload[22] * CL_DEADMAN_UNIT_MS),
        .flags = payload[23],
    };
    return CL_GOOD;
}

cl_verdict cl_decode_ask(const uint8_t *payload, const cl_keyed *key, cl_ask_frame *frame) {
    cl_verdict verdict = verify(payload, CL_KIND_PAGE, key, NO_NONCE);
    if (verdict != CL_GOOD) return verdict;
    if (payload[3] != 0 || !zero_from(payload, 12)) return CL_REJECT_FIELD;
    *frame = (cl_ask_frame){.node = payload[1], .page = payload[2], .nonce = cl_get64(payload + 4)};
    return CL_GOOD;
}

cl_verdict cl_decode_stop(const uint8_t *payload, const cl_keyed *key) {
    cl_verdict verdict = verify(payload, CL_KIND_STOP, key, NO_NONCE);
    if (verdict != CL_GOOD) return verdict;
    return payload[1] == CL_EVERY_NODE && zero_from(payload, 3) ? CL_GOOD : CL_REJECT_FIELD;
}

/* Nearest number of position units, saturated: a position that far out is reported as the end of the scale. */
static uint16_t position_units(int32_t counts) {
    const int32_t most = CL_POSITION_LIMIT / CL_POSITION_UNIT;
    if (counts > CL_POSITION_LIMIT) return (uint16_t)most;
    if (counts < -CL_POSITION_LIMIT) return (uint16_t)-most;
    /* Lifted above zero first, because division rounds towards it. */
    int32_t units = (counts + CL_POSITION_LIMIT + CL_POSITION_UNIT / 2) / CL_POSITION_UNIT - most;
    return (uint16_t)units;
}

static void seal(uint8_t *payload, const cl_keyed *key, uint64_t nonce) {
    cl_tag(key, payload, nonce, CL_FROM_NODE, payload + CL_BODY_BYTES);
}

/* The steps, what the node is doing, and where its axes are: `steps` and `mode` are where a kind of frame has them. */
static void put_condition(uint8_t *steps, uint8_t *mode, const cl_condition *now) {
    cl_put16(steps, now->finished);
    cl_put16(steps + 2, now->started);
    cl_put16(steps + 4, now->staged);
    mode[0] = (uint8_t)(now->state << 4 | now->hold_low);
    mode[1] = (uint8_t)(now->fault_axis << 4 | now->fault);
    for (unsigned axis = 0; axis < CL_AXES; axis++) {
        cl_put16(mode + 2 + 2 * axis, position_units(now->position.at[axis]));
    }
}

void cl_encode_status(uint8_t *payload, const cl_status_frame *frame, const cl_keyed *key) {
    payload[0] = head(CL_KIND_STATUS);
    payload[1] = frame->node;
    cl_put16(payload + 2, frame->session);
    cl_put32(payload + 4, frame->echo);
    cl_put16(payload + 8, (uint16_t)frame->clock);
    put_condition(payload + 10, payload + 16, &frame->now);
    seal(payload, key, (uint64_t)frame->clock);
}

void cl_encode_report(uint8_t *payload, const cl_report_frame *frame, const cl_keyed *key, uint64_t nonce) {
    payload[0] = head(CL_KIND_REPORT);
    payload[1] = frame->node;
    cl_put32(payload + 2, frame->boot | (uint32_t)frame->cause << 24);
    put_condition(payload + 6, payload + 12, &frame->now);
    payload[20] = (uint8_t)(frame->axes.of[0] | frame->axes.of[1] << 4);
    payload[21] = (uint8_t)(frame->axes.of[2] | frame->stopped << 4 | frame->turning << 5 | frame->on_trial << 6);
    cl_put16(payload + 22, frame->fault_s);
    seal(payload, key, nonce);
}

void cl_encode_ident(uint8_t *payload, const cl_ident_frame *frame, const cl_keyed *key, uint64_t nonce) {
    payload[0] = head(CL_KIND_IDENT);
    payload[1] = frame->node;
    cl_put16(payload + 2, frame->session);
    cl_put32(payload + 4, frame->nonce.offers);
    cl_put32(payload + 8, frame->nonce.boot);
    cl_put32(payload + 12, frame->nonce.noise);
    cl_put32(payload + 16, (uint32_t)frame->clock);
    cl_put16(payload + 20, frame->config_hash);
    payload[22] = CL_VERSION;
    payload[23] = (uint8_t)(
        frame->state << 4 | frame->on_trial << 3 | frame->stopped << 2 | frame->busy << 1 | frame->same_run
    );
    seal(payload, key, nonce);
}

void cl_encode_page(uint8_t *payload, const cl_page_frame *frame, const cl_keyed *key, uint64_t nonce) {
    memset(payload, 0, CL_BODY_BYTES);
    payload[0] = head(CL_KIND_PAGE);
    payload[1] = frame->node;
    payload[2] = CL_WHO;
    cl_put32(payload + 4, frame->chip);
    cl_put32(payload + 8, frame->firmware);
    cl_put32(payload + 12, frame->boot);
    cl_put16(payload + 16, frame->config_hash);
    payload[18] = frame->state;
    payload[19] = CL_VERSION;
    cl_put16(payload + 20, frame->bad_tags);
    cl_put16(payload + 22, frame->old_frames);
    seal(payload, key, nonce);
}

/* Saturated at the ends of 24 bits. */
static void put24(uint8_t *to, int32_t value) {
    if (value > CL_TARGET_LIMIT) value = CL_TARGET_LIMIT;
    if (value < -CL_TARGET_LIMIT) value = -CL_TARGET_LIMIT;
    to[0] = (uint8_t)value;
    to[1] = (uint8_t)((uint32_t)value >> 8);
    to[2] = (uint8_t)((uint32_t)value >> 16);
}

void cl_put_motor_facts(uint8_t *payload, const cl_motor_facts *facts) {
    for (unsigned axis = 0; axis < CL_AXES; axis++) put24(payload + FACTS + 3 * axis, facts->counts.at[axis]);
    payload[21] = facts->lines;
    cl_put16(payload + 22, facts->supply_mv);
}

void cl_put_axis_facts(uint8_t *payload, const cl_axis_facts *facts) {
    payload[12] = facts->axis;
    cl_put16(payload + 13, facts->missed);
    cl_put16(payload + 15, (uint16_t)facts->duty);
    cl_put16(payload + 17, facts->lag);
    cl_put16(payload + 19, facts->threshold);
    payload[21] = facts->samples;
    cl_put16(payload + 22, facts->step);
}

void cl_put_limit_facts(uint8_t *payload, const int32_t limits[4]) {
    for (unsigned number = 0; number < 4; number++) put24(payload + FACTS + 3 * number, limits[number]);
}

void cl_put_settings_facts(uint8_t *payload, const cl_settings_facts *facts) {
    memset(payload + FACTS, 0, CL_BODY_BYTES - FACTS);
    payload[12] = facts->pieces;
    payload[13] = facts->on_trial;
    cl_put16(payload + 14, facts->generation);
    payload[16] = facts->left_s;
    cl_put16(payload + 17, facts->stored);
}

void cl_put_samples(uint8_t *payload, const int16_t samples[CL_READING_SAMPLES]) {
    for (unsigned number = 0; number < CL_READING_SAMPLES; number++) {
        cl_put16(payload + FACTS + 2 * number, (uint16_t)samples[number]);
    }
}

void cl_encode_reading(uint8_t *payload, const cl_reading_frame *frame, const cl_keyed *key) {
    payload[0] = head(CL_KIND_READING);
    payload[1] = frame->node;
    cl_put16(payload + 2, frame->session);
    cl_put32(payload + 4, frame->echo);
    cl_put16(payload + 8, (uint16_t)frame->clock);
    payload[10] = (uint8_t)(frame->outcome << 4 | frame->page);
    payload[11] = frame->index;
    seal(payload, key, (uint64_t)frame->clock);
}

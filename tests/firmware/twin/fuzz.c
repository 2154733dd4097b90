/* Feeds a node damaged frames, to be run under the checkers for addresses and undefined behaviour.
   fuzz SEED EXECUTIONS CORPUS: an execution is one payload received; the corpus is a file of whole frames.
   Most frames are signed again after they were damaged: tags are good at keeping a fuzzer out. */
#include <inttypes.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "bytes.h"
#include "twin.h"

enum { CORPUS_FRAMES = 512, LONGEST = 64, PAYLOADS_PER_LIFE = 64 };

typedef struct {
    uint64_t random;
    uint8_t corpus[CORPUS_FRAMES][CL_FRAME_BYTES];
    size_t corpus_frames;
    uint64_t accepted;
    uint64_t states;
} fuzzer;

typedef struct {
    fuzzer *fuzz;
    int64_t settles_ms;
} wild_plant;

static uint64_t draw(fuzzer *fuzz) {
    fuzz->random ^= fuzz->random << 13;
    fuzz->random ^= fuzz->random >> 7;
    fuzz->random ^= fuzz->random << 17;
    return fuzz->random;
}

static uint32_t below(fuzzer *fuzz, uint32_t end) { return (uint32_t)((draw(fuzz) >> 32) * end >> 32); }

/* A plant that says anything, but lets every move last a while. */
static void follow(void *self, int64_t now_ms, int64_t start_ms, const cl_move *move) {
    wild_plant *plant = self;
    cl_counts counts;
    cl_move_at(move, now_ms - start_ms, &counts);
    plant->settles_ms = now_ms + 1 + below(plant->fuzz, 200);
}

static void positions(void *self, int64_t now_ms, cl_counts *counts) {
    fuzzer *fuzz = ((wild_plant *)self)->fuzz;
    uint32_t size = 1 + below(fuzz, 31);
    (void)now_ms;
    for (unsigned axis = 0; axis < CL_AXES; axis++) {
        counts->at[axis] = (int32_t)(uint32_t)draw(fuzz) >> size;
    }
}

static bool settles(void *self, int64_t *at_ms) {
    const wild_plant *plant = self;
    *at_ms = plant->settles_ms;
    return true;
}

static bool fault(void *self, cl_plant_fault *fault) {
    wild_plant *plant = self;
    *fault = (cl_plant_fault){plant->settles_ms - 5, (uint8_t)(3 + below(plant->fuzz, 5)), (uint8_t)below(plant->fuzz, 4)};
    return below(plant->fuzz, 50) == 0;
}

static void seek(void *self, int64_t now_ms, uint8_t axes) {
    wild_plant *plant = self;
    (void)axes;
    plant->settles_ms = now_ms + 1 + below(plant->fuzz, 200);
}

static bool sought(void *self, cl_sought *sought) {
    wild_plant *plant = self;
    sought->at_ms = plant->settles_ms;
    for (unsigned axis = 0; axis < CL_AXES; axis++) {
        sought->reasons.of[axis] = (uint8_t)(below(plant->fuzz, 4) ? 0 : below(plant->fuzz, CL_NOT_HOMED + 1));
    }
    return below(plant->fuzz, 2) == 0;
}

static void give_up(void *self, int64_t now_ms) { ((wild_plant *)self)->settles_ms = now_ms; }

/* Bytes of a frame, damaged in one of the ways that radios, buses and strangers know. */
static size_t damaged(fuzzer *fuzz, uint8_t *payload) {
    static const uint8_t edges[8] = {0, 1, 0x7F, 0x80, 0xFE, 0xFF, 0x10, 2};
    size_t length = CL_FRAME_BYTES;
    for (uint32_t times = below(fuzz, 4); times > 0; times--) {
        uint32_t at = below(fuzz, CL_FRAME_BYTES), kind = below(fuzz, 16);
        if (kind < 6) payload[at] ^= (uint8_t)(1 << below(fuzz, 8));
        if (kind >= 6 && kind < 10) payload[at] = edges[below(fuzz, 8)];
        if (kind >= 10 && kind < 13) payload[at] = (uint8_t)draw(fuzz);
        if (kind == 13) memcpy(payload + at, fuzz->corpus[below(fuzz, (uint32_t)fuzz->corpus_frames)], CL_FRAME_BYTES - at);
        if (kind == 14) memset(payload + at, edges[below(fuzz, 8)], CL_FRAME_BYTES - at);
        if (kind == 15) length = below(fuzz, LONGEST + 1);
    }
    return length;
}

/* Make a damaged frame one that the node has to take seriously. */
static void endorse(fuzzer *fuzz, const cl_node *node, int64_t now_ms, uint8_t *payload) {
    const cl_session *session = node->pending.exists && below(fuzz, 4) == 0 ? &node->pending : &node->session;
    const cl_keyed *key = &node->node_key;
    uint8_t kind = payload[0] & 0xF;
    uint64_t clock = 0;
    bool timed = kind == CL_KIND_DRIVE || kind == CL_KIND_HOME || kind == CL_KIND_SERVICE || kind == CL_KIND_SETTINGS;
    if (below(fuzz, 8) > 0) payload[0] = (uint8_t)(CL_VERSION << 4 | kind);
    if (timed || kind == CL_KIND_ESTOP) {
        key = &session->key;
        cl_put16(payload + 2, session->number);
        if (below(fuzz, 4) > 0) cl_put32(payload + 4, session->counter + 1);
        if (kind == CL_KIND_DRIVE && below(fuzz, 2)) cl_put16(payload + 10, (uint16_t)(node->memory.started + 1));
        if (kind == CL_KIND_ESTOP && below(fuzz, 2)) memset(payload + 8, 0, CL_BODY_BYTES - 8);
    }
    if (timed) {
        clock = (uint64_t)cl_clock_of(now_ms) - (below(fuzz, 8) ? below(fuzz, 4) : below(fuzz, 300));
        payload[1] = (uint8_t)clock;
    } else if (kind != CL_KIND_STOP && below(fuzz, 8) > 0) payload[1] = node->number;
    if (kind == CL_KIND_STOP) key = &node->stop_key;
    if (kind == CL_KIND_PAGE) key = &node->open_key;
    cl_tag(key, payload, clock, CL_FROM_HOST, payload + CL_BODY_BYTES);
}

static void turn(void *self, int64_t now_ms, const cl_turn *wanted) {
    if (wanted->axis == 0 || wanted->axis > CL_AXES || wanted->span_ms == 0) exit(6);
    (void)self;
    (void)now_ms;
}

static bool turned(void *self, int64_t *at_ms) {
    wild_plant *plant = self;
    *at_ms = (int64_t)below(plant->fuzz, 100000);
    return below(plant->fuzz, 2);
}

static void place(void *self, int64_t now_ms, uint8_t axis, int32_t counts) {
    if (axis == 0 || axis > CL_AXES) exit(7);
    (void)self;
    (void)now_ms;
    (void)counts;
}

static void look(void *self, int64_t now_ms, uint8_t axis, uint8_t first, cl_look *seen) {
    wild_plant *plant = self;
    if (axis == 0 || axis > CL_AXES) exit(8);
    (void)now_ms;
    for (unsigned byte = 0; byte < sizeof *seen; byte++) ((uint8_t *)seen)[byte] = (uint8_t)(draw(plant->fuzz) + first);
}

static uint8_t store(void *self, const uint8_t *record) {
    uint8_t any = 0;
    for (unsigned at = 0; at < CL_SETTINGS_BYTES; at++) any |= record[at];
    return (uint8_t)(CL_OUTCOME_DONE + below(((wild_plant *)self)->fuzz, 3) + (any & 1));
}

static uint8_t outcome(void *self) { return (uint8_t)(CL_OUTCOME_DONE + 2 * below(((wild_plant *)self)->fuzz, 2)); }

static void drop(void *self) { (void)self; }

static void standing(void *self, cl_standing *now) {
    fuzzer *fuzz = ((wild_plant *)self)->fuzz;
    *now = (cl_standing){below(fuzz, 2), (uint16_t)draw(fuzz), (uint16_t)draw(fuzz)};
}

/* One payload, in memory of just its length, so that a step beyond its end is seen. */
static void execute(fuzzer *fuzz, cl_node *node, int64_t now_ms) {
    uint8_t frame[LONGEST] = {0};
    memcpy(frame, fuzz->corpus[below(fuzz, (uint32_t)fuzz->corpus_frames)], CL_FRAME_BYTES);
    size_t length = damaged(fuzz, frame);
    if (below(fuzz, 16) > 0) endorse(fuzz, node, now_ms, frame);
    uint8_t *payload = malloc(length + 1);
    if (payload == NULL) exit(3);
    memcpy(payload + 1, frame, length);
    uint32_t serial = node->ack_serial;
    cl_node_receive(node, now_ms, payload + 1, length);
    free(payload);
    fuzz->accepted += node->ack_serial != serial;
    fuzz->states |= (uint64_t)1 << cl_node_state(node);
    if (node->ack_length != 0 && node->ack_length != CL_FRAME_BYTES) exit(4);
    if (cl_node_state(node) > CL_STATE_ESTOP) exit(5);
}

/* A node from a random start, fed for a while. */
static void live(fuzzer *fuzz, uint64_t executions) {
    twin_start start;
    twin_event events[TWIN_MOST_EVENTS];
    twin it;
    wild_plant plant = {fuzz, 0};
    twin_generate(draw(fuzz), &start, events);
    start.estop = 0;
    twin_begin(&it, &start);
    it.node.plant = (cl_plant){&plant, follow, positions, settles, fault, seek, sought, give_up,
                                turn, turned, place, look, store, outcome, outcome, drop, standing, 0};
    int64_t now_ms = start.now_ms;
    while (executions-- > 0 && !it.node.leaves) {
        now_ms += below(fuzz, 3) ? 0 : below(fuzz, 120);
        uint32_t kind = below(fuzz, 64);
        if (kind == 0) cl_node_notice(&it.node, now_ms);
        if (kind == 1) cl_node_start_homing(&it.node, now_ms, (uint8_t)(1 + below(fuzz, CL_ALL_AXES)));
        if (kind == 2) cl_node_stop_homing(&it.node, now_ms);
        execute(fuzz, &it.node, now_ms);
    }
}

int main(int count, char **arguments) {
    static fuzzer fuzz;
    if (count != 4) return 2;
    FILE *corpus = fopen(arguments[3], "rb");
    if (corpus == NULL) return 2;
    fuzz.corpus_frames = fread(fuzz.corpus, CL_FRAME_BYTES, CORPUS_FRAMES, corpus);
    fclose(corpus);
    if (fuzz.corpus_frames == 0) return 2;
    fuzz.random = strtoull(arguments[1], NULL, 10) | 1;
    uint64_t executions = strtoull(arguments[2], NULL, 10);
    for (uint64_t done = 0; done < executions; done += PAYLOADS_PER_LIFE) live(&fuzz, PAYLOADS_PER_LIFE);
    printf("%" PRIu64 " %" PRIx64 "\n", fuzz.accepted, fuzz.states);
    return 0;
}

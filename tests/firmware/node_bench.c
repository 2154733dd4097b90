/* A node of the C core on a plant that follows exactly, for tests that need it for longer than the image can be run. */
#include <stdlib.h>
#include <string.h>

#include "node.h"

typedef struct {
    cl_node node;
    cl_move move;
    int64_t start_ms;
    bool following;
} bench;

bench *bench_new(const uint8_t master[CL_KEY_BYTES], uint32_t chip, uint32_t boot, uint32_t noise);
void bench_free(bench *b);
void bench_receive(bench *b, int64_t now_ms, const uint8_t *payload, size_t length);
size_t bench_answer(const bench *b, uint8_t answer[CL_FRAME_BYTES]);
bool bench_moves(const bench *b);
uint32_t bench_bad_tags(const bench *b);

static void follow(void *self, int64_t now_ms, int64_t start_ms, const cl_move *move) {
    bench *b = self;
    (void)now_ms;
    b->move = *move;
    b->start_ms = start_ms;
    b->following = true;
}

static void positions(void *self, int64_t now_ms, cl_counts *counts) {
    const bench *b = self;
    memset(counts, 0, sizeof *counts);
    if (b->following) cl_move_at(&b->move, now_ms - b->start_ms, counts);
}

static bool settles(void *self, int64_t *at_ms) {
    const bench *b = self;
    *at_ms = b->start_ms + cl_move_end_ms(&b->move);
    return b->following;
}

static bool fault(void *self, cl_plant_fault *found) {
    (void)self;
    (void)found;
    return false;
}

static void seek(void *self, int64_t now_ms, uint8_t axes) {
    (void)self;
    (void)now_ms;
    (void)axes;
}

static bool sought(void *self, cl_sought *found) {
    (void)self;
    (void)found;
    return false;
}

static void give_up(void *self, int64_t now_ms) {
    (void)self;
    (void)now_ms;
}

static void standing(void *self, cl_standing *now) {
    (void)self;
    *now = (cl_standing){.on_trial = false};
}

bench *bench_new(const uint8_t master[CL_KEY_BYTES], uint32_t chip, uint32_t boot, uint32_t noise) {
    static const cl_axis_limits axes[CL_AXES] = {
        {-200000, 200000, 4426, 22132}, {-5215, 5215, 3128, 13906}, {-48691, 48691, 2213, 11066},
    };
    bench *b = calloc(1, sizeof *b);
    if (b == NULL) abort();
    cl_identity identity = {.number = 1, .chip = chip, .firmware = 2};
    cl_memory memory = {.nonce = {.boot = boot, .noise = noise}, .cause = CL_CAUSE_POWER_ON};
    memcpy(identity.master.bytes, master, CL_KEY_BYTES);
    cl_plant plant = {.self = b, .follow = follow, .positions = positions, .settles = settles, .fault = fault,
                      .seek = seek, .sought = sought, .give_up = give_up, .standing = standing};
    cl_node_init(&b->node, &identity, axes, plant, &memory);
    return b;
}

void bench_free(bench *b) { free(b); }

void bench_receive(bench *b, int64_t now_ms, const uint8_t *payload, size_t length) {
    cl_node_receive(&b->node, now_ms, payload, length);
}

size_t bench_answer(const bench *b, uint8_t answer[CL_FRAME_BYTES]) {
    memcpy(answer, b->node.ack, CL_FRAME_BYTES);
    return b->node.ack_length;
}

bool bench_moves(const bench *b) { return b->node.moving; }

uint32_t bench_bad_tags(const bench *b) { return b->node.tally.bad_tags; }

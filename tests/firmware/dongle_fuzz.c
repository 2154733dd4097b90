/* Feeds the dongle's core rubbish, damaged packets and whole ones from a seeded source, and watches what it says.
 *
 * Whatever comes in: what it emits is whole packets with good checksums; a request takes no more steps than it has
 * frames or channels; and a HELLO after a zero is answered, once. Arguments: seed, rounds. */
#include "dongle.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#define LARGEST 2000u
#define LONGEST_REQUEST 640u

static uint64_t state;
static unsigned idents, steps_limit;
static unsigned long packets, transmissions, refusals;
static bool takes;

static uint32_t chance(uint32_t below) { /* xorshift64* */
    state ^= state >> 12;
    state ^= state << 25;
    state ^= state >> 27;
    return (uint32_t)((state * 0x2545F4914F6CDD1Du) >> 32) % below;
}

static void insist(bool holds, const char *what) {
    if (!holds) {
        fprintf(stderr, "broken: %s\n", what);
        abort();
    }
}

/* An independent decoder of what the core says. */
static void check_said(const uint8_t *packet, size_t length) {
    uint8_t body[256];
    size_t filled = 0;
    insist(length >= 8 && length <= 48 && packet[length - 1] == 0, "an answer is one packet");
    for (size_t at = 0; at < length - 1;) {
        size_t run = packet[at];
        insist(run != 0 && at + run <= length - 1, "its stuffing is right");
        for (size_t index = 1; index < run; index++) {
            insist(packet[at + index] != 0, "it holds no zero");
            body[filled++] = packet[at + index];
        }
        at += run;
        if (at < length - 1)
            body[filled++] = 0;
    }
    uint32_t checksum = cl_dongle_crc(body, filled - 4);
    for (size_t index = 0; index < 4; index++)
        insist(body[filled - 4 + index] == (uint8_t)(checksum >> 8 * index), "its checksum is right");
    idents += body[0] == CL_DONGLE_IDENT;
    refusals += body[0] == CL_DONGLE_REFUSED;
}

static bool emit(void *self, const uint8_t *bytes, size_t length) {
    (void)self;
    check_said(bytes, length);
    return takes;
}

static bool configure(void *self, const cl_dongle_settings *settings) {
    (void)self;
    insist(settings->channel < 126 && settings->rate < 3 && settings->width >= 3 && settings->width <= 5,
           "settings are within range");
    return chance(20) != 0;
}

static cl_dongle_outcome transmit(void *self, const uint8_t *address, const uint8_t *payload, cl_dongle_reply *reply) {
    (void)self;
    transmissions++;
    for (unsigned index = 0; index < CL_DONGLE_PAYLOAD; index++)
        reply->payload[index] = (uint8_t)(payload[index] ^ address[index % CL_DONGLE_ADDRESS]);
    reply->length = (uint8_t)chance(256);
    reply->retries = (uint8_t)chance(256);
    return (cl_dongle_outcome)chance(3);
}

static bool carrier(void *self, uint8_t channel) {
    (void)self;
    insist(channel < CL_DONGLE_CHANNELS, "the channel is one");
    return chance(2) != 0;
}

static size_t stuff(const uint8_t *body, size_t length, uint8_t *packet) {
    size_t code = 0, end = 1;
    for (size_t index = 0; index < length; index++) {
        if (body[index] != 0)
            packet[end++] = body[index];
        if (body[index] == 0 || end - code == 255) {
            packet[code] = (uint8_t)(end - code);
            code = end++;
        }
    }
    packet[code] = (uint8_t)(end - code);
    packet[end++] = 0;
    return end;
}

/* A request with a good checksum; every other one is well formed. */
static size_t request(uint8_t *packet) {
    static const uint8_t lengths[5] = {0, 4, 8, 0, 2};
    uint8_t body[LONGEST_REQUEST + 4];
    uint8_t kind = (uint8_t)chance(6);
    size_t count = 1 + chance(16);
    size_t length = kind == CL_DONGLE_SCHEDULE ? 3 + 37 * count : kind < 5 ? lengths[kind] : 2;
    if (chance(2) == 0)
        length = 2 + chance(LONGEST_REQUEST - 2);
    for (size_t index = 0; index < length; index++)
        body[index] = (uint8_t)(chance(3) == 0 ? 0 : chance(256));
    body[0] = kind;
    if (kind == CL_DONGLE_SCHEDULE && length > 2)
        body[2] = (uint8_t)count;
    if (kind == CL_DONGLE_CONFIGURE && length == 8 && chance(2) == 0)
        memcpy(body + 2, (uint8_t[]){76, 1, 5, 3, 0xF4, 1}, 6);
    length = length < 2 ? 2 : length;
    uint32_t checksum = cl_dongle_crc(body, length);
    for (size_t index = 0; index < 4; index++)
        body[length++] = (uint8_t)(checksum >> 8 * index);
    packets++;
    return stuff(body, length, packet);
}

static size_t something(uint8_t *bytes) {
    size_t length;
    if (chance(4) == 0) {
        length = chance(LARGEST);
        for (size_t index = 0; index < length; index++)
            bytes[index] = (uint8_t)chance(256);
        return length;
    }
    length = request(bytes);
    if (chance(3) == 0) /* damaged on the way */
        bytes[chance((uint32_t)length)] ^= (uint8_t)(1u << chance(8));
    if (chance(8) == 0)
        length = chance((uint32_t)length + 1);
    return length;
}

static void feed(cl_dongle *dongle, const uint8_t *bytes, size_t length) {
    while (length > 0) { /* each piece in memory of its own, so that reading beyond it is noticed */
        size_t piece = 1 + chance(chance(4) == 0 ? (uint32_t)length : 64);
        piece = piece < length ? piece : length;
        uint8_t *copy = malloc(piece);
        memcpy(copy, bytes, piece);
        cl_dongle_feed(dongle, copy, piece);
        free(copy);
        bytes += piece;
        length -= piece;
    }
}

static void work(cl_dongle *dongle) {
    static uint32_t now_ms = 0xFFFF0000u;
    unsigned steps = 0;
    while (cl_dongle_step(dongle, now_ms)) {
        insist(++steps <= steps_limit, "a request ends");
        now_ms += chance(3);
        if (chance(50) == 0)
            return; /* the next request comes early */
    }
}

int main(int count, char **arguments) {
    static const uint8_t unique[CL_DONGLE_UNIQUE] = {1, 2, 3};
    static const uint8_t hello[4] = {CL_DONGLE_HELLO, 5, 1, 1};
    static uint8_t bytes[LARGEST + LONGEST_REQUEST + 64];
    const cl_dongle_radio radio = {NULL, configure, transmit, carrier};
    const cl_dongle_line line = {NULL, emit};
    if (count != 3)
        return 2;
    state = strtoull(arguments[1], NULL, 10) * 0x9E3779B97F4A7C15u + 1;
    unsigned long rounds = strtoul(arguments[2], NULL, 10);
    steps_limit = CL_DONGLE_CHANNELS;
    cl_dongle *dongle = malloc(sizeof *dongle); /* so that writing beyond it is noticed */
    cl_dongle_init(dongle, &radio, &line, unique);
    for (unsigned long round = 0; round < rounds; round++) {
        takes = chance(10) != 0;
        feed(dongle, bytes, something(bytes));
        work(dongle);
        if (chance(40) == 0)
            cl_dongle_abandon(dongle);
        if (chance(5) == 0) {
            uint8_t packet[16], whole[8];
            memcpy(whole, hello, sizeof hello);
            uint32_t checksum = cl_dongle_crc(hello, sizeof hello);
            for (size_t index = 0; index < 4; index++)
                whole[sizeof hello + index] = (uint8_t)(checksum >> 8 * index);
            feed(dongle, (const uint8_t[]){0}, 1);
            idents = 0;
            feed(dongle, packet, stuff(whole, sizeof whole, packet));
            insist(idents == 1, "it says who it is");
        }
    }
    printf("%lu rounds, %lu packets, %lu transmissions, %lu refusals\n", rounds, packets, transmissions, refusals);
    free(dongle);
    return 0;
}

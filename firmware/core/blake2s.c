#include "blake2s.h"

#include <stdbool.h>

#include "bytes.h"

enum { ROUNDS = 10, WORDS = 16 };

static const uint32_t start_words[8] = {
    0x6A09E667, 0xBB67AE85, 0x3C6EF372, 0xA54FF53A, 0x510E527F, 0x9B05688C, 0x1F83D9AB, 0x5BE0CD19,
};

/* Order in which each round takes the words of a block. */
static const uint8_t schedule[ROUNDS][WORDS] = {
    {0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15}, {14, 10, 4, 8, 9, 15, 13, 6, 1, 12, 0, 2, 11, 7, 5, 3},
    {11, 8, 12, 0, 5, 2, 15, 13, 10, 14, 3, 6, 7, 1, 9, 4}, {7, 9, 3, 1, 13, 12, 11, 14, 2, 6, 5, 10, 4, 0, 15, 8},
    {9, 0, 5, 7, 2, 4, 10, 15, 14, 1, 11, 12, 6, 8, 3, 13}, {2, 12, 6, 10, 0, 11, 8, 3, 4, 13, 7, 5, 15, 14, 1, 9},
    {12, 5, 1, 15, 14, 13, 4, 10, 0, 7, 6, 3, 9, 2, 8, 11}, {13, 11, 7, 14, 12, 1, 3, 9, 5, 0, 15, 4, 8, 6, 2, 10},
    {6, 15, 14, 9, 11, 3, 0, 8, 12, 2, 13, 7, 1, 4, 10, 5}, {10, 2, 8, 4, 7, 6, 1, 5, 15, 11, 9, 14, 3, 12, 13, 0},
};

static inline uint32_t turned(uint32_t word, unsigned right) { return word >> right | word << (32 - right); }

/* A macro, because the 16 words must be plain places on the stack: indexed by a variable they cost twice the time. */
#define MIX(a, b, c, d, x, y)                 \
    do {                                      \
        v[a] = v[a] + v[b] + block[order[x]]; \
        v[d] = turned(v[d] ^ v[a], 16);       \
        v[c] = v[c] + v[d];                   \
        v[b] = turned(v[b] ^ v[c], 12);       \
        v[a] = v[a] + v[b] + block[order[y]]; \
        v[d] = turned(v[d] ^ v[a], 8);        \
        v[c] = v[c] + v[d];                   \
        v[b] = turned(v[b] ^ v[c], 7);        \
    } while (0)

/* Take in one block; `count` is the number of bytes hashed with it. Messages stay below 4 GB. */
static void compress(uint32_t h[8], const uint32_t block[WORDS], uint32_t count, bool last) {
    uint32_t v[WORDS];
    for (unsigned i = 0; i < 8; i++) {
        v[i] = h[i];
        v[i + 8] = start_words[i];
    }
    v[12] ^= count;
    v[14] ^= last ? UINT32_MAX : 0;
    for (unsigned round = 0; round < ROUNDS; round++) {
        const uint8_t *order = schedule[round];
        MIX(0, 4, 8, 12, 0, 1);
        MIX(1, 5, 9, 13, 2, 3);
        MIX(2, 6, 10, 14, 4, 5);
        MIX(3, 7, 11, 15, 6, 7);
        MIX(0, 5, 10, 15, 8, 9);
        MIX(1, 6, 11, 12, 10, 11);
        MIX(2, 7, 8, 13, 12, 13);
        MIX(3, 4, 9, 14, 14, 15);
    }
    for (unsigned i = 0; i < 8; i++) h[i] ^= v[i] ^ v[i + 8];
}

/* The words of a block that `part` fills from the front; the rest is zero. */
static void fill(uint32_t block[WORDS], cl_bytes part) {
    for (size_t i = 0; i < WORDS; i++) block[i] = 0;
    for (size_t i = 0; i < part.length; i++) block[i / 4] |= (uint32_t)part.at[i] << (8 * (i % 4));
}

static void start(uint32_t h[8], size_t key_length, size_t size) {
    for (unsigned i = 0; i < 8; i++) h[i] = start_words[i];
    h[0] ^= 0x01010000u ^ (uint32_t)key_length << 8 ^ (uint32_t)size;
}

/* Hash the message after `count` bytes; of an empty one there is still one block. */
static void end(uint32_t h[8], cl_bytes message, uint32_t count) {
    uint32_t block[WORDS];
    size_t left = message.length;
    while (left > CL_BLAKE2S_BLOCK) {
        fill(block, (cl_bytes){message.at + (message.length - left), CL_BLAKE2S_BLOCK});
        count += CL_BLAKE2S_BLOCK;
        compress(h, block, count, false);
        left -= CL_BLAKE2S_BLOCK;
    }
    fill(block, (cl_bytes){message.at + (message.length - left), left});
    compress(h, block, count + (uint32_t)left, true);
}

static void write(const uint32_t h[8], uint8_t *digest, size_t size) {
    for (size_t i = 0; i < size; i++) digest[i] = (uint8_t)(h[i / 4] >> (8 * (i % 4)));
}

void cl_blake2s(cl_bytes key, cl_bytes message, uint8_t *digest, size_t size) {
    uint32_t h[8], block[WORDS];
    start(h, key.length, size);
    if (key.length > 0) {
        fill(block, key);
        compress(h, block, CL_BLAKE2S_BLOCK, message.length == 0);
    }
    if (key.length == 0 || message.length > 0) end(h, message, key.length > 0 ? CL_BLAKE2S_BLOCK : 0);
    write(h, digest, size);
}

void cl_blake2s_key(cl_keyed *keyed, cl_bytes key, size_t size) {
    uint32_t block[WORDS];
    start(keyed->h, key.length, size);
    fill(block, key);
    compress(keyed->h, block, CL_BLAKE2S_BLOCK, false);
}

void cl_blake2s_keyed(const cl_keyed *keyed, cl_bytes message, uint8_t *digest, size_t size) {
    cl_keyed state = *keyed;
    end(state.h, message, CL_BLAKE2S_BLOCK);
    write(state.h, digest, size);
}

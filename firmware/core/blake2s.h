/* BLAKE2s as RFC 7693 defines it, sequential, for messages that are whole in memory. */
#ifndef CL_BLAKE2S_H
#define CL_BLAKE2S_H

#include <stddef.h>
#include <stdint.h>

#define CL_BLAKE2S_BLOCK 64

typedef struct {
    const uint8_t *at;
    size_t length;
} cl_bytes;

/* What hashing a key leaves behind. A key fills a block of its own, so keeping this halves the work of each tag. */
typedef struct {
    uint32_t h[8];
} cl_keyed;

/* Hash of `message` under `key` (empty: none); `size` is the length of `digest`, 1 to 32, and is part of the hash. */
void cl_blake2s(cl_bytes key, cl_bytes message, uint8_t *digest, size_t size);

void cl_blake2s_key(cl_keyed *keyed, cl_bytes key, size_t size);

/* As cl_blake2s with the key and size that `keyed` was made of; the message must not be empty. */
void cl_blake2s_keyed(const cl_keyed *keyed, cl_bytes message, uint8_t *digest, size_t size);

#endif

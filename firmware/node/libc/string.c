/* Compilers call the first two on their own, too. */
#include "string.h"

#include <stdint.h>

/* The empty statement keeps the compiler from seeing a copy loop here and replacing it by a call of this function. */
#define PLAIN_LOOP() __asm__ volatile("")

void *memcpy(void *restrict to, const void *restrict from, size_t length) {
    uint8_t *destination = to;
    const uint8_t *source = from;
    if ((((uintptr_t)to | (uintptr_t)from) & 3u) == 0) {
        for (; length >= 4; length -= 4, destination += 4, source += 4) {
            *(uint32_t *)(void *)destination = *(const uint32_t *)(const void *)source;
            PLAIN_LOOP();
        }
    }
    for (; length != 0; length--) {
        *destination++ = *source++;
        PLAIN_LOOP();
    }
    return to;
}

void *memset(void *to, int value, size_t length) {
    for (uint8_t *destination = to; length != 0; length--) {
        *destination++ = (uint8_t)value;
        PLAIN_LOOP();
    }
    return to;
}

int memcmp(const void *left, const void *right, size_t length) {
    const uint8_t *one = left;
    const uint8_t *two = right;
    for (; length != 0; length--, one++, two++) {
        if (*one != *two) {
            return *one < *two ? -1 : 1;
        }
    }
    return 0;
}

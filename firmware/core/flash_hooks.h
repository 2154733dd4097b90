/* Flash as those who remember something see it. It is programmed by words of 32 bits, each once between two erases of its
   sector; the processor stands still meanwhile (0.1 ms for a word, 0.1 s for a sector) and loses encoder edges. */
#ifndef CL_FLASH_HOOKS_H
#define CL_FLASH_HOOKS_H

#include <stdbool.h>
#include <stdint.h>

#define CL_FLASH_BLANK 0xFFFFFFFFu

typedef struct {
    void *self;
    bool (*erase)(void *self, uint32_t address); /* the sector that begins there */
    bool (*program)(void *self, uint32_t address, uint32_t word);
    uint32_t (*read)(void *self, uint32_t address);
} cl_flash;

#endif

#ifndef FLASH_H
#define FLASH_H

#include <stdbool.h>
#include <stdint.h>

#include "flash_hooks.h"

#define FLASH_SETTINGS_A 0xF400u /* what a node is flashed with */
#define FLASH_SETTINGS_B 0xF000u
#define FLASH_STORE_A 0xF800u
#define FLASH_STORE_B 0xFC00u

bool flash_erase(uint32_t address);
bool flash_program(uint32_t address, uint32_t word);
uint32_t flash_word(uint32_t address);

/* What lies there, to be read. */
static inline const void *flash_at(uint32_t address) { return (const void *)address; }

/* The same for the portable part. */
extern const cl_flash flash_hooks;

#endif

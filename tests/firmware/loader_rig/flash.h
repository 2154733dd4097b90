/* In place of the node's: a flash in memory, for the loader on this machine. */
#ifndef FLASH_H
#define FLASH_H

#include <stdbool.h>
#include <stdint.h>

#include "flash_hooks.h"

#define FLASH_SETTINGS_A 0xF400u
#define FLASH_SETTINGS_B 0xF000u
#define FLASH_STORE_A 0xF800u
#define FLASH_STORE_B 0xFC00u

bool flash_erase(uint32_t address);
bool flash_program(uint32_t address, uint32_t word);
uint32_t flash_word(uint32_t address);
const void *flash_at(uint32_t address);

extern const cl_flash flash_hooks;

#endif

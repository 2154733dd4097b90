#ifndef FLASH_H
#define FLASH_H

#include <stdbool.h>
#include <stdint.h>

#define FLASH_SETTINGS 0xF400u
#define FLASH_STORE_A 0xF800u
#define FLASH_STORE_B 0xFC00u

bool flash_erase(uint32_t address);
bool flash_program(uint32_t address, uint32_t word);
uint32_t flash_word(uint32_t address);

#endif

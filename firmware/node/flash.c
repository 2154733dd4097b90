/* Erasing and programming the flash the program itself runs from. Only for motors at standstill. */
#include "flash.h"

#include "kl26.h"

#define PROGRAM_LONGWORD 0x06u
#define ERASE_SECTOR 0x09u

/* Nothing can be fetched from flash while it works, so this runs from RAM, with interrupts masked. Encoder edges of
 * that time are lost: hence the standstill. A sector takes up to 114 ms, less than half of what the watchdog allows. What
 * was read before may still be cached: whoever looks next has to see what is there now. */
__attribute__((noinline, section(".ramcode"))) static uint8_t launch(void) {
    FTFA_FSTAT = FTFA_FSTAT_CCIF;
    while ((FTFA_FSTAT & FTFA_FSTAT_CCIF) == 0) {
    }
    MCM_PLACR |= MCM_PLACR_CLEAR_CACHE;
    return FTFA_FSTAT;
}

static bool run(uint8_t command, uint32_t address) {
    FTFA_FSTAT = FTFA_FSTAT_ERRORS & 0x70u; /* errors of an earlier command would block this one */
    FTFA_FCCOB0 = command;
    FTFA_FCCOB1 = (uint8_t)(address >> 16);
    FTFA_FCCOB2 = (uint8_t)(address >> 8);
    FTFA_FCCOB3 = (uint8_t)address;
    cpu_mask_interrupts();
    uint8_t status = launch();
    cpu_allow_interrupts();
    return (status & FTFA_FSTAT_ERRORS) == 0;
}

bool flash_erase(uint32_t address) { return run(ERASE_SECTOR, address); }

bool flash_program(uint32_t address, uint32_t word) {
    FTFA_FCCOB4 = (uint8_t)(word >> 24);
    FTFA_FCCOB5 = (uint8_t)(word >> 16);
    FTFA_FCCOB6 = (uint8_t)(word >> 8);
    FTFA_FCCOB7 = (uint8_t)word;
    return run(PROGRAM_LONGWORD, address) && flash_word(address) == word;
}

uint32_t flash_word(uint32_t address) { return REG32(address); }

static bool erase(void *self, uint32_t address) {
    (void)self;
    return flash_erase(address);
}

static bool program(void *self, uint32_t address, uint32_t word) {
    (void)self;
    return flash_program(address, word);
}

static uint32_t read(void *self, uint32_t address) {
    (void)self;
    return flash_word(address);
}

const cl_flash flash_hooks = {0, erase, program, read};

/* What a node is told: who it is, where it listens, its master key, its limits. curveline/radio/site/key_file.py has the
   same 84 bytes.

   Little-endian: magic u32, size u16, number u8, rate u8, channel u8, address 5, generation u16, master key 16; per axis low,
   high i32, speed, acceleration u32; CRC-32 of all before. */
#ifndef CL_SETTINGS_RECORD_H
#define CL_SETTINGS_RECORD_H

#include <stdbool.h>
#include <stdint.h>

#include "keys.h"
#include "motion.h"

enum { CL_SETTINGS_WORDS = 21, CL_SETTINGS_BYTES = 4 * CL_SETTINGS_WORDS };

/* Where its radio listens. */
typedef struct {
    uint8_t rate; /* 0: 250 kbps, 1: 1 Mbps, 2: 2 Mbps */
    uint8_t channel;
    uint8_t address[5];
} cl_listening;

typedef struct {
    uint8_t number;
    cl_listening radio;
    uint16_t generation; /* 0 as flashed, one more with every change since */
    cl_key master;
    cl_axis_limits axes[CL_AXES];
} cl_settings;

/* CRC-32 of the first `words` words. */
uint32_t cl_settings_crc(const uint8_t *record, unsigned words);

/* False unless the record is whole and says what a node can do. */
bool cl_settings_decode(const uint8_t record[CL_SETTINGS_BYTES], cl_settings *settings);

/* What positions hang on, in 16 bits: whose motors they are of, and where their travel ends. */
uint16_t cl_settings_sum(const cl_settings *settings);

/* Whether one generation came after another; numbers begin anew after 65,535. */
bool cl_settings_newer(uint16_t generation, uint16_t than);

#endif

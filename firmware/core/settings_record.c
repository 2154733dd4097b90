#include "settings_record.h"

#include <string.h>

#include "bytes.h"
#include "crc32.h"

enum {
    AT_MAGIC = 0,
    AT_SIZE = 4,
    AT_NUMBER = 6,
    AT_RATE = 7,
    AT_CHANNEL = 8,
    AT_ADDRESS = 9,
    AT_GENERATION = 14,
    AT_MASTER = 16,
    AT_AXES = 32,
    AXIS_BYTES = 16,
    AT_CRC = AT_AXES + CL_AXES * AXIS_BYTES,
};

#define MAGIC 0x324E4C43u /* "CLN2" */
#define MOST_NUMBER 254
#define MOST_RATE 2
#define MOST_CHANNEL 125

uint32_t cl_settings_crc(const uint8_t *record, unsigned words) {
    uint32_t crc = CL_CRC32_BEGIN;
    for (unsigned index = 0; index < words; index++) crc = cl_crc32_word(crc, cl_get32(record + 4 * index));
    return ~crc;
}

static bool read_axis(const uint8_t *record, cl_axis_limits *axis) {
    axis->low = (int32_t)cl_get32(record);
    axis->high = (int32_t)cl_get32(record + 4);
    uint32_t speed = cl_get32(record + 8);
    uint32_t acceleration = cl_get32(record + 12);
    axis->speed = (int32_t)speed;
    axis->acceleration = (int32_t)acceleration;
    return axis->low <= axis->high && speed >= CL_LEAST_RATE && speed <= CL_MOST_RATE &&
           acceleration >= CL_LEAST_RATE && acceleration <= CL_MOST_RATE;
}

bool cl_settings_decode(const uint8_t record[CL_SETTINGS_BYTES], cl_settings *settings) {
    if (cl_get32(record + AT_MAGIC) != MAGIC || cl_get16(record + AT_SIZE) != CL_SETTINGS_BYTES ||
        cl_get32(record + AT_CRC) != cl_settings_crc(record, CL_SETTINGS_WORDS - 1)) {
        return false;
    }
    settings->number = record[AT_NUMBER];
    settings->radio.rate = record[AT_RATE];
    settings->radio.channel = record[AT_CHANNEL];
    memcpy(settings->radio.address, record + AT_ADDRESS, sizeof settings->radio.address);
    settings->generation = cl_get16(record + AT_GENERATION);
    memcpy(settings->master.bytes, record + AT_MASTER, CL_KEY_BYTES);
    bool good = settings->number >= 1 && settings->number <= MOST_NUMBER && settings->radio.rate <= MOST_RATE &&
                settings->radio.channel <= MOST_CHANNEL;
    for (unsigned axis = 0; axis < CL_AXES; axis++) {
        good &= read_axis(record + AT_AXES + AXIS_BYTES * axis, &settings->axes[axis]);
    }
    return good;
}

uint16_t cl_settings_sum(const cl_settings *settings) {
    uint32_t crc = cl_crc32_word(CL_CRC32_BEGIN, settings->number);
    for (unsigned axis = 0; axis < CL_AXES; axis++) {
        crc = cl_crc32_word(crc, (uint32_t)settings->axes[axis].low);
        crc = cl_crc32_word(crc, (uint32_t)settings->axes[axis].high);
    }
    return (uint16_t)(~crc ^ ~crc >> 16);
}

bool cl_settings_newer(uint16_t generation, uint16_t than) { return (int16_t)(uint16_t)(generation - than) > 0; }

#include "settings.h"

#include "bytes.h"
#include "flash.h"

/* The record, little-endian: magic u32, size u16, number u8, rate u8, channel u8, address 5, zero u16, master key 16;
 * per axis low, high i32, speed, acceleration u32; CRC-32 of all before. */
enum {
    AT_MAGIC = 0,
    AT_SIZE = 4,
    AT_NUMBER = 6,
    AT_RATE = 7,
    AT_CHANNEL = 8,
    AT_ADDRESS = 9,
    AT_ZERO = 14,
    AT_MASTER = 16,
    AT_AXES = 32,
    AXIS_BYTES = 16,
    AT_CRC = AT_AXES + 3 * AXIS_BYTES,
    RECORD_BYTES = AT_CRC + 4,
};

#define MAGIC 0x314E4C43u /* "CLN1" */
#define MOST_NUMBER 254
#define MOST_CHANNEL 125

/* Flash is dear. */
__attribute__((noinline)) static uint32_t crc32(const uint8_t *bytes, unsigned length) {
    uint32_t crc = 0xFFFFFFFFu;
    for (unsigned i = 0; i < length; i++) {
        crc ^= bytes[i];
        for (int bit = 0; bit < 8; bit++) {
            crc = crc >> 1 ^ (0xEDB88320u & (0u - (crc & 1u)));
        }
    }
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

static void copy(uint8_t *to, const uint8_t *from, unsigned length) {
    for (unsigned i = 0; i < length; i++) {
        to[i] = from[i];
    }
}

uint16_t settings_sum(const node_settings *settings) {
    uint8_t bytes[4 + 8 * CL_AXES] = {settings->number};
    for (unsigned axis = 0; axis < CL_AXES; axis++) {
        cl_put32(bytes + 4 + 8 * axis, (uint32_t)settings->axes[axis].low);
        cl_put32(bytes + 8 + 8 * axis, (uint32_t)settings->axes[axis].high);
    }
    uint32_t crc = crc32(bytes, sizeof bytes);
    return (uint16_t)(crc ^ crc >> 16);
}

bool settings_read(node_settings *settings) {
    uint8_t record[RECORD_BYTES];
    for (unsigned i = 0; i < RECORD_BYTES; i += 4) {
        cl_put32(record + i, flash_word(FLASH_SETTINGS + i));
    }
    if (cl_get32(record + AT_MAGIC) != MAGIC || cl_get16(record + AT_SIZE) != RECORD_BYTES ||
        cl_get32(record + AT_CRC) != crc32(record, AT_CRC) || cl_get16(record + AT_ZERO) != 0) {
        return false;
    }
    settings->number = record[AT_NUMBER];
    settings->radio.rate = record[AT_RATE];
    settings->radio.channel = record[AT_CHANNEL];
    copy(settings->radio.address, record + AT_ADDRESS, sizeof settings->radio.address);
    copy(settings->master.bytes, record + AT_MASTER, CL_KEY_BYTES);
    bool good = settings->number >= 1 && settings->number <= MOST_NUMBER && settings->radio.rate <= 2 &&
                settings->radio.channel <= MOST_CHANNEL;
    for (unsigned axis = 0; axis < CL_AXES; axis++) {
        good &= read_axis(record + AT_AXES + AXIS_BYTES * axis, &settings->axes[axis]);
    }
    return good;
}

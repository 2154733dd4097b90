#include "crc32.h"

uint32_t cl_crc32_word(uint32_t crc, uint32_t word) {
    crc ^= word;
    for (unsigned bit = 0; bit < 32; bit++) crc = crc >> 1 ^ (crc & 1 ? 0xEDB88320u : 0);
    return crc;
}

/* CRC-32 as everybody else computes it (reflected, 0xEDB88320), over words whose bytes go lowest first. */
#ifndef CL_CRC32_H
#define CL_CRC32_H

#include <stdint.h>

#define CL_CRC32_BEGIN 0xFFFFFFFFu

/* The checksum so far, with one word more; after the last one it is the complement. */
uint32_t cl_crc32_word(uint32_t crc, uint32_t word);

#endif

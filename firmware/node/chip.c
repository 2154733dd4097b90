#include "kl26.h"
#include "program.h"

/* The chip's 80 bits of identity in the 32 that the protocol has room for: FNV-1a. */
uint32_t chip_id(void) {
    const uint32_t words[3] = {SIM_UIDMH, SIM_UIDML, SIM_UIDL};
    uint32_t hash = 2166136261u;
    for (unsigned byte = 0; byte < 10; byte++) {
        unsigned place = byte < 2 ? byte : byte + 2; /* of the first word only two bytes count */
        hash = (hash ^ (words[place / 4] >> 8 * (place % 4) & 0xFFu)) * 16777619u;
    }
    return hash;
}

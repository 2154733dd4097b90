/* What survives a power cut: how often the node was switched on, and where its axes stand. */
#ifndef PERSIST_H
#define PERSIST_H

#include <stdbool.h>
#include <stdint.h>

#include "node.h"

/* Count this boot and say what is known from before under the settings that `under` sums up; false if the flash does not
 * take it: then nothing may move. */
bool persist_begin(uint16_t under, cl_memory *memory, cl_counts *position);

/* The axes are about to move: from now on no boot believes the last position. False if that cannot be written. */
bool persist_moving(void);

/* Write down the position once the axes have been standing for a while, and make room for the next time. Whether that is done:
 * the node could be switched off now and lose nothing. */
bool persist_serve(const cl_node *node, int64_t now_ms);

#endif

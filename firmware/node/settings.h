/* What a node is told once, in a flash sector of its own: who it is, where it listens, its master key, its limits. */
#ifndef SETTINGS_H
#define SETTINGS_H

#include <stdbool.h>

#include "keys.h"
#include "motion.h"
#include "nrf24.h"

typedef struct {
    uint8_t number;
    nrf24_settings radio;
    cl_key master;
    cl_axis_limits axes[CL_AXES];
} node_settings;

/* False if there is no record, or not a whole one. */
bool settings_read(node_settings *settings);

/* What positions hang on, in 16 bits: whose motors they are of, and where their travel ends. */
uint16_t settings_sum(const node_settings *settings);

#endif

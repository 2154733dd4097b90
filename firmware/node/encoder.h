#ifndef ENCODER_H
#define ENCODER_H

#include <stdint.h>

#include "motion.h"

void encoder_start(void);
void encoder_read(cl_counts *now);

/* From now on count from elsewhere. */
void encoder_shift(const cl_counts *shift);

/* How often an axis (from 0) changed both channels at once since power-on: edges were missed. */
uint32_t encoder_illegal(unsigned axis);

#endif

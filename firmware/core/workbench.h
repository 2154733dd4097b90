/* One motor turned without a loop, at 1 kHz, to see what comes of it; curveline/radio/node/workbench.py is its specification.

   Duty: grows evenly until an encoder gives counts, goes a little higher and stays; or is all there from the beginning. The
   turn ends after so many counts of any encoder, after its time, or when the drivers report a fault; then the motor is shorted
   for a moment. What it is for: which encoder belongs to which motor, which way round, and what duty the motor needs.
   Units: counts, ms, thousandths of full duty. */
#ifndef CL_WORKBENCH_H
#define CL_WORKBENCH_H

#include "frames.h"

typedef struct {
    uint8_t axis; /* from 1 */
    bool at_once; /* no growing */
    int16_t duty; /* thousandths; its sign is the direction */
    uint16_t counts, span_ms; /* what ends it */
} cl_turn;

typedef struct {
    cl_turn turn;
    cl_counts begin;
    int16_t duty;       /* now */
    uint16_t threshold; /* duty at which anything moved, 0 if nothing has */
    uint16_t at_ms, rest_ms, driver_ms, sample_ms;
    bool busy;
    uint8_t samples;
    int16_t trace[CL_TRACE_SAMPLES]; /* counts of the axis from where it stood, CL_TRACE_MS apart */
} cl_workbench;

/* Begin, with the encoders at `counts`. */
void cl_workbench_start(cl_workbench *bench, const cl_turn *turn, const cl_counts *counts);

/* Somebody has ended it: the motor is shorted. */
void cl_workbench_stop(cl_workbench *bench);

/* One ms; the duty for the motor. */
int16_t cl_workbench_tick(cl_workbench *bench, const cl_counts *counts, bool driver_fault);

/* Some of the samples, from `first` on; 0 past the last. */
void cl_workbench_samples(const cl_workbench *bench, uint8_t first, int16_t samples[CL_READING_SAMPLES]);

#endif

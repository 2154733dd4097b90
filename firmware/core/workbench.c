#include "workbench.h"

enum {
    LIFE_COUNTS = 4, /* fewer may be the noise of a dead channel */
    MARGIN_DUTY = 100, /* above the duty at which something moved, so that it goes on moving */
    REST_MS = 60,
    DRIVER_MS = 2, /* over-current protection tries again after about 1 ms by itself */
    SAMPLE_MOST = INT16_MAX
};

static int32_t size(int32_t value) { return value < 0 ? -value : value; }

/* Counts may wrap round, the way between two of them does not matter then. */
static int32_t apart(int32_t one, int32_t other) { return (int32_t)((uint32_t)one - (uint32_t)other); }

void cl_workbench_start(cl_workbench *bench, const cl_turn *turn, const cl_counts *counts) {
    *bench = (cl_workbench){.turn = *turn, .begin = *counts, .busy = true};
}

void cl_workbench_stop(cl_workbench *bench) {
    bench->busy = false;
    bench->duty = 0;
}

static int32_t farthest(const cl_workbench *bench, const cl_counts *counts) {
    int32_t far = 0;
    for (unsigned axis = 0; axis < CL_AXES; axis++) {
        int32_t gone = size(apart(counts->at[axis], bench->begin.at[axis]));
        if (gone > far) far = gone;
    }
    return far;
}

static void keep(cl_workbench *bench, const cl_counts *counts) {
    if (bench->sample_ms++ % CL_TRACE_MS != 0) return;
    unsigned axis = bench->turn.axis - 1u;
    int32_t gone = apart(counts->at[axis], bench->begin.at[axis]);
    if (gone > SAMPLE_MOST) gone = SAMPLE_MOST;
    if (gone < -SAMPLE_MOST) gone = -SAMPLE_MOST;
    bench->trace[bench->samples++] = (int16_t)gone;
}

static void note(cl_workbench *bench, const cl_counts *counts, int32_t far) {
    if (bench->threshold == 0 && far >= LIFE_COUNTS) {
        bench->threshold = (uint16_t)(bench->duty == 0 ? 1 : size(bench->duty));
    }
    bool keeps = bench->turn.at_once || bench->threshold != 0;
    if (keeps && bench->samples < CL_TRACE_SAMPLES) keep(bench, counts);
}

static int16_t wanted(const cl_workbench *bench) {
    const cl_turn *turn = &bench->turn;
    int32_t most = size(turn->duty), duty = most;
    if (!turn->at_once && bench->threshold != 0) {
        int32_t enough = bench->threshold + MARGIN_DUTY;
        if (enough < most) duty = enough;
    } else if (!turn->at_once) {
        duty = most * bench->at_ms / turn->span_ms;
    }
    return (int16_t)(turn->duty > 0 ? duty : -duty);
}

int16_t cl_workbench_tick(cl_workbench *bench, const cl_counts *counts, bool driver_fault) {
    if (!bench->busy) return 0;
    bench->at_ms++;
    int32_t far = farthest(bench, counts);
    note(bench, counts, far);
    bench->driver_ms = driver_fault ? (uint16_t)(bench->driver_ms + 1) : 0;
    bool over = far >= bench->turn.counts || bench->at_ms > bench->turn.span_ms || bench->driver_ms > DRIVER_MS;
    if (over || bench->rest_ms != 0) {
        bench->rest_ms++;
        bench->busy = bench->rest_ms < REST_MS;
        bench->duty = 0;
    } else {
        bench->duty = wanted(bench);
    }
    return bench->duty;
}

void cl_workbench_samples(const cl_workbench *bench, uint8_t first, int16_t samples[CL_READING_SAMPLES]) {
    for (unsigned number = 0; number < CL_READING_SAMPLES; number++) {
        unsigned at = first + number;
        samples[number] = at < bench->samples ? bench->trace[at] : 0;
    }
}

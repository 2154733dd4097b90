#include "persist.h"

#include "flash.h"
#include "motors.h"
#include "program.h"
#include "reset.h"
#include "store.h"

/* Between the steps of a run nodes stand for a few ms: saving there would wear the flash out for nothing. */
#define SAVE_AFTER_MS 250
#define PREPARE_AFTER_MS 1000
#define FLAG_ESTOP 1u

static cl_store store;
static int64_t still_ms;

bool persist_begin(uint16_t under, cl_memory *memory, cl_counts *position) {
    cl_store_open(&store, &flash_hooks, FLASH_STORE_A, FLASH_STORE_B);
    cl_store_tie(&store, under);
    if (!cl_store_boot(&store)) {
        return false;
    }
    *position = store.last.position;
    uint8_t cause = reset_cause();
    bool brown_out = cause == CL_CAUSE_LOW_VOLTAGE;
    uint8_t reason = brown_out ? CL_FAULT_BROWN_OUT : store.last.known ? 0 : CL_NOT_HOMED;
    *memory = (cl_memory){
        .nonce = {.boot = store.last.boot, .noise = startup_noise},
        .cause = cause,
        .unhomed = {{reason, reason, reason}},
        .estop = reset_stopped((store.last.flags & FLAG_ESTOP) != 0),
        .fault = brown_out ? CL_FAULT_BROWN_OUT : CL_FAULT_NONE,
    };
    return !brown_out || cl_store_moving(&store); /* nor must a later boot believe it */
}

bool persist_moving(void) {
    reset_supply_stands(); /* from here on a sag of the supply costs the position */
    return cl_store_moving(&store);
}

bool persist_serve(const cl_node *node, int64_t now_ms) {
    if (node->moving || node->turning || node->memory.homing || !motors_still()) {
        still_ms = now_ms;
        return false;
    }
    cl_counts position;
    motors_where(&position);
    bool rests = now_ms - still_ms >= SAVE_AFTER_MS;
    if (rests) {
        bool known = cl_homed(&node->memory) && motors_sure();
        cl_store_save(&store, &position, known, node->memory.estop ? FLAG_ESTOP : 0);
    }
    if (now_ms - still_ms >= PREPARE_AFTER_MS) {
        cl_store_prepare(&store);
    }
    return rests;
}

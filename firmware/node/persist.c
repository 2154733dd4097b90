#include "persist.h"

#include "flash.h"
#include "kl26.h"
#include "motors.h"
#include "program.h"
#include "store.h"

/* Between the steps of a run nodes stand for a few ms: saving there would wear the flash out for nothing. */
#define SAVE_AFTER_MS 250
#define PREPARE_AFTER_MS 1000
#define FLAG_ESTOP 1u

static cl_store store;
static int64_t still_ms;

static bool erase(void *self, uint32_t address) {
    (void)self;
    return flash_erase(address);
}

static bool program(void *self, uint32_t address, uint32_t word) {
    (void)self;
    return flash_program(address, word);
}

static uint32_t read(void *self, uint32_t address) {
    (void)self;
    return flash_word(address);
}

bool persist_begin(cl_memory *memory, cl_counts *position) {
    const cl_flash flash = {0, erase, program, read};
    cl_store_open(&store, &flash, FLASH_STORE_A, FLASH_STORE_B);
    if (!cl_store_boot(&store)) {
        return false;
    }
    *position = store.last.position;
    bool powered_on = (RCM_SRS0 & RCM_SRS0_POR) != 0;
    bool brown_out = !powered_on && (RCM_SRS0 & RCM_SRS0_LVD) != 0;
    *memory = (cl_memory){
        .boot = (uint16_t)store.last.boot,
        .noise = startup_noise,
        .homed = store.last.known && !brown_out,
        .estop = (store.last.flags & FLAG_ESTOP) != 0 && !powered_on, /* no reset but the power switch ends it */
        .fault = brown_out ? CL_FAULT_BROWN_OUT : CL_FAULT_NONE,
    };
    return !brown_out || cl_store_moving(&store); /* nor must a later boot believe it */
}

bool persist_moving(void) { return cl_store_moving(&store); }

void persist_serve(const cl_node *node, int64_t now_ms) {
    if (node->moving || node->memory.homing || !motors_still()) {
        still_ms = now_ms;
        return;
    }
    cl_counts position;
    motors_where(&position);
    if (now_ms - still_ms >= SAVE_AFTER_MS) {
        cl_store_save(&store, &position, node->memory.homed, node->memory.estop ? FLAG_ESTOP : 0);
    }
    if (now_ms - still_ms >= PREPARE_AFTER_MS) {
        cl_store_prepare(&store);
    }
}

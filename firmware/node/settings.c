#include "settings.h"

#include "flash.h"
#include "motors.h"
#include "program.h"
#include "reset.h"
#include "settings_store.h"

#define ANSWER_MS 300 /* for the host to hear that its order is being carried out */

static cl_settings_store store;
static int64_t leave_ms;

/* Another sector may be erased in the same turn of the main loop, and the watchdog allows for one. */
static bool erase(void *self, uint32_t address) {
    (void)self;
    bool done = flash_erase(address);
    watchdog_main();
    return done;
}

const cl_settings *settings_begin(void) {
    const cl_flash flash = {0, erase, flash_hooks.program, flash_hooks.read};
    bool restarted = reset_cause() == CL_CAUSE_SOFTWARE;
    return cl_settings_open(&store, &flash, FLASH_SETTINGS_A, FLASH_SETTINGS_B, restarted) ? &store.now : 0;
}

/* While the flash works encoder edges are lost: that can wait until motors no longer tremble, and the host asks again. */
static uint8_t put(void *self, const uint8_t *record) {
    (void)self;
    return motors_still() ? cl_settings_put(&store, record) : CL_OUTCOME_OCCUPIED;
}

static uint8_t request(void *self) {
    (void)self;
    return motors_still() ? cl_settings_request(&store) : CL_OUTCOME_OCCUPIED;
}

static uint8_t keep(void *self) {
    (void)self;
    return motors_still() ? cl_settings_keep(&store) : CL_OUTCOME_OCCUPIED;
}

static void drop(void *self) {
    (void)self;
    cl_settings_forget(&store);
}

static void standing(void *self, cl_standing *now) {
    (void)self;
    uint16_t generation = store.now.generation;
    *now = (cl_standing){store.trial, generation, (uint16_t)(generation + (store.stored ? 1u : 0u))};
}

void settings_join(cl_plant *plant) {
    plant->store = put;
    plant->request = request;
    plant->keep = keep;
    plant->drop = drop;
    plant->standing = standing;
}

void settings_serve(const cl_node *node, int64_t now_ms, bool saved) {
    if (!node->leaves) {
        leave_ms = now_ms + ANSWER_MS;
    } else if (saved && now_ms >= leave_ms) {
        reset_restart();
    }
}

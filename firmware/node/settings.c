#include "settings.h"

#include "flash.h"
#include "motors.h"
#include "program.h"
#include "reset.h"
#include "settings_store.h"
#include "tick.h"

#define TRIAL_MS 30000
#define ANSWER_MS 300 /* for the host to hear that its order is being carried out */

static cl_settings_store store;
static bool leaving;
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

bool settings_on_trial(void) { return store.trial; }

static bool put(void *self, const uint8_t *record) {
    (void)self;
    return motors_still() && !leaving && cl_settings_put(&store, record);
}

static void leave(int64_t now_ms) {
    leaving = true;
    leave_ms = now_ms + ANSWER_MS;
}

static bool attempt(void *self, int64_t now_ms) {
    (void)self;
    if (!motors_still() || !cl_settings_request(&store)) {
        return false;
    }
    leave(now_ms);
    return true;
}

static bool keep(void *self) {
    (void)self;
    return motors_still() && !leaving && cl_settings_keep(&store);
}

static bool drop(void *self, int64_t now_ms) {
    (void)self;
    cl_settings_forget(&store);
    if (store.trial) {
        leave(now_ms);
    }
    return true;
}

static void look(void *self, int64_t now_ms, cl_settings_look *seen) {
    (void)self;
    int64_t left_ms = TRIAL_MS - now_ms;
    *seen = (cl_settings_look){
        .on_trial = store.trial,
        .generation = store.now.generation,
        .left_s = store.trial && left_ms > 0 ? (uint8_t)((left_ms + 999) / 1000) : 0,
        .stored = store.stored && !leaving ? store.stored_generation : 0,
    };
}

void settings_join(cl_plant *plant) {
    plant->store = put;
    plant->attempt = attempt;
    plant->keep = keep;
    plant->drop = drop;
    plant->settings = look;
}

void settings_serve(int64_t now_ms, bool saved) {
    if (store.trial && now_ms >= TRIAL_MS && !leaving) {
        leaving = true;
    }
    if (leaving && saved && now_ms >= leave_ms) {
        reset_restart();
    }
}

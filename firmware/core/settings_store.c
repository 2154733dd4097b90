#include "settings_store.h"

#include "bytes.h"
#include "frames.h"

#define SET 0u

enum { REQUESTED = CL_SETTINGS_WORDS, TRIED, KEPT, USED_WORDS };

static uint32_t word_at(const cl_settings_store *store, unsigned sector, unsigned index) {
    return store->flash.read(store->flash.self, store->sector[sector] + 4 * index);
}

static void program(cl_settings_store *store, unsigned sector, unsigned index, uint32_t word) {
    store->flash.program(store->flash.self, store->sector[sector] + 4 * index, word);
}

static bool load(const cl_settings_store *store, unsigned sector, cl_settings *settings) {
    uint8_t record[CL_SETTINGS_BYTES];
    for (unsigned index = 0; index < CL_SETTINGS_WORDS; index++) {
        cl_put32(record + 4 * index, word_at(store, sector, index));
    }
    return cl_settings_decode(record, settings);
}

static bool set(cl_settings_store *store, unsigned sector, unsigned mark) {
    if (word_at(store, sector, mark) != SET) program(store, sector, mark, SET);
    return word_at(store, sector, mark) == SET;
}

static bool marked(cl_settings_store *store, unsigned sector, unsigned mark) {
    if (word_at(store, sector, mark) == CL_FLASH_BLANK) return false;
    set(store, sector, mark);
    return true;
}

bool cl_settings_open(
    cl_settings_store *store, const cl_flash *flash, uint32_t first_sector, uint32_t second_sector, bool restarted
) {
    cl_settings found[2];
    bool whole[2], kept[2];
    *store = (cl_settings_store){.flash = *flash, .sector = {first_sector, second_sector}};
    for (unsigned sector = 0; sector < 2; sector++) {
        whole[sector] = load(store, sector, &found[sector]);
        kept[sector] = whole[sector] && marked(store, sector, KEPT);
    }
    if (!kept[0] && !kept[1]) return false;
    bool second = !kept[0] || (kept[1] && cl_settings_newer(found[1].generation, found[0].generation));
    uint8_t now = second, other = !second;
    bool newer = whole[other] && cl_settings_newer(found[other].generation, found[now].generation);
    bool asked = newer && marked(store, other, REQUESTED) && !marked(store, other, TRIED);
    store->trial = asked && set(store, other, TRIED) && restarted;
    store->at = store->trial ? other : now;
    store->now = found[store->at];
    return true;
}

/* Whether the settings in force will be there at the next boot, whatever becomes of the others. */
static bool lasts(cl_settings_store *store) {
    cl_settings settings;
    return load(store, store->at, &settings) && set(store, store->at, KEPT);
}

static bool erase(cl_settings_store *store, unsigned sector) {
    if (!store->flash.erase(store->flash.self, store->sector[sector])) return false;
    for (unsigned index = 0; index < USED_WORDS; index++) {
        if (word_at(store, sector, index) != CL_FLASH_BLANK) return false;
    }
    return true;
}

static bool write(cl_settings_store *store, const uint8_t record[CL_SETTINGS_BYTES]) {
    unsigned spare = 1u - store->at;
    if (!lasts(store) || !erase(store, spare)) return false;
    for (unsigned index = 0; index < CL_SETTINGS_WORDS; index++) {
        uint32_t word = cl_get32(record + 4 * index);
        program(store, spare, index, word);
        if (word_at(store, spare, index) != word) return false;
    }
    return true;
}

uint8_t cl_settings_put(cl_settings_store *store, const uint8_t record[CL_SETTINGS_BYTES]) {
    cl_settings wanted;
    uint16_t next = (uint16_t)(store->now.generation + 1);
    if (!cl_settings_decode(record, &wanted) || wanted.generation != next || store->trial) return CL_OUTCOME_BEYOND;
    store->stored = write(store, record);
    return store->stored ? CL_OUTCOME_DONE : CL_OUTCOME_FAILED;
}

uint8_t cl_settings_request(cl_settings_store *store) {
    if (!store->stored) return CL_OUTCOME_BEYOND;
    if (!set(store, 1u - store->at, REQUESTED)) return CL_OUTCOME_FAILED;
    store->stored = false;
    return CL_OUTCOME_DONE;
}

uint8_t cl_settings_keep(cl_settings_store *store) {
    if (!store->trial) return CL_OUTCOME_BEYOND;
    store->trial = !set(store, store->at, KEPT);
    return store->trial ? CL_OUTCOME_FAILED : CL_OUTCOME_DONE;
}

void cl_settings_forget(cl_settings_store *store) { store->stored = false; }

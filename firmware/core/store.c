#include "store.h"

#include "crc32.h"

#define MAGIC 0x4C43u /* "CL"; what the position was counted under is in the upper half */
#define UNDER_SHIFT 16
#define BLANK CL_FLASH_BLANK
#define MOVING 0u
#define BOOT_MASK 0xFFFFFFu
#define FLAGS_SHIFT 24
#define FLAGS_MASK 0x7Fu
#define KNOWN_SHIFT 31

enum { SEQUENCE = 1, POSITION = 2, BOOT = 5, MARK = 6, CHECK = 7, TRIES = 3 };

/* CRC-32 without its lowest bit: the checksum of a complete record is never a blank word. */
static uint32_t checksum(const uint32_t words[CL_STORE_WORDS]) {
    uint32_t crc = CL_CRC32_BEGIN;
    for (unsigned index = 0; index < MARK; index++) crc = cl_crc32_word(crc, words[index]);
    return ~crc >> 1;
}

static uint32_t word_at(const cl_store *store, uint32_t address, unsigned index) {
    return store->flash.read(store->flash.self, address + 4 * index);
}

static uint32_t slot_at(const cl_store *store, unsigned sector, unsigned slot) {
    return store->sector[sector] + 4 * CL_STORE_WORDS * slot;
}

static void load(const cl_store *store, uint32_t address, uint32_t words[CL_STORE_WORDS]) {
    for (unsigned index = 0; index < CL_STORE_WORDS; index++) words[index] = word_at(store, address, index);
}

static bool whole(const uint32_t words[CL_STORE_WORDS]) {
    return (words[0] & 0xFFFFu) == MAGIC && words[CHECK] == checksum(words);
}

static bool blank(const cl_store *store, uint32_t address) {
    for (unsigned index = 0; index < CL_STORE_WORDS; index++) {
        if (word_at(store, address, index) != BLANK) return false;
    }
    return true;
}

static void take(cl_store *store, uint32_t address, const uint32_t words[CL_STORE_WORDS]) {
    store->found = true;
    store->newest = address;
    store->sequence = words[SEQUENCE];
    store->marked = words[MARK] != BLANK;
    for (unsigned axis = 0; axis < CL_AXES; axis++) {
        store->last.position.at[axis] = (int32_t)words[POSITION + axis];
    }
    store->last.boot = words[BOOT] & BOOT_MASK;
    store->last.flags = words[BOOT] >> FLAGS_SHIFT & FLAGS_MASK;
    store->last.known = words[BOOT] >> KNOWN_SHIFT != 0 && !store->marked;
    store->last.under = (uint16_t)(words[0] >> UNDER_SHIFT);
}

/* A slot that was written to the end but cannot be read may have held anything. One without a checksum was cut short,
   and nothing was done in its name. */
static bool decayed(const cl_store *store, uint32_t address) {
    uint32_t words[CL_STORE_WORDS];
    load(store, address, words);
    return words[CHECK] != BLANK && !whole(words);
}

/* Where the next record goes, and how many may have been lost since the newest one. */
static void look_behind_newest(cl_store *store) {
    unsigned newest = (store->newest - store->sector[store->active]) / (4 * CL_STORE_WORDS);
    store->used = (uint8_t)(newest + 1);
    for (unsigned slot = newest + 1; slot < CL_STORE_SLOTS; slot++) {
        uint32_t address = slot_at(store, store->active, slot);
        if (!blank(store, address)) store->used = (uint8_t)(slot + 1);
        if (decayed(store, address)) store->lost++;
    }
    if (store->used == CL_STORE_SLOTS && decayed(store, store->sector[1 - store->active])) store->lost++;
    if (store->lost > 0) store->last.known = false;
}

void cl_store_open(cl_store *store, const cl_flash *flash, uint32_t first_sector, uint32_t second_sector) {
    *store = (cl_store){.flash = *flash, .sector = {first_sector, second_sector}};
    for (uint8_t sector = 0; sector < CL_STORE_SECTORS; sector++) {
        for (unsigned slot = 0; slot < CL_STORE_SLOTS; slot++) {
            uint32_t words[CL_STORE_WORDS], address = slot_at(store, sector, slot);
            load(store, address, words);
            if (!whole(words) || (store->found && words[SEQUENCE] <= store->sequence)) continue;
            take(store, address, words);
            store->active = sector;
        }
    }
    if (store->found) {
        look_behind_newest(store);
    } else {
        store->active = 1; /* as if full: the first record begins with an erase of the first sector */
        store->used = CL_STORE_SLOTS;
    }
}

/* The sector that may be erased: never that of the newest record, even if the other one has filled up with failures. */
static uint8_t spare(const cl_store *store) {
    bool in_first = store->newest - store->sector[0] < 4 * CL_STORE_WORDS * CL_STORE_SLOTS;
    return store->found && in_first ? 1 : 0;
}

bool cl_store_prepare(cl_store *store) {
    if (store->used < CL_STORE_SLOTS || store->prepared) return true;
    unsigned sector = spare(store);
    if (!store->flash.erase(store->flash.self, store->sector[sector])) return false;
    for (unsigned slot = 0; slot < CL_STORE_SLOTS; slot++) {
        if (!blank(store, slot_at(store, sector, slot))) return false;
    }
    store->prepared = true;
    return true;
}

/* The address of a blank slot; an interrupted erase may read as blank and yet not keep what is written, so only an
   erase of this boot will do. */
static bool next_slot(cl_store *store, uint32_t *address) {
    if (!cl_store_prepare(store)) return false;
    if (store->used == CL_STORE_SLOTS) {
        store->active = spare(store);
        store->used = 0;
        store->prepared = false;
    }
    *address = slot_at(store, store->active, store->used++);
    return true;
}

static bool program(cl_store *store, uint32_t address, const uint32_t words[CL_STORE_WORDS]) {
    static const uint8_t order[] = {0, 1, 2, 3, 4, 5, CHECK};
    for (unsigned step = 0; step < sizeof order; step++) {
        unsigned index = order[step];
        store->flash.program(store->flash.self, address + 4 * index, words[index]);
    }
    uint32_t written[CL_STORE_WORDS];
    load(store, address, written);
    return whole(written) && written[SEQUENCE] == words[SEQUENCE] && written[MARK] == BLANK;
}

static bool append(cl_store *store, const cl_saved *saved) {
    uint32_t words[CL_STORE_WORDS] = {MAGIC | (uint32_t)store->under << UNDER_SHIFT, store->sequence + 1};
    for (unsigned axis = 0; axis < CL_AXES; axis++) words[POSITION + axis] = (uint32_t)saved->position.at[axis];
    words[BOOT] = (saved->boot & BOOT_MASK) | (uint32_t)(saved->flags & FLAGS_MASK) << FLAGS_SHIFT |
                  (uint32_t)saved->known << KNOWN_SHIFT;
    words[MARK] = BLANK;
    words[CHECK] = checksum(words);
    for (unsigned tried = 0; tried < TRIES; tried++) {
        uint32_t address;
        if (!next_slot(store, &address)) return false;
        if (program(store, address, words)) {
            take(store, address, words);
            return true;
        }
    }
    return false;
}

void cl_store_tie(cl_store *store, uint16_t under) {
    store->under = under;
    if (store->last.under != under) store->last.known = false;
}

bool cl_store_boot(cl_store *store) {
    cl_saved saved = store->last;
    saved.boot = saved.boot + 1 + store->lost;
    if (saved.boot > BOOT_MASK) return false;
    if (!append(store, &saved)) return false;
    store->lost = 0;
    return true;
}

bool cl_store_save(cl_store *store, const cl_counts *position, bool known, uint8_t flags) {
    cl_saved saved = {*position, store->last.boot, flags, known, store->under};
    bool same = store->found && !store->marked && known == store->last.known && flags == store->last.flags &&
                store->under == store->last.under;
    for (unsigned axis = 0; axis < CL_AXES; axis++) {
        int64_t apart = (int64_t)position->at[axis] - store->last.position.at[axis];
        same = same && apart <= CL_STORE_NEAR && apart >= -CL_STORE_NEAR;
    }
    if (same) return true;
    return cl_store_moving(store) && append(store, &saved);
}

bool cl_store_moving(cl_store *store) {
    if (!store->found) return false;
    if (!store->marked) {
        store->flash.program(store->flash.self, store->newest + 4 * MARK, MOVING);
        store->marked = word_at(store, store->newest, MARK) != BLANK;
    }
    return store->marked;
}

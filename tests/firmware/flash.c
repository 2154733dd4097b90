/* Test bench for what is kept in two sectors of flash, positions or settings: power can fail in the middle of any operation. */
#include <stdlib.h>
#include <string.h>

#include "settings_store.h"
#include "store.h"

enum { SECTOR_WORDS = 256, WORDS = 2 * SECTOR_WORDS, FIRST = 0xF800, SECOND = 0xFC00 };

typedef struct {
    int64_t operations;  /* programmed words and erased sectors so far */
    int64_t cut_after;   /* power fails in the operation after so many, -1 for never */
    int32_t erases[2];
    int32_t misuse;      /* words programmed that were not blank */
    int32_t off;         /* power has failed */
    int32_t garbled;     /* whether the operation that was cut left a part of its work; 2: which then reads as it likes */
    uint32_t random;
    int32_t worn;        /* words of the flash that keep no bit: every so many-th, 0 for none */
    int32_t stuck;       /* the word that no erase makes blank, counted from 1, 0 for none */
    uint32_t words[WORDS];
    uint32_t unsure[WORDS]; /* bits that are neither programmed nor blank; may be programmed again */
    cl_store store;
    cl_settings_store settings;
} flash;

flash *flash_new(uint32_t seed);
void flash_free(flash *f);
void flash_open(flash *f);
bool flash_boot(flash *f);
bool flash_save(flash *f, const int32_t at[3], bool known, uint8_t flags);
bool flash_moving(flash *f);
bool flash_prepare(flash *f);
uint32_t flash_last(const flash *f, int32_t at[3], bool *known, uint8_t *flags);
uint32_t flash_newest(const flash *f);
size_t flash_size(void);
bool flash_settings(flash *f, bool restarted);
uint8_t flash_put(flash *f, const uint8_t *record);
uint8_t flash_request(flash *f);
uint8_t flash_keep(flash *f);
void flash_forget(flash *f);
uint32_t flash_under(const flash *f, uint8_t key[CL_KEY_BYTES]);
void flash_fill(flash *f, uint32_t at, const uint8_t *bytes, uint32_t length);

static uint32_t draw(flash *f) {
    uint32_t high = f->random = f->random * 1664525u + 1013904223u;
    f->random = f->random * 1664525u + 1013904223u;
    return (high & 0xFFFF0000u) | f->random >> 16;
}

/* Whether power lasts for one operation more; in the one in which it fails, what is left is a matter of chance. */
static bool powered(flash *f) {
    if (f->off) return false;
    f->off = f->cut_after >= 0 && f->operations >= f->cut_after;
    f->operations++;
    return !f->off;
}

static bool erase(void *self, uint32_t address) {
    flash *f = self;
    uint32_t *sector = f->words + (address - FIRST) / 4;
    bool was_off = f->off;
    if (powered(f)) {
        uint32_t left = f->stuck > 0 ? f->words[f->stuck - 1] : 0xFFFFFFFFu;
        memset(sector, 0xFF, 4 * SECTOR_WORDS);
        if (f->stuck > 0) f->words[f->stuck - 1] = left;
        memset(f->unsure + (sector - f->words), 0, 4 * SECTOR_WORDS);
        f->erases[(address - FIRST) / 1024]++;
        return true;
    }
    if (!was_off && f->garbled) {
        uint32_t how = draw(f) % 5; /* old words, blank ones, a mixture of both, noise, words in doubt */
        for (unsigned word = 0; word < SECTOR_WORDS; word++) {
            uint32_t noise = draw(f);
            if (how == 1 || (how == 2 && noise % 2)) sector[word] = 0xFFFFFFFFu;
            if (how == 3) sector[word] = noise;
            if (how == 2 && noise % 5 == 0) sector[word] |= noise;
            if (how == 4) f->unsure[(sector - f->words) + word] |= ~sector[word];
        }
    }
    return false;
}

static bool program(void *self, uint32_t address, uint32_t value) {
    flash *f = self;
    uint32_t index = (address - FIRST) / 4, *word = f->words + index;
    bool was_off = f->off;
    if (!f->off && *word != 0xFFFFFFFFu && f->unsure[index] == 0) f->misuse++;
    if (f->worn > 0 && index % (uint32_t)f->worn == 3) value |= 0x00010000u;
    if (powered(f)) {
        *word &= value;
        f->unsure[index] = 0;
        return *word == value;
    }
    if (!was_off && f->garbled) {
        uint32_t before = *word;
        *word &= value | draw(f);
        f->unsure[index] = before & ~value;
    }
    return false;
}

/* What bits in doubt read as: all of them blank, all programmed, or any. */
static uint32_t mood(flash *f) {
    uint32_t how = draw(f) % 3;
    return how == 0 ? 0xFFFFFFFFu : how == 1 ? 0 : draw(f);
}

static uint32_t fetch(void *self, uint32_t address) {
    flash *f = self;
    uint32_t index = (address - FIRST) / 4;
    return f->garbled == 2 && f->unsure[index] != 0 ? f->words[index] | (f->unsure[index] & mood(f)) : f->words[index];
}

flash *flash_new(uint32_t seed) {
    flash *f = calloc(1, sizeof *f);
    if (f == NULL) abort();
    f->random = seed * 2654435761u + 1;
    f->cut_after = -1;
    memset(f->words, 0xFF, sizeof f->words);
    return f;
}

void flash_free(flash *f) { free(f); }

/* Power comes back. */
void flash_open(flash *f) {
    const cl_flash hooks = {f, erase, program, fetch};
    f->off = 0;
    f->cut_after = -1;
    cl_store_open(&f->store, &hooks, FIRST, SECOND);
}

void flash_tie(flash *f, uint16_t under) { cl_store_tie(&f->store, under); }

bool flash_boot(flash *f) { return cl_store_boot(&f->store); }

bool flash_save(flash *f, const int32_t at[3], bool known, uint8_t flags) {
    cl_counts counts = {{at[0], at[1], at[2]}};
    return cl_store_save(&f->store, &counts, known, flags);
}

bool flash_moving(flash *f) { return cl_store_moving(&f->store); }

bool flash_prepare(flash *f) { return cl_store_prepare(&f->store); }

/* What the store remembers; its boot number. */
uint32_t flash_last(const flash *f, int32_t at[3], bool *known, uint8_t *flags) {
    memcpy(at, f->store.last.position.at, sizeof f->store.last.position.at);
    *known = f->store.last.known;
    *flags = f->store.last.flags;
    return f->store.last.boot;
}

uint32_t flash_newest(const flash *f) { return (f->store.newest - FIRST) / 4; }

/* Of all that the bench knows: who copies it can go back in time. */
size_t flash_size(void) { return sizeof(flash); }

/* The same two sectors with settings. Power comes back, or the program has restarted itself. */
bool flash_settings(flash *f, bool restarted) {
    const cl_flash hooks = {f, erase, program, fetch};
    f->off = 0;
    return cl_settings_open(&f->settings, &hooks, FIRST, SECOND, restarted);
}

uint8_t flash_put(flash *f, const uint8_t *record) { return cl_settings_put(&f->settings, record); }

uint8_t flash_request(flash *f) { return cl_settings_request(&f->settings); }

uint8_t flash_keep(flash *f) { return cl_settings_keep(&f->settings); }

void flash_forget(flash *f) { cl_settings_forget(&f->settings); }

/* The generation that the node runs under, more by 0x10000 on trial; its key. */
uint32_t flash_under(const flash *f, uint8_t key[CL_KEY_BYTES]) {
    memcpy(key, f->settings.now.master.bytes, CL_KEY_BYTES);
    return f->settings.now.generation | (uint32_t)f->settings.trial << 16;
}

/* What a programmer writes, whatever was there. */
void flash_fill(flash *f, uint32_t at, const uint8_t *bytes, uint32_t length) {
    memcpy((uint8_t *)f->words + at, bytes, length);
}

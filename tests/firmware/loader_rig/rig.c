/* Follows the text of firmware/loader/update.c in one file, so that it can forget its variables as a reset does. Power may
 * fail in any operation of the flash; what is left of that one is a matter of chance. */

enum { RIG_BYTES = 0x10000, RIG_SECTOR_WORDS = 256 };

typedef struct {
    int64_t operations; /* programmed words and erased sectors so far */
    int64_t cut_after;  /* power fails in the operation after so many, -1 for never */
    int32_t off;        /* power has failed */
    int32_t misuse;     /* words programmed that were not blank, while none was in doubt */
    uint32_t random;
    uint32_t words[RIG_BYTES / 4];
    uint8_t doubt[RIG_BYTES / 4]; /* words whose programming was cut short */
} rig_flash;

static rig_flash rig;
static uint8_t rig_cause;
uint32_t startup_noise;

void watchdog_main(void) {}
void nrf24_pins(void) {}
uint8_t reset_cause(void) { return rig_cause; }
uint32_t chip_id(void) { return 0x89ABCDEFu; }

rig_flash *rig_memory(void);
void rig_forget(void);
uint32_t rig_start(uint32_t noise, uint8_t cause);

rig_flash *rig_memory(void) { return &rig; }

static uint32_t rig_draw(void) {
    uint32_t high = rig.random = rig.random * 1664525u + 1013904223u;
    rig.random = rig.random * 1664525u + 1013904223u;
    return (high & 0xFFFF0000u) | rig.random >> 16;
}

static bool rig_powered(void) {
    if (rig.off) return false;
    rig.off = rig.cut_after >= 0 && rig.operations >= rig.cut_after;
    rig.operations++;
    return !rig.off;
}

bool flash_erase(uint32_t address) {
    uint32_t *sector = rig.words + address / 4;
    bool was_off = rig.off;
    if (rig_powered()) {
        memset(sector, 0xFF, SECTOR_BYTES);
        memset(rig.doubt + address / 4, 0, RIG_SECTOR_WORDS);
        return true;
    }
    uint32_t how = rig_draw() % 3; /* old words, a mixture of old and blank, any bits blank */
    for (unsigned word = 0; !was_off && how && word < RIG_SECTOR_WORDS; word++) {
        uint32_t noise = rig_draw();
        sector[word] |= how == 2 ? noise : noise % 2 ? 0xFFFFFFFFu : 0;
        rig.doubt[address / 4 + word] = 1;
    }
    return false;
}

bool flash_program(uint32_t address, uint32_t word) {
    uint32_t *cell = rig.words + address / 4;
    bool was_off = rig.off;
    if (!rig.off && *cell != 0xFFFFFFFFu && !rig.doubt[address / 4]) rig.misuse++;
    if (rig_powered()) {
        *cell &= word;
        rig.doubt[address / 4] = 0;
        return *cell == word;
    }
    if (!was_off) {
        *cell &= word | rig_draw();
        rig.doubt[address / 4] = 1;
    }
    return false;
}

uint32_t flash_word(uint32_t address) { return rig.words[address / 4]; }

const void *flash_at(uint32_t address) { return rig.words + address / 4; }

static bool rig_erase(void *self, uint32_t address) {
    (void)self;
    return flash_erase(address);
}

static bool rig_program(void *self, uint32_t address, uint32_t word) {
    (void)self;
    return flash_program(address, word);
}

static uint32_t rig_read(void *self, uint32_t address) {
    (void)self;
    return flash_word(address);
}

const cl_flash flash_hooks = {0, rig_erase, rig_program, rig_read};

#define FORGET(variable) memset(&(variable), 0, sizeof(variable))

/* A reset: memory is as at the beginning, the flash as it was; power is there. */
void rig_forget(void) {
    FORGET(number);
    FORGET(node_key);
    FORGET(node_tags);
    FORGET(nonce);
    FORGET(live);
    FORGET(offered);
    FORGET(handshake);
    FORGET(outcome);
    FORGET(last);
    FORGET(over);
    FORGET(sector);
    FORGET(held);
    FORGET(buffer);
    FORGET(update_answer);
    rig.off = 0;
}

/* Go on the air; the number of this boot, 0 if it stays off. */
uint32_t rig_start(uint32_t noise, uint8_t cause) {
    rig_cause = cause;
    startup_noise = noise;
    return update_start() != 0 ? nonce.boot : 0;
}


#include "update.h"

#include <string.h>

#include "bytes.h"
#include "flash.h"
#include "frames.h"
#include "layout.h"
#include "program.h"
#include "reset.h"
#include "settings_store.h"
#include "store.h"

/* Frames of an update. What is in them is in docs/radio-protocol.md. */
enum { PLACE_ASK = 240, PLACE_BEGIN, PLACE_FINISH, PLACE_LEAVE, PLACE_DESCRIPTION = 255 };
enum { OUTCOME_NONE, OUTCOME_DONE, OUTCOME_REFUSED, OUTCOME_FLASH, OUTCOME_DIGEST };
enum { SECTOR_ALL = 254, SECTOR_NONE = 255 }; /* instead of the sector that is wanted */
enum { DESCRIPTION_HELD = 3, PIECE_BYTES = 16, PIECES = 64, SECTOR_WORDS = 256, COUNTER_MASK = 0xFFFFFF, DIGEST_BYTES = 16, LEAST_LENGTH = 256 };

typedef struct {
    uint16_t number; /* 0 for none */
    cl_keyed key;
    uint32_t counter;
} update_session;

static uint8_t number;
static cl_key node_key;
static cl_keyed node_tags;
static cl_node_nonce nonce;
static update_session live, offered;
static uint64_t handshake; /* of the offer */
static uint8_t outcome, last; /* of the last thing that was to be done, and what that was */
static bool over;

/* The sector in hand, and which of its pieces are there. */
static uint8_t sector;
static uint64_t held;
static union {
    uint32_t words[SECTOR_WORDS];
    uint8_t bytes[SECTOR_BYTES];
} buffer;

uint8_t update_answer[NRF24_PAYLOAD_BYTES];

/* What is known of the program */

static const uint32_t *described(void) { return flash_at(DESCRIPTION); }

static bool is_set(uint32_t mark) { return flash_word(MARK(mark)) != BLANK_WORD; }

static bool set(uint32_t mark) { return is_set(mark) || flash_program(MARK(mark), 0); }

static bool makes_sense(const uint32_t *words) {
    uint32_t sum = 2166136261u;
    for (unsigned i = 1; i < DESCRIPTION_WORDS; i++) {
        sum = (sum ^ words[i]) * 16777619u;
    }
    uint32_t length = words[WORD_LENGTH];
    return sum == words[WORD_SUM] && length % 4 == 0 && length >= LEAST_LENGTH && length <= PROGRAM_END - PROGRAM_BEGIN &&
           words[WORD_SETTINGS] == SETTINGS_LAYOUT;
}

bool update_runnable(void) {
    return makes_sense(described()) && is_set(MARK_WHOLE) && (is_set(MARK_KEPT) || !is_set(MARK_TRIED));
}

bool update_kept(void) { return is_set(MARK_KEPT); }

bool update_try(void) { return set(MARK_TRIED); }

/* The first sector that is not there yet. */
static uint8_t wanted(void) {
    const uint32_t *words = described();
    if (!makes_sense(words)) {
        return SECTOR_NONE;
    }
    for (uint32_t at = 0; at * SECTOR_BYTES < words[WORD_LENGTH]; at++) {
        if (!is_set(at)) {
            return (uint8_t)at;
        }
    }
    return SECTOR_ALL;
}

static void look_again(void) {
    sector = wanted();
    held = 0;
}

/* What a host orders */

/* The sum comes last: a description that was cut short makes no sense. */
static bool describe(const uint32_t *words) {
    bool good = flash_erase(DESCRIPTION);
    for (unsigned i = DESCRIPTION_WORDS; i-- > 0 && good;) {
        good = flash_program(DESCRIPTION + 4 * i, words[i]);
    }
    return good;
}

/* The same description again goes on with what is there, unless that was started already and nobody has heard it. */
static uint8_t begin(void) {
    uint32_t words[DESCRIPTION_WORDS];
    memcpy(words, buffer.words, sizeof words);
    if (sector != SECTOR_NONE) {
        return OUTCOME_DONE; /* said once more */
    }
    if (held != DESCRIPTION_HELD || !makes_sense(words)) {
        return OUTCOME_REFUSED;
    }
    bool same = memcmp(words, described(), sizeof words) == 0 && (is_set(MARK_KEPT) || !is_set(MARK_TRIED));
    bool good = same || describe(words);
    look_again();
    return good ? OUTCOME_DONE : OUTCOME_FLASH;
}

static bool write_sector(void) {
    uint32_t address = PROGRAM_BEGIN + SECTOR_BYTES * sector;
    bool good = flash_erase(address);
    for (unsigned i = 0; i < SECTOR_WORDS && good; i++) {
        good = buffer.words[i] == BLANK_WORD || flash_program(address + 4 * i, buffer.words[i]);
        watchdog_main();
    }
    return good && set(sector);
}

static bool is_as_described(void) {
    const uint32_t *words = described();
    uint8_t digest[DIGEST_BYTES];
    const cl_bytes program = {flash_at(PROGRAM_BEGIN), words[WORD_LENGTH]};
    cl_blake2s((cl_bytes){node_key.bytes, CL_KEY_BYTES}, program, digest, sizeof digest);
    return memcmp(digest, words + WORD_DIGEST, sizeof digest) == 0;
}

/* One that is not what it should be is given up as a whole: nobody can tell which sector is to blame. The order may come
 * several times; the digest takes half of what the watchdog allows, and an erase may take as much. */
static uint8_t finish(void) {
    if (wanted() != SECTOR_ALL) {
        return OUTCOME_REFUSED;
    }
    if (is_set(MARK_WHOLE)) {
        return OUTCOME_DONE;
    }
    watchdog_main();
    if (!is_as_described()) {
        watchdog_main();
        flash_erase(DESCRIPTION);
        look_again();
        return OUTCOME_DIGEST;
    }
    return set(MARK_WHOLE) ? OUTCOME_DONE : OUTCOME_FLASH;
}

static void take_piece(uint8_t place, uint8_t piece, const uint8_t *data) {
    if (place == PLACE_DESCRIPTION && sector != SECTOR_NONE) {
        sector = SECTOR_NONE; /* another beginning: what was collected of a sector is forgotten */
        held = 0;
    }
    if (place != sector || piece >= PIECES) {
        return;
    }
    memcpy(buffer.bytes + PIECE_BYTES * piece, data, PIECE_BYTES);
    held |= (uint64_t)1 << piece;
    if (sector < SECTORS && held == UINT64_MAX) {
        last = sector;
        outcome = write_sector() ? OUTCOME_DONE : OUTCOME_FLASH;
        look_again();
    }
}

static uint8_t leave(void) {
    over = update_runnable();
    return over ? OUTCOME_DONE : OUTCOME_REFUSED;
}

static void obey(const uint8_t *payload) {
    uint8_t place = payload[1];
    if (place < SECTORS || place == PLACE_DESCRIPTION) {
        take_piece(place, payload[7], payload + 8);
    } else if (place == PLACE_BEGIN || place == PLACE_FINISH || place == PLACE_LEAVE) {
        last = place;
        outcome = place == PLACE_BEGIN ? begin() : place == PLACE_FINISH ? finish() : leave();
    }
}

/* Who may order it */

static bool tagged(const uint8_t *payload, const update_session *session) {
    uint8_t tag[CL_TAG_BYTES], wrong = 0;
    cl_tag(&session->key, payload, 0, CL_FROM_HOST, tag);
    for (unsigned i = 0; i < CL_TAG_BYTES; i++) {
        wrong |= (uint8_t)(tag[i] ^ payload[CL_BODY_BYTES + i]);
    }
    return wrong == 0;
}

static bool names(const uint8_t *payload, const update_session *session) {
    return session->number != 0 && session->number == cl_session_of(payload) && tagged(payload, session);
}

/* Whether a frame is of the live session, or makes the offered one live. */
static bool admitted(const uint8_t *payload) {
    if (names(payload, &live)) {
        return true;
    }
    if (!names(payload, &offered)) {
        return false;
    }
    live = offered;
    offered.number = 0;
    outcome = OUTCOME_NONE;
    last = PLACE_ASK;
    look_again();
    return true;
}

static bool renew_offer(const cl_hello_frame *hello, uint64_t fresh) {
    if (nonce.offers == CL_OFFERS_END - 1) {
        return false;
    }
    nonce.offers++;
    handshake = fresh;
    cl_key key;
    cl_session_key(&key, &node_key, &(cl_handshake){fresh, nonce, hello->run_tag});
    cl_tag_key(&offered.key, &key);
    offered.number = cl_session_number(&nonce);
    offered.counter = 0;
    return true;
}

/* Of its program's state the loader knows nothing. */
static void report(uint64_t fresh) {
    const cl_report_frame said = {
        .node = number,
        .cause = reset_cause(),
        .boot = nonce.boot,
        .now.state = CL_STATE_BOOT,
        .axes.of = {CL_NOT_HOMED, CL_NOT_HOMED, CL_NOT_HOMED},
    };
    cl_encode_report(update_answer, &said, &node_tags, fresh);
}

/* An offer like the program's, from a node in the state that the program never is in. */
static void on_hello(const uint8_t *payload, int64_t now_ms) {
    cl_hello_frame hello;
    if (cl_decode_hello(payload, &node_tags, &hello) != CL_GOOD || hello.node != number) {
        return;
    }
    uint64_t fresh = hello.nonce & ~(uint64_t)CL_ATTEMPT_MASK;
    if ((hello.flags & CL_FLAG_QUERY) != 0) {
        report(fresh);
        return;
    }
    bool repeated = offered.number != 0 && handshake == fresh;
    if (repeated || renew_offer(&hello, fresh)) {
        const cl_ident_frame ident = {
            .node = number,
            .session = offered.number,
            .nonce = nonce,
            .clock = cl_clock_of(now_ms),
            .state = CL_STATE_BOOT,
        };
        cl_encode_ident(update_answer, &ident, &node_tags, fresh);
    }
}

static void say(void) {
    uint8_t marks = (uint8_t)(is_set(MARK_WHOLE) | is_set(MARK_TRIED) << 1 | is_set(MARK_KEPT) << 2);
    memset(update_answer, 0, sizeof update_answer);
    update_answer[0] = CL_VERSION << 4 | CL_KIND_PROGRESS;
    update_answer[1] = number;
    cl_put16(update_answer + 2, live.number);
    cl_put32(update_answer + 4, live.counter);
    cl_put64(update_answer + 8, held);
    update_answer[16] = sector;
    update_answer[17] = outcome;
    update_answer[18] = marks;
    update_answer[19] = last;
    cl_put32(update_answer + 20, flash_word(DESCRIPTION));
    cl_tag(&live.key, update_answer, 0, CL_FROM_NODE, update_answer + CL_BODY_BYTES);
}

void update_receive(const uint8_t *payload, uint8_t length, int64_t now_ms) {
    if (length != CL_FRAME_BYTES || payload[0] >> 4 != CL_VERSION) {
        return;
    }
    if ((payload[0] & 15u) == CL_KIND_HELLO) {
        on_hello(payload, now_ms);
    } else if ((payload[0] & 15u) == CL_KIND_UPDATE && admitted(payload)) {
        uint32_t counter = cl_get32(payload + 4) & COUNTER_MASK;
        if (counter > live.counter) {
            live.counter = counter;
            obey(payload);
        }
        say();
    }
}

bool update_over(void) { return over; }

/* Who the node is */

/* Of settings it takes those that a boot without a trial runs under. */
const cl_listening *update_start(void) {
    static cl_settings_store settings;
    static cl_store store;
    look_again();
    if (!cl_settings_open(&settings, &flash_hooks, FLASH_SETTINGS_A, FLASH_SETTINGS_B, false)) {
        return 0;
    }
    cl_store_open(&store, &flash_hooks, FLASH_STORE_A, FLASH_STORE_B);
    cl_store_tie(&store, cl_settings_sum(&settings.now));
    if (!cl_store_boot(&store)) {
        return 0;
    }
    number = settings.now.number;
    nonce = (cl_node_nonce){.boot = store.last.boot, .noise = startup_noise};
    cl_node_key(&node_key, &settings.now.master, chip_id());
    cl_tag_key(&node_tags, &node_key);
    nrf24_pins();
    return &settings.now.radio;
}

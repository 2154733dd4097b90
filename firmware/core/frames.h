/* Bytes <-> messages of the link protocol, docs/radio-protocol.md: the frames that a node takes and gives.
   The names and numbers below are those of curveline/radio/protocol/codes.py and frames.py; a test compares every one of them. */
#ifndef CL_FRAMES_H
#define CL_FRAMES_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "keys.h"

#define CL_VERSION 2
#define CL_FRAME_BYTES 32
#define CL_BODY_BYTES 24
#define CL_EVERY_NODE 0xFF
#define CL_COUNTER_END 0x80000000u
#define CL_HOLD_END 254
#define CL_TARGET_LIMIT 8388607
#define CL_POSITION_UNIT 8
#define CL_POSITION_LIMIT 262136
#define CL_DEADMAN_UNIT_MS 50
#define CL_CLOCK_SHIFT 6     /* a node's clock ticks every 64 ms of the time since it was switched on */
#define CL_DRIVE_CLOCK_BITS 8
#define CL_BOOT_END 0x1000000u
#define CL_OFFERS_END 0x100000000u
#define CL_NOT_HOMED 15      /* in the place of a fault: nobody has homed the axis, or it is being homed */
#define CL_ALL_AXES 7
#define CL_ATTEMPT_MASK 0xFF
#define CL_WHO 0 /* the one page there is */
#define CL_SERVICE_DEADMAN_MS 300 /* a jog or a turn is refused to a host that may be silent for longer */
#define CL_BLINK_MS 1000
#define CL_UNHOMED_COUNTS 5000 /* how far an axis that is not homed may be jogged, a quarter of its travel if that is less */
#define CL_TURN_DUTY 350       /* thousandths; a turn is at most so strong, so long, and of that duration */
#define CL_TURN_COUNTS 1000
#define CL_TURN_MS 1500
#define CL_TRACE_SAMPLES 64 /* counts of a turned axis that a node keeps */
#define CL_TRACE_MS 4
#define CL_READING_SAMPLES 6
#define CL_PIECES 6 /* that settings come in */
#define CL_PIECE_BYTES 14
#define CL_ALL_PIECES 63
#define CL_TRIAL_MS 30000 /* how long a node runs under other settings, unless it is told to keep them */

enum { CL_FLAG_TAKEOVER = 1, CL_FLAG_RESUME = 2, CL_FLAG_QUERY = 4, CL_FLAG_CLEAR = 8 };

enum {
    CL_KIND_DRIVE = 1,
    CL_KIND_STATUS = 2,
    CL_KIND_HELLO = 3,
    CL_KIND_IDENT = 4,
    CL_KIND_PAGE = 5,
    CL_KIND_STOP = 6,
    CL_KIND_ESTOP = 7,
    CL_KIND_REPORT = 8,
    CL_KIND_HOME = 9,
    CL_KIND_SERVICE = 10,
    CL_KIND_READING = 11,
    CL_KIND_SETTINGS = 12,
    CL_KIND_UPDATE = 13, /* these two are the loader's */
    CL_KIND_PROGRESS = 14,
};

/* What a SERVICE asks for; from JOG on it is an order. */
enum {
    CL_OPERATION_LOOK = 0,
    CL_OPERATION_BLINK = 1,
    CL_OPERATION_JOG = 2,
    CL_OPERATION_TURN = 3,
    CL_OPERATION_PLACE = 4,
};

/* What a SETTINGS brings or asks for; all but a piece are orders. */
enum {
    CL_SETTINGS_PIECE = 0,
    CL_SETTINGS_STORE = 1,
    CL_SETTINGS_TRY = 2,
    CL_SETTINGS_KEEP = 3,
    CL_SETTINGS_DROP = 4,
    CL_SETTINGS_LOADER = 5,
};

enum {
    CL_PAGE_MOTORS = 0,
    CL_PAGE_AXIS = 1,
    CL_PAGE_LIMITS = 2,
    CL_PAGE_TRACE = 3,
    CL_PAGE_SETTINGS = 4,
};

/* What became of the last order of a SERVICE or a SETTINGS; from HELD on, why it was refused. */
enum {
    CL_OUTCOME_NONE = 0,
    CL_OUTCOME_BUSY = 1,
    CL_OUTCOME_DONE = 2,
    CL_OUTCOME_ENDED = 3,
    CL_OUTCOME_FAILED = 4,
    CL_OUTCOME_HELD = 5,
    CL_OUTCOME_UNHOMED = 6,
    CL_OUTCOME_BEYOND = 7,
    CL_OUTCOME_FAULTY = 8,
    CL_OUTCOME_OCCUPIED = 9,
    CL_OUTCOME_DEADMAN = 10,
};

/* Lines of a READING: the switches are bits 0 to 2, closed for 1. */
enum { CL_LINE_DRIVER = 8, CL_LINE_TURNING = 16, CL_LINE_AWAKE = 32 };

enum {
    CL_STATE_BOOT = 0,
    CL_STATE_UNHOMED = 1,
    CL_STATE_HOMING = 2,
    CL_STATE_READY = 3,
    CL_STATE_MOVING = 4,
    CL_STATE_HOLD = 5,
    CL_STATE_HOLD_LINK = 6,
    CL_STATE_FAULT = 7,
    CL_STATE_POSITION_LOST = 8,
    CL_STATE_ESTOP = 9,
};

enum {
    CL_FAULT_NONE = 0,
    CL_FAULT_CONFLICT = 1,
    CL_FAULT_LIMIT = 2,
    CL_FAULT_STALL = 3,
    CL_FAULT_RUNAWAY = 4,
    CL_FAULT_ENCODER = 5,
    CL_FAULT_DRIVER = 6,
    CL_FAULT_BROWN_OUT = 7,
};

/* Why a node started last. */
enum {
    CL_CAUSE_UNKNOWN = 0,
    CL_CAUSE_POWER_ON = 1,
    CL_CAUSE_PIN = 2,
    CL_CAUSE_LOW_VOLTAGE = 3,
    CL_CAUSE_WATCHDOG = 4,
    CL_CAUSE_HANG = 5,
    CL_CAUSE_SOFTWARE = 6,
};

/* What a payload turns out to be when it is looked at as a certain frame. */
typedef enum { CL_GOOD, CL_REJECT_KIND, CL_REJECT_TAG, CL_REJECT_FIELD } cl_verdict;

enum { CL_AXES = 3 };

typedef struct {
    int32_t at[CL_AXES]; /* encoder counts: extrude, bias, translate */
} cl_counts;

/* Why an axis is not homed: CL_NOT_HOMED or a fault, 0 if it is. */
typedef struct {
    uint8_t of[CL_AXES];
} cl_reasons;

typedef struct {
    int64_t clock; /* newest time of the node that its host had heard [ticks] */
    uint32_t counter;
    uint16_t release, load_step;
    cl_counts target;
    uint16_t move_ms;
    uint8_t hold_gen;
} cl_drive_frame;

typedef struct {
    uint8_t node;
    uint32_t counter;
} cl_estop_frame;

typedef struct {
    int64_t clock;
    uint32_t counter;
    uint8_t axes, order;
} cl_home_frame;

typedef struct {
    int64_t clock;
    uint32_t counter;
    uint8_t operation, order;
    uint8_t axis; /* from 1, 0 for none */
    uint8_t page;
    bool unhomed, at_once;
    int32_t amount;
    uint16_t rate, span;
} cl_service_frame;

typedef struct {
    int64_t clock;
    uint32_t counter;
    uint8_t operation;
    uint8_t index; /* number of the piece, from 0, or the order */
    uint8_t piece[CL_PIECE_BYTES];
} cl_settings_frame;

typedef struct {
    uint8_t node;
    uint64_t nonce, run_tag;
    uint16_t deadman_ms;
    uint8_t flags;
} cl_hello_frame;

typedef struct {
    uint8_t node, page;
    uint64_t nonce;
} cl_ask_frame;

/* What a STATUS and a REPORT have in common. */
typedef struct {
    uint16_t finished, started, staged;
    uint8_t state, hold_low, fault, fault_axis;
    cl_counts position;
} cl_condition;

typedef struct {
    uint8_t node;
    uint16_t session;
    uint32_t echo;
    int64_t clock;
    cl_condition now;
} cl_status_frame;

typedef struct {
    uint8_t node, cause;
    uint32_t boot;
    cl_condition now;
    cl_reasons axes;
    uint16_t fault_s;
    bool stopped, turning, on_trial;
} cl_report_frame;

typedef struct {
    uint8_t node;
    uint16_t session;
    cl_node_nonce nonce;
    int64_t clock;
    uint16_t config_hash;
    uint8_t state;
    bool same_run, busy, stopped, on_trial;
} cl_ident_frame;

typedef struct {
    uint8_t node;
    uint32_t chip, firmware, boot;
    uint16_t config_hash;
    uint8_t state;
    uint16_t bad_tags, old_frames;
} cl_page_frame;

/* What all pages of a READING have. */
typedef struct {
    uint8_t node;
    uint16_t session;
    uint32_t echo;
    int64_t clock;
    uint8_t page, outcome;
    uint8_t index; /* the last order, the axis or the first sample, as the page has it */
} cl_reading_frame;

typedef struct {
    cl_counts counts;
    uint8_t lines;
    uint16_t supply_mv; /* 0 if the chip cannot tell */
} cl_motor_facts;

typedef struct {
    uint8_t axis; /* from 1 */
    uint16_t missed;
    int16_t duty;       /* thousandths */
    uint16_t lag;       /* counts */
    uint16_t threshold; /* thousandths */
    uint8_t samples;
    uint16_t step;
} cl_axis_facts;

typedef struct {
    uint8_t pieces; /* held, bit 0 for the first */
    bool on_trial;
    uint8_t left_s; /* of the trial */
    uint16_t generation;
    uint16_t stored; /* generation that is stored and was not tried, the same as the other if there is none */
} cl_settings_facts;

/* What the first byte says a payload is, 0 if it can be no frame of this version; nothing is verified yet. */
uint8_t cl_kind_of(const uint8_t *payload, size_t length);

/* Ticks of a node's clock so long after it was switched on. */
int64_t cl_clock_of(int64_t now_ms);

/* The session that a DRIVE, a HOME, a SERVICE, a SETTINGS or an ESTOP names. */
uint16_t cl_session_of(const uint8_t payload[CL_FRAME_BYTES]);

/* Decoders read CL_FRAME_BYTES and write `frame` only when they return CL_GOOD; `now` is the node's time [ticks]. */
cl_verdict cl_decode_drive(const uint8_t *payload, const cl_keyed *key, int64_t now, cl_drive_frame *frame);
cl_verdict cl_decode_home(const uint8_t *payload, const cl_keyed *key, int64_t now, cl_home_frame *frame);
cl_verdict cl_decode_service(const uint8_t *payload, const cl_keyed *key, int64_t now, cl_service_frame *frame);
/* `secret` is the key that `key` was made of: pieces are hidden with it. */
cl_verdict cl_decode_settings(
    const uint8_t *payload, const cl_keyed *key, const cl_key *secret, int64_t now, cl_settings_frame *frame
);
cl_verdict cl_decode_estop(const uint8_t *payload, const cl_keyed *key, cl_estop_frame *frame);
cl_verdict cl_decode_hello(const uint8_t *payload, const cl_keyed *key, cl_hello_frame *frame);
cl_verdict cl_decode_ask(const uint8_t *payload, const cl_keyed *key, cl_ask_frame *frame);
cl_verdict cl_decode_stop(const uint8_t *payload, const cl_keyed *key);

/* Encoders fill CL_FRAME_BYTES; the tag covers `nonce` too, unless it is 0, that of a STATUS the whole clock. */
void cl_encode_status(uint8_t *payload, const cl_status_frame *frame, const cl_keyed *key);
void cl_encode_report(uint8_t *payload, const cl_report_frame *frame, const cl_keyed *key, uint64_t nonce);
void cl_encode_ident(uint8_t *payload, const cl_ident_frame *frame, const cl_keyed *key, uint64_t nonce);

/* The facts of a page, which come first, and the READING around them. */
void cl_put_motor_facts(uint8_t *payload, const cl_motor_facts *facts);
void cl_put_axis_facts(uint8_t *payload, const cl_axis_facts *facts);
void cl_put_limit_facts(uint8_t *payload, const int32_t limits[4]);
void cl_put_settings_facts(uint8_t *payload, const cl_settings_facts *facts);
void cl_put_samples(uint8_t *payload, const int16_t samples[CL_READING_SAMPLES]);
void cl_encode_reading(uint8_t *payload, const cl_reading_frame *frame, const cl_keyed *key);
void cl_encode_page(uint8_t *payload, const cl_page_frame *frame, const cl_keyed *key, uint64_t nonce);

#endif

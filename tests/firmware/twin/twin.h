/* What the comparison of the C node with node.py exchanges with Python: a start, events, and what came of them.
   twin.py has the same layouts as struct formats; there is no padding. */
#ifndef TWIN_H
#define TWIN_H

#include "node.h"
#include "settings_record.h"

/* What an event is. */
enum {
    TWIN_RECEIVE,
    TWIN_ADVANCE,
    TWIN_NOTICE,
    TWIN_START_HOMING, /* of the axes args[0] */
    TWIN_STOP_HOMING,
    TWIN_SHIFT,  /* the axes are pushed by args */
    TWIN_SETTLE, /* the plant will settle args[1] ms from now, if args[0], or does not know when */
    TWIN_FAULT,  /* fault args[0] (0: none) of axis args[1] comes args[2] ms from now */
    TWIN_SEARCH, /* the search, or the turn, ends args[1] ms from now, if args[0], for reasons of 4 bits per axis in args[2] */
    TWIN_EVENTS,
};

/* Why a frame was made; only for counting what the sequences reach. */
enum {
    TWIN_DRIVE,
    TWIN_HOME,
    TWIN_SERVICE,
    TWIN_SETTINGS,
    TWIN_ESTOP,
    TWIN_STOP,
    TWIN_HELLO,
    TWIN_REPEATED_HELLO,
    TWIN_QUERY,
    TWIN_PAGE,
    TWIN_NO_NODES_FRAME, /* a STATUS, an IDENT or a kind that does not exist */
    TWIN_FRAMES,
};

/* What was done to a frame afterwards. */
enum {
    TWIN_UNSPOILED,
    TWIN_FLIPPED_BIT,
    TWIN_FORGED_TAG,
    TWIN_REPLAYED,
    TWIN_OTHER_NODE,
    TWIN_OTHER_SESSION,
    TWIN_ODD_FIELD, /* rightly signed, but a field says what none may say */
    TWIN_CUT_SHORT,
    TWIN_OLD_CLOCK, /* of a DRIVE, a HOME, a SERVICE or a SETTINGS: rightly signed, but a dead-man time or more ago */
    TWIN_FUTURE_CLOCK,
    TWIN_WRAPPED_CLOCK, /* so old that its low bits come again */
    TWIN_SPOILS,
};

typedef struct {
    int64_t heard_ms;
    uint64_t handshake, run_tag;
    uint8_t key[CL_KEY_BYTES];
    uint32_t counter;
    uint16_t number, release, deadman_ms;
    uint8_t flags, hold_gen, exists, closed, owns_run, order;
} twin_session;

typedef struct {
    int64_t now_ms, window_ms, deaf_until_ms, fault_ms;
    uint64_t run_tag;
    twin_session live, offered;
    int32_t target[3], next_target[3], place[3];
    int32_t move_ms;
    int32_t lag_ms; /* how long the plant settles after a move, -1 if it never knows */
    int32_t seek_ms; /* how long the plant searches or turns, -1 if it does not know */
    int32_t trial_ms; /* how long a trial goes on, 0: as long as one does that begins */
    uint32_t noise, boot, offers;
    uint16_t finished, started, staged, next_ms, bad_tags, old_frames;
    uint8_t unhomed[3], found[3]; /* found: what a search comes to, if no event says otherwise */
    uint8_t homing, estop, fault, fault_axis, cause, silent, stopped, lift_above, in_window, who, axes, turning;
    uint8_t on_trial, pieces, keeps; /* keeps: what becomes of orders about settings */
    uint8_t events, zeros[6];
} twin_start;

typedef struct {
    int64_t now_ms;
    uint8_t payload[CL_FRAME_BYTES];
    int32_t args[4];
    uint8_t what, length, frame, spoil, zeros[4];
} twin_event;

/* After every event. */
typedef struct {
    uint8_t ack[CL_FRAME_BYTES];
    int32_t setpoint[3];
    uint8_t ack_length, state;
    uint16_t loads; /* how often an answer was loaded */
} twin_short;

/* After the last event of a sequence. */
typedef struct {
    int64_t next_ms, move_start_ms, heard_ms, window_ms, deaf_until_ms, fault_ms, blink_until_ms, trial_ends_ms;
    uint64_t run_tag;
    int32_t target[3], next_target[3], plant_start[3], plant_target[3];
    int32_t move_ms, duration_ms, ramp_ms, brake_ms;
    int32_t turn[4]; /* axis, and 256 at once; duty, counts, ms */
    uint32_t noise, counter, floods, follows, boot, offers, seeks, give_ups, turns, places;
    uint16_t finished, started, staged, next_step_ms, bad_tags, old_frames, number, release, offered;
    uint8_t unhomed[3], sought, homing, estop, fault, fault_axis, moving, silent, stopped, lift_above, hold_gen, closed;
    uint8_t in_window, owns_run, order, jogging, turning, outcome;
    uint8_t on_trial, leaves, pieces, stores, requests, keeps, drops;
    uint8_t record[CL_SETTINGS_BYTES]; /* that was stored last */
    uint8_t zeros[7];
} twin_full;

_Static_assert(sizeof(twin_session) == 56 && sizeof(twin_start) == 256 && sizeof(twin_event) == 64, "no padding");
_Static_assert(sizeof(twin_short) == 48 && sizeof(twin_full) == 328, "no padding");

/* Axes that follow a move exactly and do besides what the events say; twin.py has the same. */
typedef struct {
    cl_move move;
    int64_t start_ms, settles_ms;
    cl_counts place, shift;
    cl_plant_fault fault;
    cl_sought search;
    cl_reasons found;
    cl_turn turn;
    int64_t turned_ms;
    int32_t lag_ms, seek_ms;
    uint32_t follows, seeks, give_ups, turns, places;
    uint8_t stores, requests, keeps, drops;
    uint8_t told;     /* what becomes of orders about settings */
    uint8_t record[CL_SETTINGS_BYTES]; /* that was stored last */
    bool on_trial;
    uint8_t sought; /* the axes of the last search */
    bool following, settle_known, fault_known, search_known, turned_known;
} twin_plant;

typedef struct {
    cl_node node;
    twin_plant plant;
} twin;

extern const cl_axis_limits twin_axes[4][CL_AXES];
extern const cl_identity twin_identities[3];

void twin_begin(twin *it, const twin_start *start);
void twin_do(twin *it, const twin_event *event);
void twin_look(const twin *it, int64_t now_ms, twin_short *seen);
void twin_look_closely(const twin *it, twin_full *seen);

/* How often the sequences made so far came to what: a name and a number per line. */
void twin_note(const twin *before, const twin *after, const twin_event *event);

enum { TWIN_MOST_EVENTS = 12 };

/* A random sequence: `start`, and up to TWIN_MOST_EVENTS events, whose number is in `start->events`. */
void twin_generate(uint64_t seed, twin_start *start, twin_event *events);

#endif

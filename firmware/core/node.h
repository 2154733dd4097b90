/* A node of the link protocol: frames and milliseconds go in, one loaded answer comes out.
   curveline/radio/node/machine.py is its specification and must give the same answers; the rules are those of
   docs/radio-protocol.md, in the order given there. */
#ifndef CL_NODE_H
#define CL_NODE_H

#include "frames.h"
#include "motion.h"
#include "plant.h"

/* More than CL_FLOOD bad tags within the window that the first of them opens make a node ignore frames for so long. */
#define CL_FLOOD 50
#define CL_FLOOD_WINDOW_MS 1000
#define CL_DEAF_MS 100

/* The hold generation with which a host lets go the nodes that it has taken over under a hold. */
#define CL_LIFT 2

typedef struct {
    uint8_t number; /* in the row, from 1 */
    uint32_t chip, firmware;
    cl_key master;
} cl_identity;

/* What a node knows besides its session; `target` belongs to the started step, `next_target` to the staged one. */
typedef struct {
    uint64_t run_tag;
    int64_t fault_ms;   /* when `fault` was met */
    cl_node_nonce nonce; /* of the session that was offered last */
    uint8_t cause;      /* CL_CAUSE_... */
    cl_reasons unhomed;
    uint8_t homing;     /* axes that are finding their zeros now, bit 0 for the first */
    bool estop;
    uint8_t fault, fault_axis;
    uint16_t finished, started, staged;
    uint16_t next_ms;
    int32_t move_ms;
    cl_counts target, next_target;
} cl_memory;

/* One host's claim on the node, offered or live. */
typedef struct {
    int64_t heard_ms;
    uint64_t handshake, run_tag; /* of the HELLO that it began with, as are the next two */
    uint16_t deadman_ms;
    uint8_t flags;
    uint8_t hold_gen;
    uint16_t number, release;
    uint32_t counter;
    cl_key secret;
    cl_keyed key; /* made of it */
    bool exists, closed;
    bool owns_run; /* the run that the node remembers is this host's: it was resumed, or has staged a step here */
    bool stopped; /* somebody stopped the node after this was offered: taking it up does not end that */
    uint8_t order;
} cl_session;

/* What a node counts for diagnosis; the two that are reported saturate. */
typedef struct {
    uint16_t bad_tags, old_frames;
    uint32_t floods;
    int64_t window_ms, deaf_until_ms;
    uint8_t in_window;
} cl_tally;

typedef struct {
    uint8_t number;
    uint32_t chip, firmware;
    uint16_t config_hash;
    cl_key key;
    cl_keyed node_key, stop_key, open_key;
    cl_axis_limits axes[CL_AXES];
    cl_plant plant;
    cl_memory memory;
    cl_tally tally;
    cl_session session, pending;
    cl_move move;
    int64_t move_start_ms;
    int64_t next_ms; /* when time alone will change something */
    int64_t trial_ends_ms;
    int64_t blink_until_ms; /* the lamp is to flicker until then */
    uint8_t lift_above;
    uint8_t outcome; /* CL_OUTCOME_... of the last order of a SERVICE or a SETTINGS */
    bool moving, booted, silent, stopped;
    bool jogging; /* the move is an errand's, not a step's */
    bool turning; /* a motor turns without a loop */
    bool on_trial; /* under its settings */
    bool leaves;  /* it is about to start anew: it does nothing and hears nothing until then */
    uint8_t pieces; /* of other settings that came in this session, bit 0 for the first */
    uint8_t record[CL_PIECES * CL_PIECE_BYTES];
    uint8_t ack[CL_FRAME_BYTES];
    uint8_t ack_length;  /* CL_FRAME_BYTES, or 0 as long as nobody has asked */
    uint32_t ack_serial; /* counts up whenever a new answer was loaded */
} cl_node;

void cl_node_init(
    cl_node *node, const cl_identity *identity, const cl_axis_limits axes[CL_AXES], cl_plant plant,
    const cl_memory *memory
);

/* CL_STATE_...: the most severe of the things that are true. */
uint8_t cl_node_state(const cl_node *node);

/* Where the axes should be now. */
void cl_node_setpoint(const cl_node *node, int64_t now_ms, cl_counts *counts);

/* Let time pass up to `now_ms`: arrivals, faults of the plant and the dead-man happen at their own moment. */
void cl_node_advance(cl_node *node, int64_t now_ms);

/* Take a payload from the radio; anything but a good frame changes nothing. */
void cl_node_receive(cl_node *node, int64_t now_ms, const uint8_t *payload, size_t length);

/* The plant has news, an arrival, a fault or the end of a search that it could not foretell. */
void cl_node_notice(cl_node *node, int64_t now_ms);

/* Whether the node knows where all its axes are. */
bool cl_homed(const cl_memory *memory);

/* A person or a host asks the idle node to find the zeros of `axes` (bit 0 for the first). Their positions are void from
   now on, and with them what the node has done of its run. */
void cl_node_start_homing(cl_node *node, int64_t now_ms, uint8_t axes);

/* A person wants the homing to end; what has not found its zero stays without. */
void cl_node_stop_homing(cl_node *node, int64_t now_ms);

#endif

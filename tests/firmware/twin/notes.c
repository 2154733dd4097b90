/* Counts what the sequences reach, so that the comparison can be shown not to be about nothing. */
#include <string.h>

#include "twin.h"

enum {
    SET_OFF,
    BRAKED,
    STAGED,
    STARTED,
    FINISHED,
    WENT_ON_AFTER_REST,
    FELL_SILENT,
    LIFTED,
    HELD,
    CLOSED_BY_HOST,
    CLOSED_BY_COUNTER,
    TOOK_OVER_AFRESH,
    RESUMED,
    TOOK_OVER_IN_MOTION,
    REFUSED_AS_BUSY,
    CLEARED_FAULT,
    KEPT_LOST_POSITION,
    BAD_TAG,
    OLD_COUNTER,
    FLOODED,
    WAS_DEAF,
    NEW_OFFER,
    SAME_OFFER,
    ANSWERED_QUERY,
    ANSWERED_PAGE,
    STOPPED,
    STOPPED_FOR_GOOD,
    BEGAN_HOMING,
    ENDED_HOMING,
    HOMING_FOUND_POSITION,
    CONFLICT_OF_STAGED,
    SEVERAL_WAKES,
    OUTCOMES,
};

static const char *const names[OUTCOMES] = {
    "set off", "braked", "staged", "started", "finished", "went on after rest", "fell silent", "lifted", "held",
    "closed by host", "closed by counter", "took over afresh", "resumed", "took over in motion", "refused as busy",
    "cleared fault", "kept lost position", "bad tag", "old counter", "flooded", "was deaf", "new offer", "same offer",
    "answered query", "answered page", "stopped", "stopped for good", "began homing", "ended homing",
    "homing found position", "conflict of staged", "several wakes",
};

static unsigned outcomes[OUTCOMES], states[16], faults[8], events[TWIN_EVENTS], frames[TWIN_FRAMES][TWIN_SPOILS];

/* The counters in this order: outcomes, states, faults, events, frames by what was done to them. */
void twin_noted(unsigned *counts);
void twin_noted(unsigned *counts) {
    memcpy(counts, outcomes, sizeof outcomes);
    memcpy(counts + OUTCOMES, states, sizeof states);
    memcpy(counts + OUTCOMES + 16, faults, sizeof faults);
    memcpy(counts + OUTCOMES + 24, events, sizeof events);
    memcpy(counts + OUTCOMES + 24 + TWIN_EVENTS, frames, sizeof frames);
}

/* Name of an outcome, NULL past the last. */
const char *twin_outcome(unsigned number);
const char *twin_outcome(unsigned number) { return number < OUTCOMES ? names[number] : NULL; }

static void note(unsigned outcome, bool happened) {
    if (happened) outcomes[outcome]++;
}

static void note_motion(const cl_node *was, const cl_node *is) {
    bool same_move = was->moving && is->moving && was->move_start_ms == is->move_start_ms;
    note(SET_OFF, is->moving && !was->moving);
    note(BRAKED, same_move && was->move.brake_ms == CL_UNBRAKED && is->move.brake_ms != CL_UNBRAKED);
    note(WENT_ON_AFTER_REST, was->moving && is->moving && !same_move);
    note(STAGED, is->memory.staged > was->memory.staged);
    note(STARTED, is->memory.started > was->memory.started);
    note(FINISHED, is->memory.finished > was->memory.finished);
    note(FELL_SILENT, is->silent && !was->silent);
    note(LIFTED, (was->silent || was->stopped) && !is->silent && !is->stopped);
    note(HELD, is->session.hold_gen & 1 && !(was->session.hold_gen & 1));
    note(SEVERAL_WAKES, is->ack_serial > was->ack_serial + 2);
}

static void note_sessions(const cl_node *was, const cl_node *is) {
    bool took_over = was->pending.exists && !is->pending.exists;
    bool closed = is->session.closed && (took_over || !was->session.closed);
    note(CLOSED_BY_HOST, closed && is->session.hold_gen >= CL_HOLD_END);
    note(CLOSED_BY_COUNTER, closed && is->session.counter == CL_COUNTER_END - 1);
    bool resumed = is->session.flags & CL_FLAG_RESUME && is->session.run_tag == was->memory.run_tag;
    note(RESUMED, took_over && resumed);
    note(TOOK_OVER_AFRESH, took_over && !resumed);
    note(TOOK_OVER_IN_MOTION, took_over && was->moving && is->moving);
    bool clears = took_over && is->session.flags & CL_FLAG_CLEAR && was->memory.fault != CL_FAULT_NONE;
    note(CLEARED_FAULT, clears && is->memory.fault == CL_FAULT_NONE);
    note(KEPT_LOST_POSITION, clears && is->memory.fault == was->memory.fault);
    note(NEW_OFFER, is->memory.offers != was->memory.offers);
}

static void note_frame(const cl_node *was, const cl_node *is, const twin_event *event) {
    bool good = event->spoil == TWIN_UNSPOILED, answered = is->ack_serial > was->ack_serial;
    bool claims = event->frame == TWIN_DRIVE || event->frame == TWIN_ESTOP;
    bool for_offered = was->pending.exists && cl_session_of(event->payload) == was->pending.number;
    frames[event->frame][event->spoil]++;
    note(REFUSED_AS_BUSY, good && claims && for_offered && is->pending.exists && is->moving);
    note(BAD_TAG, is->tally.in_window != was->tally.in_window);
    note(OLD_COUNTER, is->tally.old_counters != was->tally.old_counters);
    note(FLOODED, is->tally.floods != was->tally.floods);
    note(WAS_DEAF, good && event->now_ms < was->tally.deaf_until_ms);
    note(SAME_OFFER, event->frame == TWIN_REPEATED_HELLO && answered && is->memory.offers == was->memory.offers);
    note(ANSWERED_QUERY, event->frame == TWIN_QUERY && answered);
    note(ANSWERED_PAGE, event->frame == TWIN_PAGE && answered);
    note(STOPPED, is->stopped && !was->stopped);
    note(STOPPED_FOR_GOOD, is->memory.estop && !was->memory.estop);
    bool conflict = is->memory.fault == CL_FAULT_CONFLICT && was->memory.fault == CL_FAULT_NONE;
    note(CONFLICT_OF_STAGED, conflict && was->memory.staged > was->memory.started);
}

void twin_note(const twin *before, const twin *after, const twin_event *event) {
    const cl_node *was = &before->node, *is = &after->node;
    events[event->what]++;
    states[cl_node_state(is)]++;
    faults[is->memory.fault]++;
    note_motion(was, is);
    note_sessions(was, is);
    if (event->what == TWIN_RECEIVE) note_frame(was, is, event);
    note(BEGAN_HOMING, is->memory.homing && !was->memory.homing);
    bool ended = was->memory.homing && !is->memory.homing;
    note(ENDED_HOMING, ended);
    note(HOMING_FOUND_POSITION, ended && was->memory.fault != is->memory.fault);
}

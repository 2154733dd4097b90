/* Counts what the sequences reach, so that the comparison can be shown not to be about nothing. */
#include <string.h>

#include "bytes.h"
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
    REFUSED_AS_HOMING,
    KEPT_THE_RUN_UNTIL_A_STEP,
    CLEARED_FAULT,
    KEPT_LOST_POSITION,
    BAD_TAG,
    OLD_COUNTER,
    OLD_FRAME_ANSWERED_BY_STATUS,
    OLD_FRAME_ANSWERED_BY_IDENT,
    WRONG_TAG_ANSWERED_BY_STATUS,
    WRONG_TAG_ANSWERED_BY_IDENT,
    CLOCK_OF_THE_FUTURE_REFUSED,
    WRAPPED_CLOCK_REFUSED,
    FED_NOTHING_NEWER,
    FLOODED,
    WAS_DEAF,
    NEW_OFFER,
    SAME_OFFER,
    OFFERS_EXHAUSTED,
    ANSWERED_QUERY,
    TOLD_THE_AGE_OF_A_FAULT,
    TOLD_WHY_AN_AXIS_IS_NOT_HOMED,
    ANSWERED_PAGE,
    STOPPED,
    STOPPED_FOR_GOOD,
    BEGAN_RUN,
    HID_THE_STEPS_OF_ANOTHER_RUN,
    ORDER_TAKEN,
    ORDER_REFUSED,
    ORDER_REPEATED,
    BEGAN_HOMING,
    RUN_FORGOTTEN_BY_HOMING,
    ENDED_HOMING,
    SOME_AXES_HOMED,
    HOMING_FOUND_POSITION,
    ONE_AXIS_LOST,
    CONFLICT_OF_STAGED,
    SEVERAL_WAKES,
    HOMING_ABANDONED_BY_HOLD,
    HOMING_ABANDONED_BY_STOP,
    HOMING_ABANDONED_BY_SILENCE,
    HOMING_ABANDONED_BY_CLOSE,
    HOMING_ABANDONED_BY_ESTOP,
    HOMING_ABANDONED_BY_A_PERSON,
    BLINKED,
    JOGGED,
    JOGGED_UNHOMED,
    TURNED,
    PLACED,
    PLACED_LAST_AXIS_AFTER_A_FAULT,
    JOG_BRAKED_BY_SILENCE,
    TURN_ENDED_BY_SILENCE,
    TURN_ENDED_BY_HOLD,
    RUN_FORGOTTEN_BY_AN_ERRAND,
    PIECE_TAKEN,
    PIECE_IGNORED_ON_TRIAL,
    PIECES_FORGOTTEN,
    STORED,
    REQUESTED,
    KEPT,
    DROPPED,
    DROPPED_ON_TRIAL,
    TRIAL_ENDED,
    NOT_HEARD_ANY_MORE,
    OUTCOMES,
};

static const char *const names[OUTCOMES] = {
    "set off", "braked", "staged", "started", "finished", "went on after rest", "fell silent", "lifted", "held",
    "closed by host", "closed by counter", "took over afresh", "resumed", "took over in motion",
    "refused as busy", "refused as homing", "kept the run until a step", "cleared fault", "kept lost position",
    "bad tag", "old counter", "old frame answered by status", "old frame answered by ident",
    "wrong tag answered by status", "wrong tag answered by ident", "clock of the future refused",
    "wrapped clock refused", "fed nothing newer", "flooded", "was deaf", "new offer", "same offer",
    "offers exhausted", "answered query", "told the age of a fault", "told why an axis is not homed",
    "answered page", "stopped", "stopped for good", "began run", "hid the steps of another run", "order taken",
    "order refused", "order repeated", "began homing", "run forgotten by homing", "ended homing",
    "some axes homed", "homing found position", "one axis lost", "conflict of staged", "several wakes",
    "homing abandoned by hold", "homing abandoned by stop", "homing abandoned by silence",
    "homing abandoned by close", "homing abandoned by estop", "homing abandoned by a person",
    "blinked", "jogged", "jogged unhomed", "turned", "placed", "placed last axis after a fault",
    "jog braked by silence", "turn ended by silence", "turn ended by hold", "run forgotten by an errand",
    "piece taken", "piece ignored on trial", "pieces forgotten", "stored", "requested", "kept", "dropped",
    "dropped on trial", "trial ended", "not heard any more",
};

static unsigned outcomes[OUTCOMES], states[16], faults[8], errands[CL_OUTCOME_DEADMAN + 1], events[TWIN_EVENTS], frames[TWIN_FRAMES][TWIN_SPOILS];

/* The counters in this order: outcomes, states, faults, errands, events, frames by what was done to them. */
void twin_noted(unsigned *counts);
void twin_noted(unsigned *counts) {
    memcpy(counts, outcomes, sizeof outcomes);
    memcpy(counts + OUTCOMES, states, sizeof states);
    memcpy(counts + OUTCOMES + 16, faults, sizeof faults);
    counts += OUTCOMES + 24;
    memcpy(counts, errands, sizeof errands);
    counts += CL_OUTCOME_DEADMAN + 1;
    memcpy(counts, events, sizeof events);
    memcpy(counts + TWIN_EVENTS, frames, sizeof frames);
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
    note(KEPT_THE_RUN_UNTIL_A_STEP, took_over && !resumed && is->memory.staged > 0);
    note(NEW_OFFER, is->memory.nonce.offers != was->memory.nonce.offers);
}

/* What comes of frames with clocks. */
static void note_clocks(const cl_node *was, const cl_node *is, const twin_event *event) {
    bool counted = is->tally.old_frames != was->tally.old_frames, old = event->spoil == TWIN_OLD_CLOCK;
    bool bad = is->tally.in_window != was->tally.in_window;
    bool took = is->session.counter > was->session.counter && is->session.number == was->session.number;
    uint8_t answer = is->ack[0] & 0xF;
    note(OLD_COUNTER, counted && !old);
    note(OLD_FRAME_ANSWERED_BY_STATUS, counted && old && answer == CL_KIND_STATUS);
    note(OLD_FRAME_ANSWERED_BY_IDENT, counted && old && answer == CL_KIND_IDENT);
    bool told = bad && is->ack_serial > was->ack_serial;
    note(WRONG_TAG_ANSWERED_BY_STATUS, told && answer == CL_KIND_STATUS);
    note(WRONG_TAG_ANSWERED_BY_IDENT, told && answer == CL_KIND_IDENT);
    note(CLOCK_OF_THE_FUTURE_REFUSED, bad && event->spoil == TWIN_FUTURE_CLOCK);
    note(WRAPPED_CLOCK_REFUSED, bad && event->spoil == TWIN_WRAPPED_CLOCK);
    note(FED_NOTHING_NEWER, took && is->session.heard_ms == was->session.heard_ms);
}

static void note_orders(const cl_node *was, const cl_node *is, const twin_event *event) {
    bool took = is->session.counter != was->session.counter, newer = event->payload[9] > was->session.order;
    note(ORDER_TAKEN, took && is->memory.homing && !was->memory.homing);
    note(ORDER_REFUSED, took && newer && is->session.order == was->session.order);
    note(ORDER_REPEATED, took && !newer && is->session.number == was->session.number);
}

/* What ended a homing before its time. */
static void note_abandoned(const cl_node *was, const cl_node *is, const twin_event *event) {
    bool silent = is->silent && !was->silent, closed = is->session.closed && !was->session.closed;
    note(HOMING_ABANDONED_BY_SILENCE, silent);
    note(HOMING_ABANDONED_BY_CLOSE, closed);
    note(HOMING_ABANDONED_BY_HOLD, !silent && !closed && event->frame == TWIN_DRIVE && is->session.hold_gen & 1);
    note(HOMING_ABANDONED_BY_STOP, !silent && is->stopped && !was->stopped);
    note(HOMING_ABANDONED_BY_ESTOP, is->memory.estop && !was->memory.estop);
    note(HOMING_ABANDONED_BY_A_PERSON, event->what == TWIN_STOP_HOMING && !silent);
}

static void note_errands(const twin *before, const twin *after, const twin_event *event) {
    const cl_node *was = &before->node, *is = &after->node;
    bool silent = is->silent && !was->silent, placed = after->plant.places > before->plant.places;
    bool jogged = is->jogging && after->plant.follows > before->plant.follows && event->frame == TWIN_SERVICE;
    note(BLINKED, is->blink_until_ms > was->blink_until_ms);
    note(JOGGED, jogged);
    note(JOGGED_UNHOMED, jogged && is->memory.unhomed.of[event->payload[10] - 1] != 0);
    note(TURNED, after->plant.turns > before->plant.turns);
    note(PLACED, placed);
    note(PLACED_LAST_AXIS_AFTER_A_FAULT, placed && is->memory.fault != was->memory.fault);
    note(JOG_BRAKED_BY_SILENCE, was->jogging && silent);
    note(TURN_ENDED_BY_SILENCE, was->turning && !is->turning && silent);
    note(TURN_ENDED_BY_HOLD, was->turning && !is->turning && !silent && event->frame == TWIN_DRIVE);
    bool forgot = was->memory.started > 0 && is->memory.started == 0 && event->what == TWIN_RECEIVE;
    note(RUN_FORGOTTEN_BY_AN_ERRAND, forgot && event->frame == TWIN_SERVICE);
    if (event->what == TWIN_RECEIVE && event->frame == TWIN_SERVICE) errands[is->outcome]++;
}

static void note_settings(const twin *before, const twin *after, const twin_event *event) {
    const cl_node *was = &before->node, *is = &after->node;
    bool took = is->session.counter != was->session.counter && event->frame == TWIN_SETTINGS;
    bool dropped = after->plant.drops > before->plant.drops;
    bool is_piece = event->payload[8] == CL_SETTINGS_PIECE;
    note(PIECE_TAKEN, is->pieces > was->pieces);
    note(PIECE_IGNORED_ON_TRIAL, took && is_piece && was->on_trial && event->what == TWIN_RECEIVE);
    note(PIECES_FORGOTTEN, was->pieces != 0 && is->pieces == 0 && is->session.number != was->session.number);
    note(STORED, after->plant.stores > before->plant.stores);
    note(REQUESTED, after->plant.requests > before->plant.requests && is->leaves);
    note(KEPT, was->on_trial && !is->on_trial);
    note(DROPPED, dropped && !was->on_trial);
    note(DROPPED_ON_TRIAL, dropped && is->leaves);
    note(TRIAL_ENDED, is->leaves && !was->leaves && !dropped && is->on_trial);
    note(NOT_HEARD_ANY_MORE, was->leaves && event->what == TWIN_RECEIVE && event->spoil == TWIN_UNSPOILED);
    if (event->what == TWIN_RECEIVE && event->frame == TWIN_SETTINGS) errands[is->outcome]++;
}

static void note_homing(const twin *before, const twin *after, const twin_event *event) {
    const cl_memory *was = &before->node.memory, *is = &after->node.memory;
    bool abandoned = after->plant.give_ups > before->plant.give_ups && was->homing;
    bool ended = was->homing && !is->homing && !abandoned;
    note(BEGAN_HOMING, is->homing && !was->homing);
    note(RUN_FORGOTTEN_BY_HOMING, is->homing && !was->homing && was->started > 0);
    note(ENDED_HOMING, ended);
    note(SOME_AXES_HOMED, ended && !cl_homed(is) && memcmp(&is->unhomed, &was->unhomed, sizeof is->unhomed) != 0);
    note(HOMING_FOUND_POSITION, ended && was->fault != is->fault);
    bool lost = is->fault == CL_FAULT_ENCODER && was->fault == CL_FAULT_NONE && cl_homed(was);
    note(ONE_AXIS_LOST, lost && is->fault_axis != 0);
    if (abandoned) note_abandoned(&before->node, &after->node, event);
}

/* What a REPORT and a STATUS say beyond what they said once. */
static void note_answer(const cl_node *is, const twin_event *event) {
    const cl_memory *memory = &is->memory;
    note(TOLD_THE_AGE_OF_A_FAULT, event->frame == TWIN_QUERY && cl_get16(is->ack + 22) > 0);
    note(TOLD_WHY_AN_AXIS_IS_NOT_HOMED, event->frame == TWIN_QUERY && !cl_homed(memory));
    note(HID_THE_STEPS_OF_ANOTHER_RUN, event->frame == TWIN_DRIVE && !is->session.owns_run && memory->staged > 0);
}

static void note_frame(const cl_node *was, const cl_node *is, const twin_event *event) {
    bool good = event->spoil == TWIN_UNSPOILED, answered = is->ack_serial > was->ack_serial;
    bool clocked = event->frame == TWIN_DRIVE || event->frame == TWIN_HOME || event->frame == TWIN_SERVICE ||
                   event->frame == TWIN_SETTINGS;
    bool claims = clocked || event->frame == TWIN_ESTOP;
    bool for_offered = was->pending.exists && cl_session_of(event->payload) == was->pending.number;
    frames[event->frame][event->spoil]++;
    note(REFUSED_AS_BUSY, good && claims && for_offered && is->pending.exists && is->moving);
    note(BAD_TAG, is->tally.in_window != was->tally.in_window);
    if (clocked) note_clocks(was, is, event);
    if (event->frame == TWIN_HOME) note_orders(was, is, event);
    if (answered) note_answer(is, event);
    note(REFUSED_AS_HOMING, good && claims && for_offered && is->pending.exists && is->memory.homing);
    bool same_offers = is->memory.nonce.offers == was->memory.nonce.offers;
    note(OFFERS_EXHAUSTED, event->frame == TWIN_HELLO && good && same_offers && !answered);
    note(BEGAN_RUN, is->session.owns_run && !was->session.owns_run && is->session.number == was->session.number);
    note(FLOODED, is->tally.floods != was->tally.floods);
    note(WAS_DEAF, good && event->now_ms < was->tally.deaf_until_ms);
    note(SAME_OFFER, event->frame == TWIN_REPEATED_HELLO && answered && same_offers);
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
    note_homing(before, after, event);
    note_errands(before, after, event);
    note_settings(before, after, event);
}

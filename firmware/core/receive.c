/* What frames bring to a node. */
#include <string.h>

#include "node.h"
#include "node_parts.h"

static void saturating_count(uint16_t *count) {
    if (*count < UINT16_MAX) (*count)++;
}

/* Count a frame that was not accepted, if its tag was why; a flood of them makes the node deaf for a while. */
static void refuse(cl_node *node, int64_t now_ms, cl_verdict verdict) {
    cl_tally *tally = &node->tally;
    if (verdict != CL_REJECT_TAG) return;
    saturating_count(&tally->bad_tags);
    if (now_ms - tally->window_ms >= CL_FLOOD_WINDOW_MS) {
        tally->window_ms = now_ms;
        tally->in_window = 0;
    }
    tally->in_window++;
    if (tally->in_window > CL_FLOOD) {
        tally->floods++;
        tally->deaf_until_ms = now_ms + CL_DEAF_MS;
        tally->in_window = 0;
    }
}

/* The live or offered session that a frame names; the tag decides whether it is telling the truth. */
static cl_session *named_session(cl_node *node, const uint8_t *payload) {
    uint16_t number = cl_session_of(payload);
    if (cl_node_has_owner(node) && node->session.number == number) return &node->session;
    return node->pending.exists && node->pending.number == number ? &node->pending : NULL;
}

static bool owner_gone(const cl_node *node, int64_t now_ms) {
    return !cl_node_has_owner(node) || now_ms >= cl_node_expires_ms(node);
}

/* The offered session becomes the live one. What was done stays known until the new host stages a step. */
static void take_over(cl_node *node, int64_t now_ms) {
    cl_session *session = &node->session;
    cl_node_brake(node, now_ms);
    *session = node->pending;
    session->owns_run = session->flags & CL_FLAG_RESUME && session->run_tag == node->memory.run_tag;
    node->pending.exists = false;
    node->pieces = 0;
    session->heard_ms = now_ms - session->deadman_ms; /* an ESTOP may be as old as the offer */
    node->lift_above = session->stopped ? CL_LIFT : 0;
    if (!session->owns_run) {
        node->silent = false;
        node->stopped = session->stopped;
    }
    if (session->flags & CL_FLAG_CLEAR && !cl_lost_position(node->memory.fault)) cl_node_forget_fault(node);
}

/* Say who the node is, what it offers, and what time it is. */
static void identify(cl_node *node, int64_t now_ms, uint64_t handshake, uint64_t run_tag) {
    cl_ident_frame ident = {
        .node = node->number,
        .session = cl_session_number(&node->memory.nonce),
        .nonce = node->memory.nonce,
        .clock = cl_clock_of(now_ms),
        .config_hash = node->config_hash,
        .state = cl_node_state(node),
        .same_run = node->memory.run_tag == run_tag,
        .busy = !owner_gone(node, now_ms),
        .stopped = node->stopped,
        .on_trial = node->on_trial,
    };
    cl_encode_ident(node->ack, &ident, &node->node_key, handshake);
    cl_node_load(node);
}

static int64_t ms_of(int64_t clock) { return clock * (1 << CL_CLOCK_SHIFT); }

/* Load the answer that the session's host looks for, with the time as it is now, and do no more. */
static void tell_time(cl_node *node, int64_t now_ms, const cl_session *session) {
    if (session == &node->pending) {
        identify(node, now_ms, session->handshake, session->run_tag);
    } else {
        cl_node_reload(node, now_ms);
    }
}

/* A frame is not under the key of the session that it names, or so old that its clock is taken for another. */
static void doubt(cl_node *node, int64_t now_ms, const cl_session *session, cl_verdict verdict) {
    refuse(node, now_ms, verdict);
    tell_time(node, now_ms, session);
}

/* Whether a frame is newer than all before; if it is, a pending session takes over. */
static bool admit(cl_node *node, int64_t now_ms, const cl_session *session, uint32_t counter) {
    if (counter <= session->counter || counter >= CL_COUNTER_END) {
        saturating_count(&node->tally.old_frames);
        return false;
    }
    if (session == &node->pending) {
        if ((cl_node_moves(node) || node->memory.homing) && !owner_gone(node, now_ms)) return false;
        take_over(node, now_ms);
    }
    node->session.counter = counter;
    return true;
}

/* Whether a frame with a good tag counts; if it does, the dead-man is fed. Its host must have heard of the node lately when
   it sent it, else somebody may have kept it back. */
static bool accept(cl_node *node, int64_t now_ms, const cl_session *session, int64_t clock, uint32_t counter) {
    int64_t said_ms = ms_of(clock);
    if (now_ms >= said_ms + session->deadman_ms) {
        saturating_count(&node->tally.old_frames);
        tell_time(node, now_ms, session);
        return false;
    }
    if (!admit(node, now_ms, session, counter)) return false;
    if (said_ms > node->session.heard_ms) node->session.heard_ms = said_ms;
    return true;
}

static bool same_order(const cl_memory *memory, const cl_drive_frame *frame) {
    return frame->load_step == memory->staged && frame->move_ms == memory->next_ms &&
           memcmp(&frame->target, &memory->next_target, sizeof frame->target) == 0;
}

/* The first step that a host stages is of a run of its own: the one before cannot go on any more. */
static void begin_run(cl_node *node) {
    cl_node_forget_run(node);
    node->memory.run_tag = node->session.run_tag;
    node->session.owns_run = true;
}

static void stage(cl_node *node, int64_t now_ms, const cl_drive_frame *frame) {
    cl_memory *memory = &node->memory;
    uint8_t axis;
    if (frame->load_step == 0) return;
    if (!node->session.owns_run) begin_run(node);
    if (frame->load_step <= memory->started) return;
    if (memory->staged > memory->started) {
        if (!same_order(memory, frame)) cl_node_fail(node, now_ms, CL_FAULT_CONFLICT, 0);
    } else if (frame->load_step != memory->started + 1) {
        cl_node_fail(node, now_ms, CL_FAULT_CONFLICT, 0);
    } else if ((axis = cl_outside(node->axes, &frame->target)) != 0) {
        cl_node_fail(node, now_ms, CL_FAULT_LIMIT, axis);
    } else {
        memory->staged = frame->load_step;
        memory->next_target = frame->target;
        memory->next_ms = frame->move_ms;
    }
}

static void start(cl_node *node) {
    cl_memory *memory = &node->memory;
    bool idle = memory->finished == memory->started && !cl_node_moves(node);
    bool next = memory->staged == memory->started + 1 && node->session.release >= memory->staged;
    if (!idle || !next || !cl_node_may_move(node)) return;
    memory->started = memory->staged;
    memory->target = memory->next_target;
    memory->move_ms = memory->next_ms;
}

static void obey(cl_node *node, int64_t now_ms, const cl_drive_frame *frame) {
    cl_session *session = &node->session;
    if (session->hold_gen & 1) {
        cl_node_halt(node, now_ms);
    } else if (session->hold_gen > node->lift_above) {
        node->silent = node->stopped = false;
    }
    stage(node, now_ms, frame);
    if (frame->release > session->release) session->release = frame->release;
    start(node);
    cl_node_go_on(node, now_ms);
}

/* The host gives the node back; its last answer stays loaded. */
static void close_session(cl_node *node, int64_t now_ms) {
    node->session.closed = true;
    node->silent = node->memory.started > node->memory.finished;
    cl_node_halt(node, now_ms);
}

static void on_drive(cl_node *node, int64_t now_ms, const uint8_t *payload) {
    cl_session *session = named_session(node, payload);
    cl_drive_frame frame;
    if (session == NULL) return;
    cl_verdict verdict = cl_decode_drive(payload, &session->key, cl_clock_of(now_ms), &frame);
    if (verdict != CL_GOOD) {
        doubt(node, now_ms, session, verdict);
        return;
    }
    if (!accept(node, now_ms, session, frame.clock, frame.counter)) return;
    session = &node->session;
    if (frame.hold_gen > session->hold_gen) session->hold_gen = frame.hold_gen;
    if (session->hold_gen >= CL_HOLD_END || session->counter == CL_COUNTER_END - 1) {
        close_session(node, now_ms);
    } else {
        obey(node, now_ms, &frame);
    }
    cl_node_reload(node, now_ms);
}

/* Whether a host may order it: never in a run of its own, nor while the node is to hold or does anything. */
static bool may_home(const cl_node *node) {
    const cl_memory *memory = &node->memory;
    bool is_held = node->silent || cl_node_held(node);
    return !is_held && !node->session.owns_run && !cl_node_moves(node) && !memory->homing && !memory->estop &&
           !node->on_trial;
}

static void on_home(cl_node *node, int64_t now_ms, const uint8_t *payload) {
    cl_session *session = named_session(node, payload);
    cl_home_frame frame;
    if (session == NULL) return;
    cl_verdict verdict = cl_decode_home(payload, &session->key, cl_clock_of(now_ms), &frame);
    if (verdict != CL_GOOD) {
        doubt(node, now_ms, session, verdict);
        return;
    }
    if (!accept(node, now_ms, session, frame.clock, frame.counter)) return;
    session = &node->session;
    if (frame.order > session->order && may_home(node)) {
        session->order = frame.order;
        cl_node_start_homing(node, now_ms, frame.axes);
    }
    cl_node_reload(node, now_ms);
}

static void on_service(cl_node *node, int64_t now_ms, const uint8_t *payload) {
    cl_session *session = named_session(node, payload);
    cl_service_frame frame;
    if (session == NULL) return;
    cl_verdict verdict = cl_decode_service(payload, &session->key, cl_clock_of(now_ms), &frame);
    if (verdict != CL_GOOD) {
        doubt(node, now_ms, session, verdict);
        return;
    }
    if (!accept(node, now_ms, session, frame.clock, frame.counter)) return;
    cl_node_serve(node, now_ms, &frame);
    cl_node_schedule(node);
    cl_node_answer_service(node, now_ms, &frame);
}

static void on_settings(cl_node *node, int64_t now_ms, const uint8_t *payload) {
    static const cl_service_frame look = {.page = CL_PAGE_SETTINGS};
    cl_session *session = named_session(node, payload);
    cl_settings_frame frame;
    if (session == NULL) return;
    cl_verdict verdict = cl_decode_settings(payload, &session->key, &session->secret, cl_clock_of(now_ms), &frame);
    if (verdict != CL_GOOD) {
        doubt(node, now_ms, session, verdict);
        return;
    }
    if (!accept(node, now_ms, session, frame.clock, frame.counter)) return;
    cl_node_change(node, &frame);
    cl_node_schedule(node);
    cl_node_answer_service(node, now_ms, &look);
}

static void on_estop(cl_node *node, int64_t now_ms, const uint8_t *payload) {
    const cl_session *session = named_session(node, payload);
    cl_estop_frame frame;
    if (session == NULL) return;
    cl_verdict verdict = cl_decode_estop(payload, &session->key, &frame);
    if (verdict != CL_GOOD) {
        refuse(node, now_ms, verdict);
    } else if (frame.node == node->number && admit(node, now_ms, session, frame.counter)) {
        node->memory.estop = true;
        cl_node_halt(node, now_ms);
        cl_node_reload(node, now_ms);
    }
}

/* Nor does the end of a hold that its host has begun, or is about to, lift a STOP. */
static void hold_for_good(cl_node *node) {
    unsigned above = (node->session.hold_gen + 2u) & ~1u;
    uint8_t lift_above = above > UINT8_MAX ? UINT8_MAX : (uint8_t)above;
    node->stopped = true;
    if (node->session.exists && lift_above > node->lift_above) node->lift_above = lift_above;
    node->pending.stopped = node->pending.exists;
}

static void on_stop(cl_node *node, int64_t now_ms, const uint8_t *payload) {
    cl_verdict verdict = cl_decode_stop(payload, &node->stop_key);
    if (verdict != CL_GOOD) {
        refuse(node, now_ms, verdict);
        return;
    }
    hold_for_good(node);
    cl_node_halt(node, now_ms);
    cl_node_reload(node, now_ms);
}

/* A new offer takes the place of the one before, which nobody has taken up; false if there are no numbers left. */
static bool renew_offer(cl_node *node, const cl_hello_frame *hello, uint64_t handshake) {
    cl_node_nonce *nonce = &node->memory.nonce;
    if (nonce->offers == CL_OFFERS_END - 1) return false;
    nonce->offers++;
    node->pending = (cl_session){
        .handshake = handshake,
        .run_tag = hello->run_tag,
        .deadman_ms = hello->deadman_ms,
        .flags = hello->flags,
        .number = cl_session_number(nonce),
        .exists = true,
    };
    cl_session_key(&node->pending.secret, &node->key, &(cl_handshake){handshake, *nonce, hello->run_tag});
    cl_tag_key(&node->pending.key, &node->pending.secret);
    return true;
}

/* Answer a HELLO; repeated attempts of one handshake get the same session offered. */
static void offer(cl_node *node, int64_t now_ms, const cl_hello_frame *hello, uint64_t handshake) {
    bool repeated = node->pending.exists && node->pending.handshake == handshake;
    if (repeated || renew_offer(node, hello, handshake)) identify(node, now_ms, handshake, hello->run_tag);
}

static uint16_t fault_s(const cl_memory *memory, int64_t now_ms) {
    if (memory->fault == CL_FAULT_NONE) return 0;
    int64_t since_ms = now_ms - memory->fault_ms;
    return since_ms < 1000 * (int64_t)UINT16_MAX ? (uint16_t)((uint32_t)since_ms / 1000) : UINT16_MAX;
}

static void answer_query(cl_node *node, int64_t now_ms, uint64_t handshake) {
    const cl_memory *memory = &node->memory;
    cl_report_frame report = {
        .node = node->number,
        .cause = memory->cause,
        .boot = memory->nonce.boot,
        .axes = memory->unhomed,
        .fault_s = fault_s(memory, now_ms),
        .stopped = node->stopped,
        .turning = cl_node_moves(node) || memory->homing,
        .on_trial = node->on_trial,
    };
    cl_node_condition(node, now_ms, &report.now);
    cl_encode_report(node->ack, &report, &node->node_key, handshake);
    cl_node_load(node);
}

static void on_hello(cl_node *node, int64_t now_ms, const uint8_t *payload) {
    cl_hello_frame hello;
    cl_verdict verdict = cl_decode_hello(payload, &node->node_key, &hello);
    if (verdict != CL_GOOD) {
        refuse(node, now_ms, verdict);
        return;
    }
    if (hello.node != node->number) return;
    uint64_t handshake = hello.nonce & ~(uint64_t)CL_ATTEMPT_MASK;
    if (hello.flags & CL_FLAG_QUERY) {
        answer_query(node, now_ms, handshake);
    } else {
        offer(node, now_ms, &hello, handshake);
    }
}

static void on_ask(cl_node *node, int64_t now_ms, const uint8_t *payload) {
    cl_ask_frame ask;
    cl_verdict verdict = cl_decode_ask(payload, &node->open_key, &ask);
    if (verdict != CL_GOOD) {
        refuse(node, now_ms, verdict);
        return;
    }
    if ((ask.node != node->number && ask.node != CL_EVERY_NODE) || ask.page != CL_WHO) return;
    cl_page_frame page = {
        .node = node->number,
        .chip = node->chip,
        .firmware = node->firmware,
        .boot = node->memory.nonce.boot,
        .config_hash = node->config_hash,
        .state = cl_node_state(node),
        .bad_tags = node->tally.bad_tags,
        .old_frames = node->tally.old_frames,
    };
    cl_encode_page(node->ack, &page, &node->open_key, ask.nonce & ~(uint64_t)CL_ATTEMPT_MASK);
    cl_node_load(node);
}

void cl_node_receive(cl_node *node, int64_t now_ms, const uint8_t *payload, size_t length) {
    cl_node_advance(node, now_ms);
    uint8_t kind = cl_kind_of(payload, length);
    if (node->leaves || now_ms < node->tally.deaf_until_ms) return;
    if (kind == CL_KIND_DRIVE) on_drive(node, now_ms, payload);
    if (kind == CL_KIND_HOME) on_home(node, now_ms, payload);
    if (kind == CL_KIND_ESTOP) on_estop(node, now_ms, payload);
    if (kind == CL_KIND_HELLO) on_hello(node, now_ms, payload);
    if (kind == CL_KIND_PAGE) on_ask(node, now_ms, payload);
    if (kind == CL_KIND_STOP) on_stop(node, now_ms, payload);
    if (kind == CL_KIND_SERVICE) on_service(node, now_ms, payload);
    if (kind == CL_KIND_SETTINGS) on_settings(node, now_ms, payload);
}

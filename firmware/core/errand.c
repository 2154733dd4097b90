/* What a node does for a host that tries it out or changes its settings: jogs, turns, places, and what it says then. None of it
   belongs to a run. */
#include <string.h>

#include "node.h"
#include "node_parts.h"

static int32_t size(int32_t value) { return value < 0 ? -value : value; }

static bool axis_homed(const cl_node *node, uint8_t axis) { return node->memory.unhomed.of[axis - 1] == 0; }

static bool within(const cl_axis_limits *axis, int64_t counts) { return counts >= axis->low && counts <= axis->high; }

static uint8_t jog_refusal(const cl_node *node, const cl_counts *at, const cl_service_frame *frame) {
    const cl_axis_limits *axis = &node->axes[frame->axis - 1];
    int64_t target = (int64_t)at->at[frame->axis - 1] + frame->amount;
    if (node->memory.fault != CL_FAULT_NONE) return CL_OUTCOME_FAULTY;
    for (unsigned other = 0; other < CL_AXES; other++) {
        if (at->at[other] > 2 * CL_POSITION_LIMIT || at->at[other] < -2 * CL_POSITION_LIMIT) return CL_OUTCOME_BEYOND;
    }
    if (target > CL_POSITION_LIMIT || target < -CL_POSITION_LIMIT || frame->rate < CL_LEAST_RATE) {
        return CL_OUTCOME_BEYOND;
    }
    if (axis_homed(node, frame->axis)) return within(axis, target) ? CL_OUTCOME_NONE : CL_OUTCOME_BEYOND;
    if (!frame->unhomed) return CL_OUTCOME_UNHOMED;
    int32_t most = (axis->high - axis->low) / 4;
    if (most > CL_UNHOMED_COUNTS) most = CL_UNHOMED_COUNTS;
    return size(frame->amount) > most ? CL_OUTCOME_BEYOND : CL_OUTCOME_NONE;
}

static uint8_t turn_refusal(const cl_node *node, const cl_counts *at, const cl_service_frame *frame) {
    bool too_much = size(frame->amount) > CL_TURN_DUTY || frame->rate > CL_TURN_COUNTS || frame->span > CL_TURN_MS;
    if (too_much || frame->amount == 0 || frame->rate == 0 || frame->span == 0) return CL_OUTCOME_BEYOND;
    int64_t end = (int64_t)at->at[frame->axis - 1] + (frame->amount > 0 ? frame->rate : -frame->rate);
    bool allowed = !axis_homed(node, frame->axis) || within(&node->axes[frame->axis - 1], end);
    return allowed ? CL_OUTCOME_NONE : CL_OUTCOME_BEYOND;
}

/* Why the node carries out no order at all, NONE if it may. */
static uint8_t unready(const cl_node *node) {
    const cl_memory *memory = &node->memory;
    if (memory->estop || node->silent || cl_node_held(node)) return CL_OUTCOME_HELD;
    bool occupied = node->session.owns_run || cl_node_moves(node) || memory->homing;
    return occupied ? CL_OUTCOME_OCCUPIED : CL_OUTCOME_NONE;
}

/* Why an order is not carried out, NONE if it is. */
static uint8_t refusal(const cl_node *node, const cl_counts *at, const cl_service_frame *frame) {
    uint8_t reason = unready(node);
    if (reason != CL_OUTCOME_NONE) return reason;
    if (node->on_trial) return CL_OUTCOME_OCCUPIED;
    if (frame->operation == CL_OPERATION_PLACE) {
        return within(&node->axes[frame->axis - 1], frame->amount) ? CL_OUTCOME_NONE : CL_OUTCOME_BEYOND;
    }
    if (node->session.deadman_ms > CL_SERVICE_DEADMAN_MS) return CL_OUTCOME_DEADMAN;
    return frame->operation == CL_OPERATION_JOG ? jog_refusal(node, at, frame) : turn_refusal(node, at, frame);
}

static void jog(cl_node *node, int64_t now_ms, const cl_counts *at, const cl_service_frame *frame) {
    cl_counts target = *at;
    target.at[frame->axis - 1] += frame->amount;
    node->move.start = *at;
    cl_plan_move(&node->move, &target, node->axes, (int32_t)(1000 * (int64_t)size(frame->amount) / frame->rate));
    node->move_start_ms = now_ms;
    node->moving = node->jogging = true;
    node->plant.follow(node->plant.self, now_ms, now_ms, &node->move);
}

static void turn(cl_node *node, int64_t now_ms, const cl_service_frame *frame) {
    const cl_turn turn = {
        .axis = frame->axis,
        .at_once = frame->at_once,
        .duty = (int16_t)frame->amount,
        .counts = frame->rate,
        .span_ms = frame->span,
    };
    node->turning = true;
    node->plant.turn(node->plant.self, now_ms, &turn);
}

static void place(cl_node *node, int64_t now_ms, const cl_service_frame *frame) {
    cl_memory *memory = &node->memory;
    node->plant.place(node->plant.self, now_ms, frame->axis, frame->amount);
    memory->unhomed.of[frame->axis - 1] = 0;
    if (cl_homed(memory) && cl_lost_position(memory->fault)) cl_node_forget_fault(node);
    node->outcome = CL_OUTCOME_DONE;
}

void cl_node_serve(cl_node *node, int64_t now_ms, const cl_service_frame *frame) {
    cl_counts at;
    if (frame->operation == CL_OPERATION_BLINK) node->blink_until_ms = now_ms + CL_BLINK_MS;
    if (frame->operation < CL_OPERATION_JOG || frame->order <= node->session.order) return;
    node->session.order = frame->order;
    node->plant.positions(node->plant.self, now_ms, &at);
    node->outcome = refusal(node, &at, frame);
    if (node->outcome != CL_OUTCOME_NONE) return;
    node->outcome = CL_OUTCOME_BUSY;
    cl_node_forget_run(node);
    if (frame->operation == CL_OPERATION_JOG) jog(node, now_ms, &at, frame);
    if (frame->operation == CL_OPERATION_TURN) turn(node, now_ms, frame);
    if (frame->operation == CL_OPERATION_PLACE) place(node, now_ms, frame);
}

/* As `refusal`, of an order about settings. */
static uint8_t change_refusal(const cl_node *node, uint8_t operation) {
    uint8_t reason = unready(node);
    if (reason != CL_OUTCOME_NONE) return reason;
    bool ends = operation == CL_SETTINGS_KEEP || operation == CL_SETTINGS_DROP;
    if (node->on_trial) return ends ? CL_OUTCOME_NONE : CL_OUTCOME_OCCUPIED;
    bool lacks = operation == CL_SETTINGS_STORE && node->pieces != CL_ALL_PIECES;
    return lacks || operation == CL_SETTINGS_KEEP ? CL_OUTCOME_BEYOND : CL_OUTCOME_NONE;
}

static uint8_t carry_out(cl_node *node, uint8_t operation) {
    const cl_plant *plant = &node->plant;
    uint8_t outcome = CL_OUTCOME_DONE;
    if (operation == CL_SETTINGS_STORE) {
        outcome = plant->store(plant->self, node->record);
        node->pieces = 0;
    } else if (operation == CL_SETTINGS_TRY) {
        outcome = plant->request(plant->self);
        node->leaves = outcome == CL_OUTCOME_DONE;
    } else if (operation == CL_SETTINGS_KEEP) {
        outcome = plant->keep(plant->self);
        node->on_trial = outcome != CL_OUTCOME_DONE;
    } else if (operation == CL_SETTINGS_LOADER) {
        node->leaves = plant->loader != 0;
        outcome = node->leaves ? CL_OUTCOME_DONE : CL_OUTCOME_BEYOND;
        if (node->leaves) plant->loader(plant->self);
    } else {
        node->leaves = node->on_trial;
        node->pieces = 0;
        plant->drop(plant->self);
    }
    return outcome;
}

void cl_node_change(cl_node *node, const cl_settings_frame *frame) {
    if (frame->operation == CL_SETTINGS_PIECE) {
        if (node->on_trial) return;
        memcpy(node->record + CL_PIECE_BYTES * frame->index, frame->piece, CL_PIECE_BYTES);
        node->pieces |= (uint8_t)(1u << frame->index);
    } else if (frame->index > node->session.order) {
        node->session.order = frame->index;
        node->outcome = change_refusal(node, frame->operation);
        if (node->outcome == CL_OUTCOME_NONE) node->outcome = carry_out(node, frame->operation);
    }
}

static void put_standing(cl_node *node, int64_t now_ms) {
    cl_standing standing;
    node->plant.standing(node->plant.self, &standing);
    int64_t left_ms = node->on_trial ? node->trial_ends_ms - now_ms : 0;
    const cl_settings_facts facts = {
        .pieces = node->pieces,
        .on_trial = node->on_trial,
        .left_s = left_ms > 0 ? (uint8_t)(((uint32_t)left_ms + 999) / 1000) : 0,
        .generation = standing.generation,
        .stored = standing.stored,
    };
    cl_put_settings_facts(node->ack, &facts);
}

static void put_look(cl_node *node, int64_t now_ms, uint8_t axis, const cl_service_frame *frame) {
    cl_look seen;
    node->plant.look(node->plant.self, now_ms, axis, (uint8_t)frame->rate, &seen);
    if (frame->page == CL_PAGE_TRACE) {
        cl_put_samples(node->ack, seen.trace);
    } else if (frame->page == CL_PAGE_AXIS) {
        const cl_axis_facts facts = {
            axis, seen.missed, seen.duty, seen.lag, seen.threshold, seen.samples, node->memory.started,
        };
        cl_put_axis_facts(node->ack, &facts);
    } else {
        bool turns = cl_node_moves(node) || node->memory.homing;
        uint8_t lines = (uint8_t)(seen.lines | (turns ? CL_LINE_TURNING : 0));
        cl_put_motor_facts(node->ack, &(cl_motor_facts){seen.counts, lines, seen.supply_mv});
    }
}

void cl_node_answer_service(cl_node *node, int64_t now_ms, const cl_service_frame *frame) {
    uint8_t axis = frame->axis == 0 ? 1 : frame->axis;
    cl_reading_frame reading = {
        .node = node->number,
        .session = node->session.number,
        .echo = node->session.counter,
        .clock = cl_clock_of(now_ms),
        .page = frame->page,
        .outcome = node->outcome,
        .index = node->session.order,
    };
    if (frame->page == CL_PAGE_TRACE) reading.index = (uint8_t)frame->rate;
    if (frame->page == CL_PAGE_LIMITS) {
        const cl_axis_limits *limits = &node->axes[axis - 1];
        const int32_t facts[4] = {limits->low, limits->high, limits->speed, limits->acceleration};
        reading.index = axis;
        cl_put_limit_facts(node->ack, facts);
    } else if (frame->page == CL_PAGE_SETTINGS) {
        put_standing(node, now_ms);
    } else {
        put_look(node, now_ms, axis, frame);
    }
    cl_encode_reading(node->ack, &reading, &node->session.key);
    cl_node_load(node);
}

#include "node.h"

#include <string.h>

#include "node_parts.h"

#define NEVER INT64_MAX

bool cl_node_has_owner(const cl_node *node) { return node->session.exists && !node->session.closed; }

bool cl_lost_position(uint8_t fault) { return fault == CL_FAULT_ENCODER || fault == CL_FAULT_BROWN_OUT; }

bool cl_node_held(const cl_node *node) {
    return node->stopped || (node->session.exists && node->session.hold_gen & 1);
}

bool cl_homed(const cl_memory *memory) {
    return (memory->unhomed.of[0] | memory->unhomed.of[1] | memory->unhomed.of[2]) == 0;
}

bool cl_node_moves(const cl_node *node) { return node->moving || node->turning; }

int64_t cl_node_expires_ms(const cl_node *node) { return node->session.heard_ms + node->session.deadman_ms; }

void cl_node_init(
    cl_node *node, const cl_identity *identity, const cl_axis_limits axes[CL_AXES], cl_plant plant,
    const cl_memory *memory
) {
    cl_key key;
    memset(node, 0, sizeof *node);
    node->number = identity->number;
    node->chip = identity->chip;
    node->firmware = identity->firmware;
    node->config_hash = cl_config_hash(axes);
    node->plant = plant;
    node->memory = *memory;
    node->tally.window_ms = -CL_FLOOD_WINDOW_MS;
    node->next_ms = NEVER;
    node->silent = memory->started > memory->finished;
    cl_standing standing;
    plant.standing(plant.self, &standing);
    node->on_trial = standing.on_trial;
    memcpy(node->axes, axes, sizeof node->axes);
    cl_node_key(&node->key, &identity->master, identity->chip);
    cl_tag_key(&node->node_key, &node->key);
    cl_stop_key(&key, &identity->master);
    cl_tag_key(&node->stop_key, &key);
    cl_open_key(&key);
    cl_tag_key(&node->open_key, &key);
}

uint8_t cl_node_state(const cl_node *node) {
    const cl_memory *memory = &node->memory;
    if (!node->booted) return CL_STATE_BOOT;
    if (memory->estop) return CL_STATE_ESTOP;
    if (memory->homing) return CL_STATE_HOMING;
    if (memory->fault != CL_FAULT_NONE) return cl_lost_position(memory->fault) ? CL_STATE_POSITION_LOST : CL_STATE_FAULT;
    if (!cl_homed(memory)) return CL_STATE_UNHOMED;
    if (cl_node_moves(node)) return CL_STATE_MOVING;
    if (cl_node_held(node)) return CL_STATE_HOLD;
    return node->silent ? CL_STATE_HOLD_LINK : CL_STATE_READY;
}

void cl_node_setpoint(const cl_node *node, int64_t now_ms, cl_counts *counts) {
    if (node->moving) {
        cl_move_at(&node->move, now_ms - node->move_start_ms, counts);
    } else {
        node->plant.positions(node->plant.self, now_ms, counts);
    }
}

/* What is answered */

void cl_node_load(cl_node *node) {
    node->ack_length = CL_FRAME_BYTES;
    node->ack_serial++;
}

void cl_node_condition(const cl_node *node, int64_t now_ms, cl_condition *now) {
    const cl_memory *memory = &node->memory;
    *now = (cl_condition){
        .finished = memory->finished,
        .started = memory->started,
        .staged = memory->staged,
        .state = cl_node_state(node),
        .hold_low = node->session.exists ? node->session.hold_gen & 0xF : 0,
        .fault = memory->fault,
        .fault_axis = memory->fault_axis,
    };
    node->plant.positions(node->plant.self, now_ms, &now->position);
}

/* The fault that the present move will run into; one that is latched already hides all others. */
static bool coming_fault(const cl_node *node, cl_plant_fault *fault) {
    return node->memory.fault == CL_FAULT_NONE && node->plant.fault(node->plant.self, fault);
}

static void sooner(int64_t *next_ms, int64_t at_ms) {
    if (at_ms < *next_ms) *next_ms = at_ms;
}

void cl_node_schedule(cl_node *node) {
    int64_t next_ms = NEVER, settles_ms, turned_ms;
    cl_plant_fault fault;
    cl_sought sought;
    if (node->on_trial) next_ms = node->trial_ends_ms;
    if (cl_node_has_owner(node) && !node->silent) sooner(&next_ms, cl_node_expires_ms(node));
    if (node->memory.homing && node->plant.sought(node->plant.self, &sought)) sooner(&next_ms, sought.at_ms);
    if (node->turning && node->plant.turned(node->plant.self, &turned_ms)) sooner(&next_ms, turned_ms);
    if (node->moving) {
        if (node->plant.settles(node->plant.self, &settles_ms)) sooner(&next_ms, settles_ms);
        if (coming_fault(node, &fault)) sooner(&next_ms, fault.at_ms);
    }
    node->next_ms = node->leaves ? NEVER : next_ms;
}

/* Of a run that is not its own the owner learns nothing here. */
void cl_node_reload(cl_node *node, int64_t now_ms) {
    const cl_session *session = &node->session;
    cl_node_schedule(node);
    if (!session->exists) return;
    cl_status_frame status = {
        .node = node->number, .session = session->number, .echo = session->counter, .clock = cl_clock_of(now_ms),
    };
    cl_node_condition(node, now_ms, &status.now);
    if (!session->owns_run) {
        status.now.finished = status.now.started = 0;
        status.now.staged = session->order;
    }
    cl_encode_status(node->ack, &status, &session->key);
    cl_node_load(node);
}

/* Motion */

bool cl_node_may_move(const cl_node *node) {
    const cl_memory *memory = &node->memory;
    bool able = cl_homed(memory) && !memory->homing && !memory->estop && memory->fault == CL_FAULT_NONE;
    return able && !node->on_trial && cl_node_has_owner(node) && node->session.owns_run && !node->silent && !cl_node_held(node);
}

void cl_node_go_on(cl_node *node, int64_t now_ms) {
    const cl_memory *memory = &node->memory;
    if (cl_node_moves(node) || memory->finished >= memory->started || !cl_node_may_move(node)) return;
    node->plant.positions(node->plant.self, now_ms, &node->move.start);
    cl_plan_move(&node->move, &memory->target, node->axes, memory->move_ms);
    node->moving = true;
    node->move_start_ms = now_ms;
    node->plant.follow(node->plant.self, now_ms, now_ms, &node->move);
}

void cl_node_brake(cl_node *node, int64_t now_ms) {
    if (node->moving && node->move.brake_ms == CL_UNBRAKED) {
        cl_move_brake(&node->move, now_ms - node->move_start_ms);
        node->plant.follow(node->plant.self, now_ms, node->move_start_ms, &node->move);
    }
    if (node->turning) {
        node->turning = false;
        cl_node_end_errand(node, CL_OUTCOME_ENDED);
        node->plant.give_up(node->plant.self, now_ms);
    }
}

void cl_node_end_errand(cl_node *node, uint8_t outcome) {
    if (node->outcome == CL_OUTCOME_BUSY) node->outcome = outcome;
}

static void abandon_homing(cl_node *node, int64_t now_ms) {
    if (!node->memory.homing) return;
    node->memory.homing = 0;
    node->plant.give_up(node->plant.self, now_ms);
}

void cl_node_halt(cl_node *node, int64_t now_ms) {
    cl_node_brake(node, now_ms);
    abandon_homing(node, now_ms);
}

void cl_node_forget_run(cl_node *node) {
    node->memory.finished = node->memory.started = node->memory.staged = 0;
    node->memory.move_ms = 0;
}

void cl_node_forget_fault(cl_node *node) {
    node->memory.fault = CL_FAULT_NONE;
    node->memory.fault_axis = 0;
    node->memory.fault_ms = 0;
}

/* What time brings */

static void arrive(cl_node *node, int64_t now_ms) {
    cl_memory *memory = &node->memory;
    cl_counts at;
    node->plant.positions(node->plant.self, now_ms, &at);
    node->moving = false;
    if (node->jogging) {
        bool there = memcmp(&at, &node->move.target, sizeof at) == 0;
        node->jogging = false;
        cl_node_end_errand(node, there ? CL_OUTCOME_DONE : CL_OUTCOME_ENDED);
    } else if (memcmp(&at, &memory->target, sizeof at) == 0) {
        memory->finished = memory->started;
    } else {
        memory->move_ms = cl_move_rest_ms(&node->move);
        cl_node_go_on(node, now_ms);
    }
}

/* Another reason for `axes` (bit 0 for the first) not to be homed. */
static void give_reason(cl_memory *memory, uint8_t axes, uint8_t reason) {
    for (unsigned axis = 0; axis < CL_AXES; axis++) {
        if (axes >> axis & 1) memory->unhomed.of[axis] = reason;
    }
}

/* The plant is through with the axes it sought; if all are homed now, no fault puts the position in doubt. */
static void finish_homing(cl_node *node, const cl_reasons *reasons) {
    cl_memory *memory = &node->memory;
    for (unsigned axis = 0; axis < CL_AXES; axis++) {
        if (memory->homing >> axis & 1) memory->unhomed.of[axis] = reasons->of[axis];
    }
    memory->homing = 0;
    if (cl_homed(memory) && cl_lost_position(memory->fault)) cl_node_forget_fault(node);
}

static void fall_silent(cl_node *node, int64_t now_ms) {
    if (node->silent) return;
    node->silent = true;
    node->lift_above = node->session.hold_gen;
    cl_node_halt(node, now_ms);
}

void cl_node_fail(cl_node *node, int64_t now_ms, uint8_t fault, uint8_t axis) {
    cl_memory *memory = &node->memory;
    if (memory->fault == CL_FAULT_NONE) {
        memory->fault = fault;
        memory->fault_axis = axis;
        memory->fault_ms = now_ms;
        if (cl_lost_position(fault)) give_reason(memory, (uint8_t)(axis ? 1u << (axis - 1) : CL_ALL_AXES), fault);
    }
    cl_node_end_errand(node, CL_OUTCOME_FAILED);
    cl_node_brake(node, now_ms);
}

static void wake(cl_node *node, int64_t now_ms) {
    cl_plant_fault fault;
    int64_t settles_ms, turned_ms;
    cl_sought sought;
    if (node->on_trial && node->trial_ends_ms <= now_ms) node->leaves = true;
    if (node->moving && coming_fault(node, &fault) && fault.at_ms <= now_ms) {
        cl_node_fail(node, now_ms, fault.fault, fault.axis);
    }
    if (node->moving && node->plant.settles(node->plant.self, &settles_ms) && settles_ms <= now_ms) {
        arrive(node, now_ms);
    }
    if (node->turning && node->plant.turned(node->plant.self, &turned_ms) && turned_ms <= now_ms) {
        node->turning = false;
        cl_node_end_errand(node, CL_OUTCOME_DONE);
    }
    bool searched = node->memory.homing && node->plant.sought(node->plant.self, &sought);
    if (searched && sought.at_ms <= now_ms) finish_homing(node, &sought.reasons);
    if (cl_node_has_owner(node) && now_ms >= cl_node_expires_ms(node)) fall_silent(node, now_ms);
    cl_node_reload(node, now_ms);
}

void cl_node_advance(cl_node *node, int64_t now_ms) {
    if (!node->booted) {
        node->booted = true;
        if (node->trial_ends_ms == 0) node->trial_ends_ms = now_ms + CL_TRIAL_MS;
        cl_node_reload(node, now_ms);
    }
    while (node->next_ms <= now_ms) wake(node, node->next_ms);
}

void cl_node_notice(cl_node *node, int64_t now_ms) {
    cl_node_schedule(node);
    cl_node_advance(node, now_ms);
}

void cl_node_start_homing(cl_node *node, int64_t now_ms, uint8_t axes) {
    cl_memory *memory = &node->memory;
    if (cl_node_moves(node) || memory->homing || memory->estop || node->on_trial) return;
    give_reason(memory, axes, CL_NOT_HOMED);
    memory->homing = axes;
    cl_node_forget_run(node);
    node->plant.seek(node->plant.self, now_ms, axes);
    cl_node_reload(node, now_ms);
}

void cl_node_stop_homing(cl_node *node, int64_t now_ms) {
    if (!node->memory.homing) return;
    abandon_homing(node, now_ms);
    cl_node_reload(node, now_ms);
}

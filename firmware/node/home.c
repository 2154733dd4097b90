#include "home.h"

#include "board.h"
#include "motors.h"
#include "persist.h"

#define HOLD_MS 2000
#define BOUNCE_MS 20

typedef enum { IDLE, SEEKING, RETURNING } phase;

static const cl_axis_limits *limits;
static cl_homing_axis plan[CL_AXES];
static phase now_doing;
static int64_t changed_ms; /* when the button was last seen otherwise than it is */
static bool down, spent;   /* spent: this press has had its effect */
static bool was_stopped;

void home_start(const cl_axis_limits axes[CL_AXES]) {
    limits = axes;
    PORT_PCR(BUTTON_PORT, BUTTON_PIN) = PCR_GPIO | PCR_PULL_UP;
}

/* Whether the button has been down for `least_ms` in a press that has had no effect yet. */
static bool pressed(int64_t now_ms, int64_t least_ms) {
    return down && !spent && now_ms - changed_ms >= least_ms;
}

static void look(int64_t now_ms) {
    bool is_down = (GPIO_PDIR(BUTTON_PORT) >> BUTTON_PIN & 1u) == 0;
    if (is_down != down) {
        down = is_down;
        changed_ms = now_ms;
        spent = spent && is_down;
    }
}

/* Homing came to nothing: the node is unhomed again, and in fault if it was for one. */
static void fail(cl_node *node, int64_t now_ms, uint8_t fault, uint8_t axis) {
    motors_abandon();
    now_doing = IDLE;
    node->memory.homing = false;
    if (fault != CL_FAULT_NONE) {
        node->memory.fault = fault;
        node->memory.fault_axis = axis;
    }
    cl_node_notice(node, now_ms);
}

static void begin(cl_node *node, int64_t now_ms) {
    bool idle = !node->moving && motors_still();
    if (!idle || node->memory.estop || !persist_moving()) {
        return;
    }
    cl_node_start_homing(node, now_ms);
    if (!node->memory.homing) {
        return;
    }
    for (unsigned axis = 0; axis < CL_AXES; axis++) {
        plan[axis] = cl_homing_standard[axis];
        plan[axis].place = plan[axis].home == CL_HOME_HERE ? 0 : limits[axis].low;
    }
    if (motors_rod_switch()) {
        plan[0] = cl_homing_rod_end;
        plan[0].place = 0; /* fed rod counts from its end */
    }
    motors_allow();
    was_stopped = node->stopped;
    motors_seek(plan);
    now_doing = SEEKING;
}

static void seek(cl_node *node, int64_t now_ms) {
    cl_homing_status status = motors_sought();
    if (status == CL_HOMING_FAILED) {
        uint8_t fault, axis;
        motors_seek_fault(&fault, &axis);
        fail(node, now_ms, fault, axis);
    } else if (status == CL_HOMING_DONE) {
        const cl_counts zero = {{0, 0, 0}};
        cl_move move;
        motors_where(&move.start);
        cl_plan_move(&move, &zero, limits, 0);
        cl_plant plant = motors_plant();
        plant.follow(plant.self, now_ms, now_ms, &move);
        now_doing = RETURNING;
    }
}

/* Plans begin at zero, so homing ends there. */
static void go_to_zero(cl_node *node, int64_t now_ms) {
    cl_plant plant = motors_plant();
    cl_plant_fault found;
    int64_t at_ms;
    if (plant.fault(plant.self, &found)) {
        fail(node, now_ms, found.fault, found.axis);
    } else if (plant.settles(plant.self, &at_ms) && at_ms <= now_ms) {
        now_doing = IDLE;
        cl_node_finish_homing(node, now_ms);
    }
}

void home_serve(cl_node *node, int64_t now_ms, bool news) {
    look(now_ms);
    if (now_doing == IDLE) {
        if (pressed(now_ms, HOLD_MS)) {
            spent = true;
            begin(node, now_ms);
        }
        return;
    }
    bool told_to_stop = node->memory.estop || (node->stopped && !was_stopped);
    if (pressed(now_ms, BOUNCE_MS) || told_to_stop) {
        spent = true;
        fail(node, now_ms, CL_FAULT_NONE, 0);
    } else if (now_doing == SEEKING) {
        seek(node, now_ms);
    } else if (news) {
        go_to_zero(node, now_ms);
    }
}

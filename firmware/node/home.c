#include "home.h"

#include "board.h"
#include "motors.h"
#include "persist.h"
#include "supply.h"

#define HOLD_MS 2000
#define BOUNCE_MS 20

typedef enum { IDLE, SEEKING, RETURNING } phase;

static const cl_axis_limits *limits;
static cl_homing_axis plan[CL_AXES];
static phase now_doing;
static int64_t changed_ms; /* when the button was last seen otherwise than it is */
static bool down, spent;   /* spent: this press has had its effect */
static uint8_t wanted;     /* axes that are sought, bit 0 for the first */
static cl_sought outcome;
static bool ended; /* `outcome` is valid */

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

/* The search is over; the node asks for what came of it. */
static void end(int64_t now_ms) {
    now_doing = IDLE;
    outcome.at_ms = now_ms;
    ended = true;
}

/* Something went wrong with an axis, or with all that are sought (0). */
static void blame(uint8_t fault, uint8_t axis) {
    for (unsigned index = 0; index < CL_AXES; index++) {
        if (wanted >> index & 1u && (axis == 0 || axis == index + 1)) {
            outcome.reasons.of[index] = fault;
        }
    }
}

static void make_plan(void) {
    for (unsigned axis = 0; axis < CL_AXES; axis++) {
        plan[axis] = cl_homing_standard[axis];
        plan[axis].place = plan[axis].home == CL_HOME_HERE ? 0 : limits[axis].low;
    }
    if (motors_rod_switch()) {
        plan[0] = cl_homing_rod_end;
        plan[0].place = 0; /* fed rod counts from its end */
    }
}

/* A search whose beginning cannot be written down must not begin: a later boot would believe the old position. Nor must
 * one that the supply does not last for. */
static void seek(void *self, int64_t now_ms, uint8_t axes) {
    (void)self;
    wanted = axes;
    ended = false;
    bool low = supply_low_ms() != 0;
    if (!persist_moving() || low) {
        blame(low ? CL_FAULT_BROWN_OUT : CL_FAULT_DRIVER, 0);
        end(now_ms);
        return;
    }
    make_plan();
    motors_seek(plan, axes);
    now_doing = SEEKING;
}

static bool sought(void *self, cl_sought *found) {
    (void)self;
    *found = outcome;
    return ended;
}

static void give_up(void *self, int64_t now_ms) {
    (void)self;
    (void)now_ms;
    motors_abandon();
    now_doing = IDLE;
    ended = false;
}

cl_plant home_plant(void) {
    cl_plant plant = motors_plant();
    plant.seek = seek;
    plant.sought = sought;
    plant.give_up = give_up;
    return plant;
}

/* Plans begin at zero, so the axes that have found it go there; the others stay where they are. */
static void go_to_zero(int64_t now_ms) {
    cl_plant plant = motors_plant();
    cl_counts target;
    cl_move move;
    motors_where(&move.start);
    target = move.start;
    for (unsigned axis = 0; axis < CL_AXES; axis++) {
        if (wanted >> axis & 1u && outcome.reasons.of[axis] == 0) {
            target.at[axis] = 0;
        }
    }
    cl_plan_move(&move, &target, limits, 0);
    plant.follow(plant.self, now_ms, now_ms, &move);
    now_doing = RETURNING;
}

static void see_what_is_found(int64_t now_ms) {
    cl_homing_status status = motors_sought(&outcome.reasons);
    if (status == CL_HOMING_DONE) {
        go_to_zero(now_ms);
    } else if (status == CL_HOMING_FAILED) {
        end(now_ms);
    }
}

static void see_whether_at_zero(int64_t now_ms) {
    cl_plant plant = motors_plant();
    cl_plant_fault found;
    int64_t at_ms;
    if (plant.fault(plant.self, &found)) {
        motors_abandon();
        blame(found.fault, found.axis);
        end(now_ms);
    } else if (plant.settles(plant.self, &at_ms) && at_ms <= now_ms) {
        end(now_ms);
    }
}

static void ask(cl_node *node, int64_t now_ms) {
    if (node->memory.homing && pressed(now_ms, BOUNCE_MS)) {
        spent = true;
        cl_node_stop_homing(node, now_ms);
    } else if (!node->memory.homing && pressed(now_ms, HOLD_MS)) {
        spent = true;
        if (motors_still()) {
            cl_node_start_homing(node, now_ms, CL_ALL_AXES);
        }
    }
}

void home_serve(cl_node *node, int64_t now_ms, bool news) {
    look(now_ms);
    ask(node, now_ms);
    if (now_doing == SEEKING) {
        see_what_is_found(now_ms);
    } else if (now_doing == RETURNING && news) {
        see_whether_at_zero(now_ms);
    }
    if (ended && node->memory.homing) {
        cl_node_notice(node, now_ms);
    }
}

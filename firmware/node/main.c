/* The node program: what the interrupts do not do. They count encoder edges (pins_handler) and run the motors at 1 kHz
 * (tick_handler); this loop sleeps until one of them, or the radio, has something for it. */
#include "board.h"
#include "encoder.h"
#include "home.h"
#include "lamp.h"
#include "link.h"
#include "motors.h"
#include "node.h"
#include "node_parts.h"
#include "persist.h"
#include "program.h"
#include "pwm.h"
#include "reset.h"
#include "settings.h"
#include "supply.h"
#include "tick.h"
#include "updates.h"

static cl_node node;

/* Nobody has told this node who it is, or it cannot count its boots: no radio, no motors, a lamp that says so. */
_Noreturn static void refuse(uint8_t code) {
    lamp_borrow_board();
    for (;;) {
        watchdog_main();
        lamp_show(code, tick_ms());
        cpu_sleep();
    }
}

/* Its variables are not needed any longer. */
__attribute__((noinline)) static void begin(void) {
    const cl_settings *settings = settings_begin();
    if (settings == 0) {
        refuse(LAMP_NO_SETTINGS);
    }
    const cl_identity identity = {settings->number, chip_id(), FIRMWARE, settings->master};
    cl_memory memory;
    cl_counts position;
    if (!persist_begin(cl_settings_sum(settings), &memory, &position)) {
        refuse(LAMP_NO_MEMORY);
    }
    encoder_shift(&position);
    motors_start();
    home_start(settings->axes);
    cl_plant plant = home_plant();
    settings_join(&plant);
    updates_join(&plant);
    cl_node_init(&node, &identity, settings->axes, plant, &memory);
    link_start(&settings->radio);
}

/* Drivers work as long as a motor has reason to turn; in every fault they sleep as soon as the axes have stopped. A node that is
 * about to start anew hears no host any more, not even an emergency stop: nothing is to turn it. */
static void guard_motors(void) {
    uint8_t state = cl_node_state(&node);
    bool able = state == CL_STATE_HOMING || state == CL_STATE_READY || state == CL_STATE_MOVING ||
                state == CL_STATE_HOLD || state == CL_STATE_HOLD_LINK;
    if (node.leaves) {
        motors_forbid();
    } else if (able) {
        motors_allow();
    } else if (!node.moving && !node.turning && motors_still()) {
        motors_forbid();
    }
}

/* The supply was too low: no axis is sure of its position, whatever else has gone wrong before. */
static void lose_position(int64_t now_ms) {
    for (unsigned axis = 0; axis < CL_AXES; axis++) {
        node.memory.unhomed.of[axis] = CL_FAULT_BROWN_OUT;
    }
    cl_node_fail(&node, now_ms, CL_FAULT_BROWN_OUT, 0);
    cl_node_reload(&node, now_ms);
}

/* What has to hold after a reset, too, or after the supply was low. */
static void take_note(int64_t now_ms) {
    if (node.memory.estop) {
        reset_note_stop(true);
    }
    if (motors_underfed()) {
        lose_position(now_ms);
    }
}

static uint8_t lamp_code(int64_t now_ms) {
    if (now_ms < node.blink_until_ms) {
        return LAMP_HERE;
    }
    if (!link_there()) {
        return LAMP_NO_RADIO;
    }
    if (node.on_trial && !node.memory.estop) {
        return LAMP_TRIAL;
    }
    switch (cl_node_state(&node)) {
    case CL_STATE_UNHOMED:
        return LAMP_UNHOMED;
    case CL_STATE_HOMING:
        return LAMP_HOMING;
    case CL_STATE_FAULT:
        return LAMP_FAULT;
    case CL_STATE_POSITION_LOST:
        return LAMP_POSITION_LOST;
    case CL_STATE_ESTOP:
        return LAMP_ESTOP;
    default:
        return LAMP_STEADY;
    }
}

/* With interrupts masked, one that came after the last look still wakes the processor; so none is slept through. */
static void sleep_if_idle(void) {
    cpu_mask_interrupts();
    if (!link_busy()) {
        cpu_sleep();
    }
    cpu_allow_interrupts();
}

_Noreturn void program_main(void) {
    clock_start();
    lamp_start();
    pwm_start();
    encoder_start();
    tick_start();
    NVIC_ISER = 1u << IRQ_PORT_CD;
    cpu_allow_interrupts();
    supply_start();
    begin();
    for (;;) {
        watchdog_main();
        int64_t now_ms = tick_ms();
        bool news = motors_news();
        if (news) {
            cl_node_notice(&node, now_ms);
        }
        cl_node_advance(&node, now_ms);
        home_serve(&node, now_ms, news);
        link_serve(&node, now_ms);
        take_note(now_ms);
        supply_serve(now_ms);
        guard_motors();
        updates_serve(&node);
        settings_serve(&node, now_ms, persist_serve(&node, now_ms));
        lamp_show(lamp_code(now_ms), now_ms);
        sleep_if_idle();
    }
}

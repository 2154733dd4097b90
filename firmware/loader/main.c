/* The loader's loop: frames in, the one answer kept loaded, the radio kept in shape, the watchdog fed. */
#include "board.h"
#include "lamp.h"
#include "loader.h"
#include "motors.h"
#include "program.h"
#include "reset.h"
#include "supply.h"
#include "tick.h"
#include "update.h"

#define CHECK_MS 1000
#define RETRY_MS 100
#define DRAIN_MOST 3
#define LAMP_LOADER 8

/* A node that is asked for and not taken goes back to its program. */
#define PATIENCE_MS 20000

static const cl_listening *settings;
static bool there;
static int64_t check_ms, heard_ms;

static void check(int64_t now_ms) {
    if (settings == 0 || now_ms < check_ms) {
        return;
    }
    if (!there || !nrf24_intact(settings)) {
        there = nrf24_start(settings);
    }
    check_ms = now_ms + (there ? CHECK_MS : RETRY_MS);
}

/* As in the program, the radio is sending the answer before this one while the frame is looked at. */
static void load(uint32_t begin_us) {
    uint32_t since_us = tick_us() - begin_us, answer_us = nrf24_answer_us(settings);
    if (since_us < answer_us) {
        delay_us(answer_us - since_us);
    }
    nrf24_load(update_answer, NRF24_PAYLOAD_BYTES);
}

static void serve(int64_t now_ms) {
    uint32_t begin_us = tick_us();
    bool any = false;
    for (int count = 0; count < DRAIN_MOST; count++) {
        uint8_t payload[NRF24_PAYLOAD_BYTES];
        uint8_t length = nrf24_receive(payload);
        if (length == 0) {
            break;
        }
        update_receive(payload, length, now_ms);
        any = true;
    }
    if (any) {
        heard_ms = now_ms;
        load(begin_us);
    }
}

/* The tick is the program's, and calls these. */
void motors_tick(int64_t now_ms) { (void)now_ms; }
void supply_tick(void) {}

/* Only the radio's request is to be noticed. */
void pins_handler(void) { PORT_ISFR(RADIO_IRQ_PORT) = 1u << RADIO_IRQ_PIN; }

/* With interrupts masked, one that came after the last look still wakes the processor. */
static void sleep_if_idle(void) {
    cpu_mask_interrupts();
    if (!there || !nrf24_calls()) {
        cpu_sleep();
    }
    cpu_allow_interrupts();
}

_Noreturn void loader_main(void) {
    clock_start();
    lamp_start();
    tick_start();
    NVIC_ISER = 1u << IRQ_PORT_CD;
    cpu_allow_interrupts();
    settings = update_start();
    for (;;) {
        watchdog_main();
        int64_t now_ms = tick_ms();
        check(now_ms);
        if (there && nrf24_calls()) {
            serve(now_ms);
        }
        if (update_over() || (now_ms - heard_ms >= PATIENCE_MS && update_runnable())) {
            reset_restart();
        }
        lamp_show(settings == 0 ? LAMP_NO_SETTINGS : LAMP_LOADER, now_ms);
        sleep_if_idle();
    }
}

#include "reset.h"

#include "frames.h"
#include "kl26.h"

#define NOTE 0x4C613B00u
#define STOPPED 1u
#define RISING 2u
#define MARKS (STOPPED | RISING)

/* Resets that a running chip brings about by itself: watchdog, clock lost, lock-up, software, debugger, bus. */
#define INSIDE_SRS0 (RCM_SRS0_WDOG | RCM_SRS0_LOL | RCM_SRS0_LOC)
#define INSIDE_SRS1 0x2Eu

typedef struct {
    uint32_t word, inverse;
} note;

static note low_note __attribute__((section(".noinit")));
static note top_note __attribute__((section(".note_top")));
static uint8_t cause;
static bool known; /* the note tells whether there is a stop */

/* Flash is dear and none of this is urgent. */
#define ONCE __attribute__((noinline))

ONCE static void write(uint32_t marks) {
    const note fresh = {NOTE | marks, ~(NOTE | marks)};
    volatile note *const copies[2] = {&low_note, &top_note};
    for (unsigned copy = 0; copy < 2; copy++) {
        copies[copy]->word = fresh.word;
        copies[copy]->inverse = fresh.inverse;
    }
}

/* Marks of all copies that can be read; false if none can. */
ONCE static bool read(uint32_t *marks) {
    const volatile note *const copies[2] = {&low_note, &top_note};
    bool any = false;
    *marks = 0;
    for (unsigned copy = 0; copy < 2; copy++) {
        uint32_t word = copies[copy]->word;
        if (copies[copy]->inverse == ~word && (word & ~MARKS) == NOTE) {
            any = true;
            *marks |= word & MARKS;
        }
    }
    return any;
}

/* The tick and the main loop both do it. */
ONCE static void mark(uint32_t which, bool set) {
    uint32_t marks, wanted;
    cpu_mask_interrupts();
    bool any = read(&marks);
    wanted = set ? marks | which : marks & ~which;
    if (!any || wanted != marks) {
        write(wanted);
    }
    cpu_allow_interrupts();
}

/* A supply that rises or falls sets other flags, too, and so does a reset from within; the first that is true is the cause. */
static uint8_t cause_of(uint8_t outside, uint8_t inside, bool rising) {
    if (outside & RCM_SRS0_POR) {
        return CL_CAUSE_POWER_ON;
    }
    if (outside & RCM_SRS0_LVD) {
        return rising ? CL_CAUSE_POWER_ON : CL_CAUSE_LOW_VOLTAGE;
    }
    if (outside & RCM_SRS0_WDOG) {
        return CL_CAUSE_WATCHDOG;
    }
    if (inside & RCM_SRS1_LOCKUP) {
        return CL_CAUSE_HANG;
    }
    if (inside & RCM_SRS1_SW) {
        return CL_CAUSE_SOFTWARE;
    }
    return outside & RCM_SRS0_PIN ? CL_CAUSE_PIN : CL_CAUSE_UNKNOWN;
}

void reset_begin(void) {
    uint8_t srs0 = RCM_SRS0, srs1 = RCM_SRS1;
    uint32_t marks;
    bool kept = read(&marks);
    bool by_itself = (srs0 & INSIDE_SRS0) != 0 || (srs1 & INSIDE_SRS1) != 0;
    bool was_away = (srs0 & RCM_SRS0_POR) != 0 || (!kept && !by_itself);
    cause = cause_of(srs0, srs1, kept && (marks & RISING) != 0);
    if (was_away && cause == CL_CAUSE_PIN) {
        cause = CL_CAUSE_POWER_ON;
    }
    known = was_away || kept;
    if (was_away) {
        write(0);
    }
}

uint8_t reset_cause(void) { return cause; }

bool reset_stopped(bool in_flash) {
    uint32_t marks;
    bool stopped = known && read(&marks) ? (marks & STOPPED) != 0 : in_flash;
    reset_note_stop(stopped);
    known = true;
    return stopped;
}

void reset_note_stop(bool stopped) { mark(STOPPED, stopped); }

void reset_supply_rises(void) {
    if (cause == CL_CAUSE_POWER_ON) {
        mark(RISING, true);
    }
}

void reset_supply_stands(void) { mark(RISING, false); }

_Noreturn void reset_restart(void) {
    cpu_mask_interrupts();
    SCB_AIRCR = SCB_AIRCR_RESET;
    for (;;) {
    }
}

#include "updates.h"

#include "flash.h"
#include "kl26.h"
#include "loader/layout.h"
#include "motors.h"

/* Where the loader keeps what it knows of the program; its linker script says that there is one. */
extern const uint32_t loader_description[] __attribute__((weak));

static void ask(void *self) {
    (void)self;
    REG32(REQUEST) = REQUEST_WORD;
    REG32(REQUEST + 4u) = ~REQUEST_WORD;
}

void updates_join(cl_plant *plant) {
    if (loader_description != 0) {
        plant->loader = ask;
    }
}

/* The flash keeps the processor waiting: not while anything turns. */
void updates_serve(const cl_node *node) {
    if (loader_description == 0 || node->session.number == 0 || !motors_still()) {
        return;
    }
    if (flash_word(MARK(MARK_KEPT)) == BLANK_WORD) {
        flash_program(MARK(MARK_KEPT), 0);
    }
}

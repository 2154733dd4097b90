/* From reset to the program's loop. */
#include "board.h"
#include "program.h"
#include "reset.h"

_Noreturn void reset_handler(void) {
    cpu_mask_interrupts();
    SIM_COPC = COP_256_MS;
    startup_motors_off();
    startup_memory();
    reset_begin();
    program_main();
}

/* Why the chip was reset, and what the node noted for after a reset: whether an emergency stop is in force.
 *
 * Only the power switch ends an emergency stop, and the register of reset causes does not tell by itself whether it was
 * used: it knows the last reset only, and the board's loader chip may pulse the reset pin some time after the power came.
 * RAM does tell. It keeps what is noted there over every reset as long as there is a supply, and the first program to run
 * after the power came notes anew that there is no stop. So, in this order:
 *
 *   1. The register shows a power-on: the power was away. No stop.
 *   2. The note can be read: there was a program since the power came, and what it noted holds. A pulse of the reset pin
 *      after power-on finds "no stop", a reset of any kind during a stop finds "stop".
 *   3. The note is gone, and the chip reset itself (watchdog, lock-up, software, lost clock), for which it must have run:
 *      a program has gone mad over the note. What the flash says holds.
 *   4. The note is gone otherwise: RAM has lost its contents, so the power was away.
 *
 * It errs on the safe side: a note that outlives a power cut (RAM may hold for a moment) where the register does not show
 * the power-on keeps the stop, until the power is away for longer. The note is 64 bits, twice, at both ends of what RAM
 * the program uses; one that can be read is enough, and of two that differ a stop counts. */
#ifndef RESET_H
#define RESET_H

#include <stdbool.h>
#include <stdint.h>

/* Called once, first of all, when variables are initialised. */
void reset_begin(void);

/* CL_CAUSE_... */
uint8_t reset_cause(void);

/* Whether an emergency stop from before the reset is in force; `in_flash` is what the flash says of it. */
bool reset_stopped(bool in_flash);

/* Note it for after the next reset; like the next two, once interrupts are allowed. */
void reset_note_stop(bool stopped);

/* The supply may still be rising; a reset for low voltage before it stands is still part of the power-on. */
void reset_supply_rises(void);
void reset_supply_stands(void);

/* Begin again, as after any other reset. */
_Noreturn void reset_restart(void);

#endif

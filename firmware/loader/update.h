/* A node's program, replaced over the air: the sessions of a host, pieces of a sector, sectors, marks. docs/firmware-update.md
 * says why it is as it is.
 *
 * Duty: power may fail after any word and in the middle of an erase; then either the old program or the new one is whole, or
 * none, and the loader goes on where it was.
 * The processor stands still while the flash is busy; motors sleep, encoders are not read. */
#ifndef UPDATE_H
#define UPDATE_H

#include <stdbool.h>
#include <stdint.h>

#include "nrf24.h"

/* The next three touch no variables: they are asked before there are any. */

/* Whether there is a whole program that may be started: it was kept, or was never started. */
bool update_runnable(void);

/* Whether a host has been heard by it. */
bool update_kept(void);

/* It is about to be started for the first time; false if that cannot be noted. */
bool update_try(void);

/* Count this boot, and read who the node is; where its radio listens, NULL if it is to stay off the air. */
const cl_listening *update_start(void);

/* Take a frame; the answer to load is in `update_answer`. */
void update_receive(const uint8_t *payload, uint8_t length, int64_t now_ms);

extern uint8_t update_answer[NRF24_PAYLOAD_BYTES];

/* Whether the host is done with the loader. */
bool update_over(void);

#endif

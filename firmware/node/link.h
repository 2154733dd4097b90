/* The radio's side of the main loop: frames in, the one answer kept loaded, the chip kept in shape. */
#ifndef LINK_H
#define LINK_H

#include <stdbool.h>

#include "node.h"
#include "nrf24.h"

void link_start(const cl_listening *settings);

/* Take what came in, load the newest answer; once a second see whether the chip is still set up. */
void link_serve(cl_node *node, int64_t now_ms);

/* Whether something waits to be taken. */
bool link_busy(void);

/* Whether there is a radio that holds its settings. */
bool link_there(void);

#endif

/* What this node is told, in two flash sectors: under what it runs, and how that is changed over the air. */
#ifndef SETTINGS_H
#define SETTINGS_H

#include <stdbool.h>

#include "node.h"
#include "settings_record.h"

/* What this boot runs under; NULL if nobody has told this node who it is. Once interrupts are allowed. */
const cl_settings *settings_begin(void);

/* The plant as the node's state machine sees it, settings and all. */
void settings_join(cl_plant *plant);

/* Restarts the node when it is about to leave, and `saved`: the axes rest, and what is known of their position is written down. */
void settings_serve(const cl_node *node, int64_t now_ms, bool saved);

#endif

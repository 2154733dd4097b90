/* The search for zeros that ends at zero: the node's plant can do it for a host, and the operator's button asks for it. Held
 * for two seconds it makes the idle node home all its axes; pressed again it stops any homing. */
#ifndef HOME_H
#define HOME_H

#include <stdbool.h>

#include "node.h"

/* The place of translate's switch and of bias' stop is the lower limit of their travel. */
void home_start(const cl_axis_limits axes[CL_AXES]);

/* The motors as the node's state machine sees them, searches and all. */
cl_plant home_plant(void);

/* `news`: the motors have arrived or failed. */
void home_serve(cl_node *node, int64_t now_ms, bool news);

#endif

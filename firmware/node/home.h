/* The operator's button: held for two seconds it makes the idle node find its zero and go there; pressed again it
 * stops that. */
#ifndef HOME_H
#define HOME_H

#include <stdbool.h>

#include "node.h"

/* The place of translate's switch and of bias' stop is the lower limit of their travel. */
void home_start(const cl_axis_limits axes[CL_AXES]);

/* `news`: the motors have arrived or failed. */
void home_serve(cl_node *node, int64_t now_ms, bool news);

#endif

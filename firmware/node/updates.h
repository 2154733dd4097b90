/* What a program owes the loader that it may lie behind; nothing without one. docs/firmware-update.md. */
#ifndef UPDATES_H
#define UPDATES_H

#include "node.h"

/* The plant can go to its loader, if there is one. */
void updates_join(cl_plant *plant);

/* Once a host has been heard, note that this program can be: else it is started only once. */
void updates_serve(const cl_node *node);

#endif

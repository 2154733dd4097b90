/* What the parts of a node share: time and motion in node.c, frames in receive.c, errands in errand.c. Of others only the
   program includes it, for a fault that its plant meets at rest. */
#ifndef CL_NODE_PARTS_H
#define CL_NODE_PARTS_H

#include "node.h"

bool cl_lost_position(uint8_t fault);
bool cl_node_has_owner(const cl_node *node);
bool cl_node_may_move(const cl_node *node);

/* When the owner will have been silent for too long: its dead-man time after what it last heard of the node. */
int64_t cl_node_expires_ms(const cl_node *node);

/* What the node does and where it is; the steps are those of the run that it remembers. */
void cl_node_condition(const cl_node *node, int64_t now_ms, cl_condition *now);

/* Say that `ack` holds another answer. */
void cl_node_load(cl_node *node);

/* Load a fresh answer after a change of state, and find out when the next one is due. */
void cl_node_reload(cl_node *node, int64_t now_ms);

/* Set off for the target of the started step, if there is one and nothing forbids it. */
void cl_node_go_on(cl_node *node, int64_t now_ms);

/* Find out when time alone will change something next. */
void cl_node_schedule(cl_node *node);

/* What became of the order that is under way, if there is one: the first that is said of it stays. */
void cl_node_end_errand(cl_node *node, uint8_t outcome);

/* Whether axes are on their way, in a step or for an errand. */
bool cl_node_moves(const cl_node *node);

/* Do what a SERVICE of the live session asks for. */
void cl_node_serve(cl_node *node, int64_t now_ms, const cl_service_frame *frame);

/* Take a piece of other settings, or do what a SETTINGS of the live session orders. */
void cl_node_change(cl_node *node, const cl_settings_frame *frame);

/* Load the page that it asks for, as it is now. */
void cl_node_answer_service(cl_node *node, int64_t now_ms, const cl_service_frame *frame);

void cl_node_brake(cl_node *node, int64_t now_ms);

/* Somebody stopped the node, or its host holds it. */
bool cl_node_held(const cl_node *node);

/* Whatever turns comes to rest. */
void cl_node_halt(cl_node *node, int64_t now_ms);

/* Nothing has been done of any run. */
void cl_node_forget_run(cl_node *node);

void cl_node_forget_fault(cl_node *node);

/* Brake for a fault, of which the first one is remembered; a search for a zero goes on. */
void cl_node_fail(cl_node *node, int64_t now_ms, uint8_t fault, uint8_t axis);

#endif

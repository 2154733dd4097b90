"""The specification of a node, event by event; the firmware is held against it."""

"""Stable states: a rod refined to a tolerance, every state of a rod, which is which and what it is called."""

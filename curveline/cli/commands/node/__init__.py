"""`curveline node`: what one node says of itself, and what brings it back to work."""

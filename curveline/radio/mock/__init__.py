"""A display that is modelled: nodes, motors, lossy air, mishaps on request, and what it remembers."""

"""Which model a scene needs, what the others would leave out, and which states a display can show."""

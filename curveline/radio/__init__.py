"""The radio link: frames, host and node state machines, back ends. Never imports the physics or numpy."""

"""The radio link: what is in the air, the state machines of host and node, a mock display, the ports to real radios."""

"""What host and nodes say to each other: frames, the keys they are sealed with, and how axes move together."""

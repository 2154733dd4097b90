"""The host's side: what it decides without any I/O, and the loop that carries it out and keeps the record."""

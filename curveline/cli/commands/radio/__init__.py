"""`curveline radio`: the air between a host and its nodes."""

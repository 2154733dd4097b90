"""`curveline new`: files to begin with."""

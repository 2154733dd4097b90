"""`curveline runs`: the runs on record."""

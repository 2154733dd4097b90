"""Physics of the rod: arrays and floats only; no files, no printing, no clock."""

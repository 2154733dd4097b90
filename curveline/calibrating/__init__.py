"""A rod, its bearings and its nodes as trials of several shapes have them."""

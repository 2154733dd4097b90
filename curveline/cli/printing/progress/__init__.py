"""What people see while something takes long: bars, counters, a run on its way, answers that are drawn over."""

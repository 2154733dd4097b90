"""A sweep as a table: at which angles of the left node there is a peak, and how stable it is."""

import pandas

import curveline

report = curveline.sweep("shapes/level-up-peak.toml", {"nodes.1.angle_deg": (0.0, 40.0, 9)})
table = pandas.DataFrame(report.rows)
peaks = table[table["state"] == "peak"]
print(peaks[["nodes.1.angle_deg", "lowest_eigenvalue", "energy_mJ"]].to_string(index=False))

"""Every shape that comes with curveline: which states it has, and how stable the wanted one is."""

from pathlib import Path

import curveline

for path in sorted(Path("shapes").glob("level-*.toml")):
    for segment in curveline.simulate(path, tolerance=1e-4):
        names = ", ".join(state.name for state in segment.states)
        wanted = segment.wanted
        reserve = "missing" if wanted is None else f"{wanted.lowest_eigenvalue:.1f} EI/L^2"
        print(f"{path.stem}: {names}; the {segment.wanted_name} has {reserve}")

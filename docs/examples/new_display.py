"""A display of one's own: files to begin with, what such a display can do, and its shapes on two processes."""

import sys
import tempfile
from pathlib import Path

import curveline

if __name__ == "__main__":  # other processes read this file, too
    folder = Path(sys.argv[1] if len(sys.argv) > 1 else tempfile.mkdtemp())
    curveline.new_display(folder / "lab.toml", nodes=3)
    checked = curveline.check_display(folder / "lab.toml")
    held = checked.ability.held
    print(f"{checked.display.name} holds {1e3 * held.shortest:.0f} to {1e3 * held.longest:.0f} mm of rod")
    print(*(f"{each.key}: {each.message}" for each in checked.warnings), sep="\n")

    for state in ("peak", "valley"):
        curveline.new_shape(folder / f"{state}.toml", folder / "lab.toml", state)
    batch = curveline.simulate_many([folder / "peak.toml", folder / "valley.toml"], jobs=2)
    print(f"{sum(answer.is_as_wanted for answer in batch)} of {len(batch)} shapes as wanted")
    curveline.write(batch, folder / "curves.npz", force=True)

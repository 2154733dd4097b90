"""A figure: two shapes side by side, and the steps into one of them."""

import sys
from pathlib import Path

import curveline

folder = Path(sys.argv[1] if len(sys.argv) > 1 else ".")
reports = [curveline.simulate(f"shapes/level-up-{state}.toml") for state in ("peak", "valley")]
curveline.write(reports, folder / "shapes.svg", force=True)
curveline.write(curveline.plan("shapes/level-up-peak.toml"), folder / "plan.svg", force=True)
print(f"wrote shapes.svg and plan.svg to {folder}")

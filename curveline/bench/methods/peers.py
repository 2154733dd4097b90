"""Other codes that solve the same scenes: each in a file of its own, with a row in the table `PEERS`.

Each gets the same spline guess, closed to the chord; building its model and, where it compiles, compiling it is not
counted. The dynamic ones run until no vertex moves faster than `STILL`; what was tuned is said in each file.
"""

from __future__ import annotations

from curveline.bench.methods import collocation, mujoco, pyelastica
from curveline.bench.methods.own import Method

PEERS: tuple[Method, ...] = (*collocation.METHODS, *pyelastica.METHODS, *mujoco.METHODS)

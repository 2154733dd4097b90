"""Made-up runs of the benchmark."""

from __future__ import annotations

from curveline.bench.machine import Conditions, Machine, MachineLoad, Versions
from curveline.bench.measurement import Measurement
from curveline.bench.report import BenchReport
from curveline.bench.trade import TradePoint

ROW = Measurement("relax", 41.5, "us", "< 30", "from a guess", 0.01, 3.5, 0.02)
POINT = TradePoint("clamps", "planar", "one level", 100.0, "edges", 101, 0.027, 9e-5, 9e-7, 2.0, True, 2, 2)
CONDITIONS = Conditions(
    at=1.7e9,
    commit="c" * 40 + "+",
    kernels="shipped",
    versions=Versions("3.11.7", "2.4.6", "1.17.1", "0.68.1", "0.50.0"),
    machine=Machine("Some Processor", "x86_64", 2, 8000, "Linux"),
    load=MachineLoad(0.5, 0.02, 0.03),
)
REPORT = BenchReport((ROW, Measurement("found", 272.0, "", "", "")), (POINT,), CONDITIONS, shapes=("level-up-peak",))

"""A display of one's own: the built-in one with a thinner rod, and whether a plan still leads into a shape."""

from dataclasses import replace

import curveline
from curveline.scene import Node, Scene, Segment
from curveline.sections import Rectangle
from curveline.units import deg, mm

built_in = curveline.read_display("single")
thin = replace(built_in.rod, section=Rectangle(width=mm(10.0), thickness=mm(2.0)))
display = replace(built_in, name="thin", rod=thin, digest="thin")

nodes = (Node(0.0, deg(30.0)), Node(0.0, deg(-30.0)))
scene = Scene("arch", display, nodes, (Segment(mm(660.0), "peak"),))
try:
    plan = curveline.plan(scene)
    print(f"{plan.name}: {len(plan.steps)} steps, {plan.seconds:.0f} s")
except curveline.CurvelineError as error:
    print(error.message, error.hint, sep="\n")

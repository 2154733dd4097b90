"""Push at a shape's rod: where it snaps through, and into what; at one point, or all along the curve.

pushes        what pushes where, and the rod it stands on
snap_through  one push, from nothing to the snap-through
load_map      the snap-through load over the curve
falling       the fall from there, with inertia
results       pushes and maps as JSON
"""

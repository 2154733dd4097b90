"""Push at a shape's rod: where it snaps through, and into what; at one point, or all along the curve.

pushes    what pushes where, and the rod it stands on
snap      one push, from nothing to the snap-through
maps      the snap-through load over the curve
files     both as JSON
"""

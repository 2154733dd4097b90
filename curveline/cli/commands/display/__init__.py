"""`curveline display`: the built-in displays, and the lab's own."""

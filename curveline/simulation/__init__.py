"""From a scene to every stable state of its segments, one or many, and what is told of them."""

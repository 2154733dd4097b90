"""The set of a plastic rod: how its bending relaxes, what it remembers of the shapes that it was held in."""

"""The energy terms of the spatial rod: one file each, with its energy, gradient and exact Hessian."""

"""`python -m curveline` is the same as `curveline`."""

from curveline.cli import main

main()

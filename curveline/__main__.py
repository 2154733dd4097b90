"""`python -m curveline` is the same as `curveline`."""

from curveline.cli.app import main

main()

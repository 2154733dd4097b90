"""`curveline camera`: what is printed for a camera, its lens, and where it stands."""

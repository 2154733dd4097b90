"""`curveline calibrate`: numbers of a display from what a lab measured."""

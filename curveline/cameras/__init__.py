"""Cameras: what a lens does to a picture, where a camera stands before a display, what is printed for either."""

"""Photographs of a display that nobody took: for tests, for demonstrations, and for the camera of the mock."""

"""Trials of a real display held against the model: read, laid over each other, named, measured."""

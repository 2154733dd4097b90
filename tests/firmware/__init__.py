"""Tests of the firmware, compiled for this machine or run in a model of its own."""

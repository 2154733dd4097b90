"""Runs and displays being driven, as data."""

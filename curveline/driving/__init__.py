"""Displays being driven and runs on record, as data: what the command line and scripts both call. Nothing prints."""

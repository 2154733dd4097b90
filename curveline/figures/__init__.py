"""Figures for reports, a module per kind: true to aspect, in mm, the same bytes for the same content."""

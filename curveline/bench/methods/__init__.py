"""The scenes that are measured, and what solves them: methods of curveline and of others."""

"""What a display can do, and what looks odd in its file."""

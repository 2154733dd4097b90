"""The version, by itself: whatever says it need not know the names that the package shows."""

__version__ = "0.1.0"

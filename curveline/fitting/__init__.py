"""From a drawn curve to the shape of a display that shows it."""

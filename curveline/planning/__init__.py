"""From where a display stands to a shape, or several: steps, each proven before a motor turns."""

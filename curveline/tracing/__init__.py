"""From a photograph of a display to the curve that its rod shows, and which of the stable states that is."""

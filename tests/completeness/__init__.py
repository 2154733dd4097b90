"""Yardsticks that share no solver with the product: are all stable states found, and none that is not there."""

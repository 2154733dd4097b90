"""Yardsticks that `curveline bench` holds its figures against, written without anything of curveline's."""

"""`curveline keys`: the key file of a site, and what nodes must be given to belong to it."""

"""Several displays in one run: the lines of a folder, checked against each other, sent together and gone on with."""

"""The keys of a site: where they are kept, and how they get into a node's program."""

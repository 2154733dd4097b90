"""Results as text: a module for each kind of result, named like it."""

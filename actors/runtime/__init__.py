"""One life of a node, and what outlives it."""

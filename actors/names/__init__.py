"""Names: what is legal, how a name is made absolute, remapping rules, and who a node is."""

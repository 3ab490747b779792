"""Names: validity, expansion to full names, remapping rules, and the identity of a node."""

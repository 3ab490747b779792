"""The running system: one incarnation of a node, the record that outlives it, and what all nodes of a system share."""

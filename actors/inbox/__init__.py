"""The inbox of a node: its queue of work items, the items that end an incarnation, and the measurement of load."""

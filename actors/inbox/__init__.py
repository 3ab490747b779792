"""The inbox of a node: everything its own code must do, one item after another, and what ends it."""

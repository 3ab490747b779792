"""The graph: topics, services and actions by name, the matching of their endpoints, and snapshots of the whole."""

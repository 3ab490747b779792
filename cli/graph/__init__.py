"""The graph of a domain as a command sees it."""

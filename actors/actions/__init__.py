"""Actions: clients and servers of goals, and the Protocols between them."""

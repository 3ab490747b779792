"""Actions at work: clients and servers of goals."""

"""Services at work: clients and servers."""

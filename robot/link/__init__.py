"""The body in a process of its own: what its controllers meet of it in theirs, over shared memory. Physics goes on, whatever happens to them."""

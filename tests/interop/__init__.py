"""Interoperation with programs that we did not write, each a process of its own. Not part of the default run."""

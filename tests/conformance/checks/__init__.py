"""One module per vector file, found by the file's name.

Each has `cases(path)`, which yields (case id, tier, callable); the callable raises AssertionError when `actors` does
not do what the case says, and `Skip` when it cannot be asked. Where `actors` departs from an edge case on purpose, the
module's docstring says so.
"""

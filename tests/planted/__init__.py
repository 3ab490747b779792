"""Small systems with one planted bug each, and their healthy twins: what `explore` must find, and what it must leave in peace.

Each module has `tree`, with the bug, and `healthy`, without it. ``python -m tests.planted`` tries them all and prints a table.
"""

"""Every behaviour that the tutorials promise, row by row, and the tests that show it: ``python -m tests.scenarios``."""

"""Mutation testing of the core: small deliberate mistakes, one at a time, that the tests must notice.

``python -m tests.tools.mutants --count 300 --seed 0 --only channel`` prints every mutant with its fate, and the score. It takes long and is
not part of the normal tests.
"""

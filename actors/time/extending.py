"""How an event loop that exists already is given further methods: it becomes an object of a derived class."""

from __future__ import annotations


def extend(instance: object, mixin: type) -> None:
    """Let `instance` be of a class derived from its present one, with the methods of `mixin` before its own. It stays so for good.

    `mixin` calls the methods that it overrides by `super()`. Raises `TypeError` for an object that is not of a class written in Python.
    """
    kind = type(instance)
    instance.__class__ = type(kind.__name__, (mixin, kind), {"__module__": kind.__module__})

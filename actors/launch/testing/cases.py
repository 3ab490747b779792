"""The test classes of a launch test: which run when, and what their methods are given."""

from __future__ import annotations

import functools
import inspect
import unittest
from collections.abc import Callable, Mapping, Sequence
from types import ModuleType
from typing import Any


def suite_of(module: ModuleType, given: Mapping[str, object], *, after: bool) -> unittest.TestSuite:
    """The tests of a module that run beside the launch, or those that run `after` its end.

    What is `given` reaches a test, ``setUp`` and so on by the names of their arguments, and as ``self.<name>``.
    """
    loader = unittest.TestLoader()
    suite = unittest.TestSuite()
    for case in vars(module).values():
        if not (isinstance(case, type) and issubclass(case, unittest.TestCase)) or case.__module__ != module.__name__:
            continue
        if getattr(case, "__post_shutdown_test__", False) == after:
            suite.addTest(loader.loadTestsFromTestCase(_bound(case, loader.getTestCaseNames(case), given)))
    return suite


def _bound(case: type[unittest.TestCase], names: Sequence[str], given: Mapping[str, Any]) -> type[unittest.TestCase]:
    """The class with methods that get what they ask for."""
    members: dict[str, Any] = {name: value for name, value in given.items() if not hasattr(case, name)}
    for name in (*names, "setUp", "tearDown"):
        members[name] = _with(getattr(case, name), given)
    for name in ("setUpClass", "tearDownClass"):
        members[name] = classmethod(_with(getattr(case, name).__func__, given))
    members["__module__"], members["__qualname__"] = case.__module__, case.__qualname__
    return type(case.__name__, (case,), members)


def _with(function: Callable[..., object], given: Mapping[str, object]) -> Callable[..., object]:
    chosen = {name: given[name] for name in inspect.signature(function).parameters if name in given}

    @functools.wraps(function)
    def call(*arguments: object) -> Any:
        return function(*arguments, **chosen)

    return call

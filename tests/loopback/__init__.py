"""A system whose nodes talk to each other as if each were in a process of its own: every message is bytes on its way.

Nodes, publishers, subscriptions, clients and servers are those of `actors`, unchanged. Between them stand peers that know of the other side
only what has come as bytes or as an announcement; they take their place in the graph by the Protocols that a transport has to satisfy. The
scenario tests run on it as they are (`borrowed`), and so say what a transport has to keep.
"""

from __future__ import annotations

import inspect
from collections.abc import Callable, Mapping
from types import ModuleType
from typing import Any, TypeVar

from actors.interfaces.cdr import decode, encode
from actors.interfaces.message import Message

__all__ = ["borrowed", "carried"]

M = TypeVar("M", bound=Message)


def carried(message: M) -> M:
    """The message as it arrives in another process: encoded and decoded."""
    return decode(type(message), encode(message))


def borrowed(module: ModuleType, *, but: Mapping[str, str]) -> dict[str, Callable[..., Any]]:
    """The tests of a scenario module that use `rig`, by their names; without those in `but`, name -> why it says nothing about a transport."""
    tests = {
        name: test
        for name, test in vars(module).items()
        if name.startswith("test_") and inspect.isfunction(test) and "rig" in inspect.signature(test).parameters
    }
    unknown = set(but) - set(tests)
    assert not unknown, f"{module.__name__} has no such tests: {sorted(unknown)}"
    return {name: test for name, test in tests.items() if name not in but}

"""Messages and their types as pickles: a type by its ROS name, a message as CDR."""

from __future__ import annotations

import importlib
import io
import pickle
from typing import Any

from actors.interfaces import decode, encode, lookup, registry
from actors.interfaces.message import Message


class _Pickler(pickle.Pickler):
    def reducer_override(self, thing: Any) -> Any:
        if isinstance(thing, type) and hasattr(thing, "__ros_type__"):
            return type_of, (thing.__ros_type__,)
        if isinstance(thing, Message):
            return message_of, (type(thing).__ros_type__, encode(thing))
        return NotImplemented


def dumps(thing: Any) -> bytes:
    """As `pickle.dumps`; `pickle.loads` reads it."""
    out = io.BytesIO()
    _Pickler(out).dump(thing)
    return out.getvalue()


def type_of(name: str) -> Any:
    """The type of a full ROS name, also of a part of an action."""
    found = lookup.find(name)
    if found is None:  # a part that is made when it is first asked for
        importlib.import_module("tests.conformance.checks.action_status")
        found = registry.known(name)
    assert found is not None, name
    return found


def message_of(name: str, payload: bytes) -> Any:
    return decode(type_of(name), payload)

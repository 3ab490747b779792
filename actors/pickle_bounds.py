"""Pickles of strangers, read without executing any of them, in time and memory that grow with their length alone."""

# pyright: reportUnknownVariableType=false, reportUnknownMemberType=false, reportUnknownArgumentType=false
# What strangers have written has no type before it is checked.

from __future__ import annotations

import enum
import pickle
from collections import OrderedDict, defaultdict, deque
from collections.abc import Iterable
from io import BytesIO
from typing import Any, Final, NoReturn, cast

import msgspec

DEEPEST: Final = 100
"""Levels of nesting: what shows or compares a value recurses once and more for each."""
WEAK_KEYS: Final = 10_000
"""Keys of dictionaries and sets whose hashes the author of the bytes can choose: as many that collide take about a second."""


class UnreadablePickle(ValueError):
    """Bytes that are no pickle, or ask for more than values, or for more of them than their length justifies."""


class Steps(dict[int, object]):
    """What each code of a pickle does, for so many codes in all. Each makes less than 300 bytes, or what it holds itself."""

    def __init__(self, most: int) -> None:
        super().__init__(_ACTS)
        self._left = most

    def __getitem__(self, code: int, /) -> Any:
        self._left -= 1
        if self._left < 0:
            raise UnreadablePickle("it makes more values than its length justifies")
        return super().__getitem__(code)


_Unpickler: Any = getattr(pickle, "_Unpickler")  # noqa: B009  # which no stub names
"""That in Python: the one in C makes room for as many values as the bytes say that it remembers, and cannot be told what it must not do."""


class BoundedUnpickler(_Unpickler):  # type: ignore[misc]  # a class that no stub names
    """Reads what `pickle` has written with protocol 4 or 5.

    It calls what `find_class` returns and nothing else: no attribute is set, no method of a value is called, and nothing is hashed by code of
    its own. A subclass says what may be called. `load` raises any error for bytes that it does not read.
    """

    def __init__(self, data: bytes, steps: Steps) -> None:
        super().__init__(BytesIO(data))
        self.dispatch = steps
        self._weak = 0

    def call(self, function: Any, arguments: tuple[Any, ...], keywords: dict[str, Any]) -> Any:
        """The result of a function or class that `find_class`, or a call, has returned."""
        return function(*arguments, **keywords)

    def refuse(self, value: object) -> None:
        """Called where the bytes would set attributes or contents of a value that is no container. Raises `UnreadablePickle`."""
        raise UnreadablePickle(f"it changes an object of {type(value).__name__:.100}")

    def persistent_load(self, pid: object) -> NoReturn:
        raise UnreadablePickle("it speaks of what is kept elsewhere")

    def _check_keys(self, keys: Iterable[Any]) -> None:
        for key in keys:
            kind: Any = type(key)
            if kind in _STRONG or (kind is int and abs(key) < _MODULUS) or kind.__hash__ is _OF_ENUMERATIONS:
                continue
            self._weak += 1
            if self._weak > WEAK_KEYS:
                raise UnreadablePickle(f"more than {WEAK_KEYS} keys are neither texts nor small integers")
            _check_key(key)

    def _call(self) -> None:
        arguments, function = self.stack.pop(), self.stack.pop()
        self._call_with(function, arguments, {})

    def _call_with_keywords(self) -> None:
        keywords, arguments, function = self.stack.pop(), self.stack.pop(), self.stack.pop()
        self._call_with(function, arguments, keywords)

    def _call_with(self, function: Any, arguments: Any, keywords: Any) -> None:
        kinds: tuple[Any, ...] = type(arguments), type(keywords)
        if kinds != (tuple, dict):
            raise UnreadablePickle("it calls something with what are no arguments")
        self.append(self.call(function, arguments, keywords))

    def _byte_array(self) -> None:
        self.append(bytearray(self.read(int.from_bytes(self.read(8), "little"))))

    def _build(self) -> None:
        self.stack.pop()
        self.refuse(self.stack[-1])

    def _append(self, items: object) -> None:
        target = self.stack[-1]
        if type(target) in (list, deque):
            target.extend(items)
        else:
            self.refuse(target)

    def _set(self, items: list[object]) -> None:
        target = self.stack[-1]
        if type(target) not in (dict, OrderedDict, defaultdict):
            self.refuse(target)
            return
        self._check_keys(items[::2])
        target.update(zip(items[::2], items[1::2], strict=True))

    def _append_one(self) -> None:
        self._append((self.stack.pop(),))

    def _append_all(self) -> None:
        self._append(self.pop_mark())

    def _set_one(self) -> None:
        value, key = self.stack.pop(), self.stack.pop()
        self._set([key, value])

    def _set_all(self) -> None:
        self._set(self.pop_mark())

    def _add_all(self) -> None:
        items = self.pop_mark()
        if type(self.stack[-1]) is not set:
            raise UnreadablePickle("it adds to what is no set")
        self._check_keys(items)
        self.stack[-1].update(items)

    def _frozen_set(self) -> None:
        items = self.pop_mark()
        self._check_keys(items)
        self.append(frozenset(items))


_KEPT: Final = (
    "PROTO", "FRAME", "STOP", "MARK", "POP", "POP_MARK", "NONE", "NEWTRUE", "NEWFALSE", "BININT", "BININT1", "BININT2", "LONG1", "LONG4",
    "BINFLOAT", "SHORT_BINBYTES", "BINBYTES", "BINBYTES8", "SHORT_BINUNICODE", "BINUNICODE", "BINUNICODE8", "EMPTY_TUPLE", "TUPLE",
    "TUPLE1", "TUPLE2", "TUPLE3", "EMPTY_LIST", "EMPTY_DICT", "EMPTY_SET", "MEMOIZE", "BINGET", "LONG_BINGET", "STACK_GLOBAL", "BINPERSID",
)  # fmt: skip
_REPLACED: Final = {
    "REDUCE": "_call", "NEWOBJ": "_call", "NEWOBJ_EX": "_call_with_keywords",
    "BYTEARRAY8": "_byte_array", "BUILD": "_build", "APPEND": "_append_one", "APPENDS": "_append_all", "SETITEM": "_set_one",
    "SETITEMS": "_set_all", "ADDITEMS": "_add_all", "FROZENSET": "_frozen_set",
}  # fmt: skip
_ACTS: Final[dict[int, object]] = {
    **{code: _Unpickler.dispatch[code] for code in (getattr(pickle, name)[0] for name in _KEPT)},
    **{getattr(pickle, name)[0]: getattr(BoundedUnpickler, act) for name, act in _REPLACED.items()},
}
"""What `pickle` writes with protocols 4 and 5, but for buffers outside of the bytes and numbers of registered classes."""

_STRONG: Final = frozenset((str, bytes, bool, type(None)))
_MODULUS: Final = 2**61 - 1
"""Smaller integers are their own hashes."""
_OF_ENUMERATIONS: Final = enum.Enum.__hash__
_OF_STRUCTURES: Final = msgspec.Struct.__hash__
_HASHES: Final = frozenset((object.__hash__, type.__hash__, int.__hash__, str.__hash__, _OF_ENUMERATIONS))
"""Of kinds that have no parts, beside those of `_KINDS`."""
_KINDS: Final = frozenset((
    "builtins:float", "builtins:complex", "datetime:date", "datetime:datetime", "datetime:time", "datetime:timedelta", "datetime:timezone",
    "pathlib:PosixPath", "pathlib:PurePosixPath", "pathlib._local:PosixPath", "pathlib._local:PurePosixPath", "decimal:Decimal", "uuid:UUID",
))  # fmt: skip


def _check_key(key: Any) -> None:
    """Raise `UnreadablePickle` for a key whose hash calls code of others, or takes longer than a thousand values justify."""
    waiting = [key]
    for _ in range(1000):
        if not waiting:
            return
        one = waiting.pop()
        kind: Any = type(one)
        if kind.__hash__ in (tuple.__hash__, frozenset.__hash__):
            waiting.extend(one)
        elif kind.__hash__ is _OF_STRUCTURES and isinstance(one, msgspec.Struct):
            waiting.extend(getattr(one, name) for name in one.__struct_fields__)
        elif kind.__hash__ not in _HASHES and f"{kind.__module__}:{kind.__qualname__}" not in _KINDS:
            raise UnreadablePickle(f"a key is of {kind.__module__}.{kind.__qualname__}, which may call code of its own")
    raise UnreadablePickle("a key has too many parts")


_LEAVES: Final = frozenset((str, int, float, bool, bytes, type(None), bytearray, complex))


def new_error(kind: type[BaseException], arguments: tuple[object, ...]) -> BaseException:
    """An error with these arguments, made by the built-in class that its class extends: no code of others is called."""
    new: Any = next(
        vars(one)["__new__"] for one in kind.__mro__ if one.__module__ == "builtins" and "__new__" in vars(one)
    )
    error: BaseException = new(kind, *arguments)
    return error


def check_extent(value: object, most: int) -> None:
    """Raise `UnreadablePickle` for a value that is nested deeper than `DEEPEST`, or has more than `most` parts.

    A part that is held at several places counts at each: what shows, compares or encodes a value goes through it each time. One that holds
    itself is followed once.
    """
    sizes: dict[int, int] = {}
    waiting: list[tuple[object, list[object] | None]] = [(value, None)]
    depth = 0
    while waiting:
        one, parts = waiting.pop()
        if parts is not None:  # all of them have their sizes
            depth -= 1
            sizes[id(one)] = size = 1 + sum(1 if type(part) in _LEAVES else sizes[id(part)] for part in parts)
            if size > most:
                raise UnreadablePickle(f"it holds more than {most} values, one of them at many places")
        elif id(one) not in sizes and type(one) not in _LEAVES:
            depth += 1
            if depth > DEEPEST:
                raise UnreadablePickle(f"it is nested more than {DEEPEST} levels deep")
            sizes[id(one)] = 1
            parts = _parts(one)
            waiting.append((one, parts))
            waiting.extend((part, None) for part in parts)


def _parts(value: object) -> list[object]:
    """What a value holds, found without calling code of its class."""
    for base in cast("tuple[Any, ...]", (tuple, list, set, frozenset, deque)):
        if isinstance(value, base):
            return list(base.__iter__(value))
    if isinstance(value, dict):
        known: dict[object, object] = value
        return [*dict.keys(known), *dict.values(known)]
    if isinstance(value, msgspec.Struct):
        return [getattr(value, name) for name in value.__struct_fields__]
    if isinstance(value, (type, enum.Enum)) or type(value).__module__ == "numpy":
        return []
    state: object = object.__getstate__(value)
    states = state if isinstance(state, tuple) else (state,)
    held = [part for one in states if isinstance(one, dict) for part in cast("dict[str, Any]", one).values()]
    return [*held, *value.args] if isinstance(value, BaseException) else held

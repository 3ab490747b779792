"""How a journal is written: values as bytes, and back, without calling what the bytes name.

The bytes are a pickle of a restricted kind. Objects are written by their attributes, errors by their arguments, classes by their names, so
that reading needs only the functions of this module and a few others, named in `CALLED`, which make values and nothing else. What
a class has to say of its own pickling (`__reduce__`) is kept too, but is read only with `trust`.
"""

# pyright: reportUnknownVariableType=false, reportUnknownMemberType=false, reportUnknownArgumentType=false
# What strangers have written has no type before it is checked.

from __future__ import annotations

import enum
import importlib
import pickle
import sys
from collections import Counter, OrderedDict
from contextvars import ContextVar
from datetime import timedelta, timezone
from io import BytesIO
from types import MemberDescriptorType, ModuleType
from typing import Any, Final, cast

import msgspec

from actors.errors import described
from actors.interfaces.lookup import get_message
from actors.interfaces.message import Message
from actors.pickle_bounds import BoundedUnpickler, Steps, UnreadablePickle, check_extent, new_error
from actors.replay.errors import ReplayError
from actors.runtime.node import Node
from actors.supervision.child import Child

CALLED: Final = frozenset({
    *(f"{__name__}:{name}" for name in ("class_named", "message_named", "error_made", "object_made", "object_filled", "tuple_made", "child_made")),
    *(f"{__name__}:{name}" for name in ("array_made", "scalar_made")),
    *(f"collections:{name}" for name in ("Counter", "OrderedDict", "defaultdict", "deque")),
    *(f"builtins:{name}" for name in ("complex", "range", "slice")),
    *(f"datetime:{name}" for name in ("date", "datetime", "time", "timedelta", "timezone")),
    *("msgspec._utils:rebuild", "actors.qos.policies:_rebuild"),
    *("pathlib:Path", "pathlib:PosixPath", "pathlib:PurePosixPath", "decimal:Decimal", "uuid:UUID"),
    *("pathlib._local:PosixPath", "pathlib._local:PurePosixPath"),  # their names in Python 3.13
})  # fmt: skip
"""What may be called while a journal is read: MODULE:NAME. Classes that a journal names are not among it; see `class_named`."""
_PLAIN: Final = (bool, int, float, str, bytes, tuple, list, dict, type(None), timedelta, timezone)
"""The types of what is given to what stands in `CALLED` and is not of this module: no methods of other classes are called by it."""
rebuild: Final[Any] = getattr(importlib.import_module("msgspec._utils"), "rebuild")  # noqa: B009  # by which structures are pickled
_HELD: Final = frozenset((bool, int, float, str, bytes, type(None)))
_NUMBERS: Final = frozenset("?bBhHiIlLqQefdgFDGSUmM")
"""The kinds of elements of arrays that are kept, by `numpy.dtype.char`: none is, or holds, a pointer."""
MOST_LETTERS: Final = 500
"""Of a name."""
_ARGUMENTS: Final[Any] = vars(BaseException)["args"]
_TRUSTED: Final = ContextVar("journal is trusted", default=False)


def frozen(value: object) -> bytes:
    """`value` as it is now. Raises `ReplayError` for one that cannot be kept."""
    file = BytesIO()
    try:
        _Writing(file, pickle.HIGHEST_PROTOCOL).dump(value)
    except Exception as error:
        raise ReplayError(described(error)) from error
    return file.getvalue()


def thawed(data: bytes, *, trust: bool = False, steps: Steps | None = None) -> Any:
    """What `frozen` has kept. No code is called that it names, and no module imported but those of this library, unless with `trust`.

    Without `trust` it takes time and memory in proportion to its length; `steps` may bound several values together. Raises `ReplayError` if it
    cannot be made here, for example for want of a module, or of trust.
    """
    before = _TRUSTED.set(trust)
    try:
        if trust:
            return pickle.loads(data)
        value = _Reading(data, Steps(steps_for(len(data))) if steps is None else steps).load()
        check_extent(value, 100_000 + 50 * len(data))
        return value
    except ReplayError:
        raise
    except UnreadablePickle as error:
        raise ReplayError(f"{error}: replay it with --trust (trust=True) if you trust its origin") from error
    except Exception as error:
        raise ReplayError(f"what the journal has kept cannot be made here: {described(error)}") from error
    finally:
        _TRUSTED.reset(before)


def steps_for(size: int) -> int:
    """How many steps of a pickle so many bytes of a journal, or of its compressed parts, may take: those that we write take 0.6 a byte."""
    return 1_000_000 + 4 * size


class _Writing(pickle.Pickler):
    def reducer_override(self, value: Any) -> Any:
        kind = cast("Any", type(value))
        if issubclass(kind, type):
            named: Any = value
            if not _may_be_named(named):
                return NotImplemented
            if (
                issubclass(named, Message) and named.__module__ not in sys.modules
            ):  # a type that was defined at run time
                return message_named, (named.__ros_type__,)
            return class_named, _name_of(named)
        if issubclass(kind, BaseException):
            return error_made, (*_name_of(kind), value.args, dict(value.__dict__))
        if kind is Child and isinstance(value.factory, type):
            fields = {name: getattr(value, name) for name in Child.__slots__ if name != "factory"}
            return child_made, (*_name_of(value.factory), fields)
        if kind.__module__ == "builtins":
            return NotImplemented
        if kind.__module__ == "numpy" and (made := _of_numpy(value)) is not None:
            return made
        if _is_named_tuple(kind):
            return tuple_made, (*_name_of(kind), tuple(value))
        if _is_plain(kind):
            return object_made, _name_of(kind), object.__getstate__(value), None, None, object_filled
        return NotImplemented


class _Reading(BoundedUnpickler):
    def find_class(self, module: str, name: str, /) -> object:
        if f"{module}:{name}" not in CALLED:
            raise ReplayError(
                f"the journal wants {module:.200}.{name:.200} to be called: replay it with --trust (trust=True) if you trust its origin"
            )
        found = super().find_class(module, name)
        if found is rebuild:
            return _structure_made
        return found if isinstance(found, type(_named)) else _with_plain(found)

    def call(self, function: Any, arguments: tuple[object, ...], keywords: dict[str, object]) -> Any:
        if keywords:
            raise ReplayError("the journal calls something with keywords")
        if isinstance(function, type):  # which `class_named` has found
            _check_contents(function, arguments)
        return function(*arguments)


def _structure_made(kind: object, fields: object) -> object:
    """A structure with these fields: `msgspec._utils.rebuild`."""
    if not (isinstance(kind, type) and _may_be_named(kind) and type(fields) is dict):
        raise ReplayError("the journal holds a structure without its class or its fields")
    _check_contents(kind, tuple(cast("dict[str, Any]", fields).values()))
    return rebuild(kind, fields)


def _check_contents(kind: type[Any], values: tuple[object, ...]) -> None:
    """Raise `ReplayError` if a message or an enumeration would be made of something that it would convert by methods of others."""
    if issubclass(kind, enum.Enum) and any(type(one) not in _PLAIN for one in values):
        raise ReplayError(f"{kind.__name__:.100}, which the journal names, has no such member")
    if issubclass(kind, Message) and not all(map(_may_be_held, values)):
        raise ReplayError(f"the journal holds a message {kind.__name__:.100} of what no message holds")


def _may_be_held(value: Any) -> bool:
    """Whether it is what fields of messages hold."""
    kind: object = type(value)
    if kind is tuple:
        return all(map(_may_be_held, value))
    return type(value) in _HELD or isinstance(value, Message) or type(value).__module__ == "numpy"


def _with_plain(function: Any) -> object:
    """The function, for plain arguments only."""

    def call(*arguments: Any) -> Any:
        kinds = (dict,) if function in (Counter, OrderedDict) else _PLAIN  # what a list holds would be hashed
        if any(type(one) not in kinds for one in arguments):
            raise ReplayError(f"the journal wants {function.__qualname__} to be called with what is no plain value")
        return function(*arguments)

    return call


def _of_numpy(value: object) -> object:
    """How an array or a number of numpy is written; None for one with elements that are objects or have fields."""
    import numpy as np

    known: Any = value  # numpy's own types tell less
    if not isinstance(value, (np.ndarray, np.generic)) or known.dtype.char not in _NUMBERS:
        return None
    if isinstance(value, np.generic):
        return scalar_made, (known.dtype.str, known.tobytes())
    return array_made, (known.dtype.str, known.shape, known.tobytes(), known.flags.writeable)


# -- what is called by the bytes ----------------------------------------------------------------------------------------------------


def class_named(module: str, name: str) -> type[object]:
    """A class of values: a message, an interface, a structure or an enumeration. Raises `ReplayError` for another."""
    found: object = _named(module, name)
    if not _may_be_named(found):
        raise ReplayError(
            f"{module}.{name}, which the journal names, is no class of messages, structures or enumerations"
        )
    return cast("type[Any]", found)


def array_made(dtype: str, shape: tuple[int, ...], data: bytes, writable: bool) -> Any:
    """An array of numbers or texts. Raises `ReplayError` for elements that are anything else."""
    import numpy as np

    _check(dtype=(dtype, str), shape=(shape, tuple), data=(data, bytes))
    kind = np.dtype(dtype[:100])
    if kind.char not in _NUMBERS or len(shape) > 64 or any(type(one) is not int for one in shape):
        raise ReplayError(f"the journal holds an array of {dtype:.100}, which are no numbers, or have no shape")
    array: Any = np.frombuffer(data, kind) if kind.itemsize and data else np.zeros(0, kind)
    array = array.reshape(shape)
    return array.copy() if writable else array


def scalar_made(dtype: str, data: bytes) -> Any:
    """A number of numpy."""
    return array_made(dtype, (1,), data, False)[0]


def message_named(name: str) -> type[Message]:
    """The type of messages of this name. Raises `InterfaceError` if it is not known here."""
    _check(name=(name, str))
    return get_message(name[:MOST_LETTERS])


def error_made(module: str, name: str, arguments: tuple[object, ...], attributes: dict[str, object]) -> BaseException:
    """An error with these arguments and attributes, without a call of its class, which many do not bear."""
    kind: object = _named(module, name)
    if not (isinstance(kind, type) and issubclass(kind, BaseException)):
        raise ReplayError(f"{module}.{name}, which the journal names, is no class of errors")
    _check(arguments=(arguments, tuple), attributes=(attributes, dict))
    error = new_error(kind, arguments)
    _ARGUMENTS.__set__(error, arguments)
    vars(error).update(attributes)
    return error


def object_made(module: str, name: str) -> object:
    """An object without attributes yet, of a class whose objects are no more than their attributes."""
    kind: Any = _named(module, name)
    if not _is_plain(kind):
        raise ReplayError(f"{module}.{name}, which the journal names, is no class of plain objects")
    return cast("object", object.__new__(kind))


def object_filled(value: object, state: object) -> None:
    """Set the attributes of an object that `object_made` has made."""
    if not _is_plain(type(value)):
        raise ReplayError(f"{type(value).__name__} is no class of plain objects")
    parts: Any = state if isinstance(state, tuple) else (state, None)  # what has slots has two
    if len(parts) != 2 or any(type(part) not in (dict, type(None)) for part in parts):
        raise ReplayError(f"the journal has no attributes of a {type(value).__name__:.100}")
    attributes, slots = parts
    if attributes:
        vars(value).update(attributes)
    for name, one in (slots or {}).items():
        place = next((vars(kind)[name] for kind in type(value).__mro__ if name in vars(kind)), None)
        if not isinstance(place, MemberDescriptorType):  # else its class would act
            raise ReplayError(f"{type(value).__name__:.100} has no slot {name!r:.100}")
        place.__set__(value, one)


def tuple_made(module: str, name: str, values: tuple[object, ...]) -> tuple[object, ...]:
    """A named tuple."""
    kind: object = _named(module, name)
    if not _is_named_tuple(kind):
        raise ReplayError(f"{module}.{name}, which the journal names, is no named tuple")
    _check(values=(values, tuple))
    make = cast("Any", tuple)  # not the class itself, which may do more
    return cast("tuple[Any, ...]", make.__new__(kind, values))


def child_made(module: str, name: str, fields: dict[str, Any]) -> Child:
    """The declaration of a node, whose class is this one."""
    factory: object = _named(module, name)
    if not (isinstance(factory, type) and issubclass(factory, Node)):
        raise ReplayError(f"{module}.{name}, which the journal names, is no class of nodes")
    return Child(factory, **fields)


# -- kinds of classes ---------------------------------------------------------------------------------------------------------------


_OURS: Final = ("actors", "robot")
"""The packages of this distribution: their import does nothing but define what is in them."""


def _check(**values: tuple[object, type[object]]) -> None:
    """Raise `ReplayError` for a value that is not exactly of its type: another could act, or stand for more than it takes."""
    for name, (value, kind) in values.items():
        if type(value) is not kind:
            raise ReplayError(f"the journal has no {name} where it should")


def _name_of(value: Any) -> tuple[str, str]:
    return value.__module__, value.__qualname__


def _named(module: str, name: str) -> Any:
    _check(module=(module, str), name=(name, str))
    if max(len(module), len(name)) > MOST_LETTERS:
        raise ReplayError(f"the journal names {module:.100}.{name:.100}..., which is too long")
    if not (module in sys.modules or _TRUSTED.get() or module.partition(".")[0] in _OURS):
        raise ReplayError(
            f"the journal names the module {module}, which is not imported: import it before, or replay with --trust (trust=True) if you trust "
            "its origin"
        )
    found: object = importlib.import_module(module)
    for part in name.split("."):
        # not `getattr`, which calls code of modules and classes
        found = getattr(found, part) if _TRUSTED.get() else _contents(found).get(part)
    return found


def _contents(one: object) -> Any:
    return vars(one) if isinstance(one, (type, ModuleType)) else {}


def _may_be_named(kind: object) -> bool:
    """Whether it is a class whose call makes a value and does nothing else."""
    return isinstance(kind, type) and (
        issubclass(kind, (msgspec.Struct, enum.Enum)) or any("__ros_type__" in vars(one) for one in kind.__mro__)
    )


def _is_named_tuple(kind: object) -> bool:
    return isinstance(kind, type) and issubclass(kind, tuple) and any("_fields" in vars(one) for one in kind.__mro__)


def _is_plain(kind: object) -> bool:
    """Whether it is a class whose objects are pickled by their attributes alone, and end without a call of theirs."""
    if not isinstance(kind, type) or any("__del__" in vars(one) for one in kind.__mro__):
        return False
    makes = all(getattr(kind, name) is getattr(object, name) for name in ("__new__", "__reduce__", "__reduce_ex__"))
    return makes and _is_usual(kind, "__getstate__") and _is_usual(kind, "__setstate__")


def _is_usual(kind: object, name: str) -> bool:
    """Whether the class does not replace this method, or only by that of a dataclass with slots, which does the same."""
    found: object = getattr(kind, name, None)
    return found is None or found is getattr(object, name, None) or found.__module__ == "dataclasses"

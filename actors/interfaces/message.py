"""`Message`, the base of all messages; `ServiceType` and `ActionType`, which tie messages together.

A message is a value: it never changes once built, so it is passed by reference inside a process and nobody sees
anybody else's edits. `msg.replace(x=1.0)` builds a changed one.
"""

from __future__ import annotations

import sys
from collections.abc import Callable
from types import FunctionType
from typing import TYPE_CHECKING, Any, ClassVar, Generic, NoReturn, TypeAlias, TypeVar, get_args, get_origin

import msgspec

from actors.interfaces.annotations import read_class
from actors.interfaces.errors import BadDeclaration, MessageTypeError
from actors.interfaces.fields import STRINGS, Constant, FieldType
from actors.interfaces.naming import closest, own_type_name
from actors.interfaces.registry import register

if TYPE_CHECKING:
    import builtins
    from typing import Self

    StructMeta = msgspec.StructMeta
else:
    StructMeta = type(msgspec.Struct)


class Field(msgspec.Struct, frozen=True):
    """One field of a message.

    `default` is the default as plain data (a tuple for arrays) or None for the default of ROS: zero, empty, or the
    default message. `message` is the class of a nested message, None for primitives.

    It has no public constructor: `fields_of` gives those of a message class.
    """

    name: str
    type: FieldType
    default: object = None
    message: builtins.type[Message] | None = None

    def __str__(self) -> str:
        return f"{self.type} {self.name}" if self.default is None else f"{self.type} {self.name} {self.default!r}"


class MessageBase(msgspec.Struct, frozen=True, kw_only=True, gc=False):
    """The methods of all messages. Declare messages with `Message`, whose metaclass makes them subclasses of this class."""

    __ros_type__: ClassVar[str]
    """Full ROS name, `geometry_msgs/msg/Twist`. State it in the class body to choose one; see `own_type_name`."""
    __ros_fields__: ClassVar[tuple[Field, ...]]
    """The fields in order."""
    __ros_constants__: ClassVar[tuple[Constant, ...]]
    """The constants in order. Their values are class attributes too."""

    def __init_subclass__(cls, **_: object) -> None:
        if cls.__bases__ != (MessageBase,):
            raise BadDeclaration(
                f"class {cls.__name__}: a message has one parent, Message; put the other message in a field instead"
            )

    def replace(self, **changes: object) -> Self:
        """A message like this one but for `changes`, checked like a new one.

        Raises:
            MessageTypeError: a name that is no field, or a value of the wrong type.
            MessageValueError: a value out of range.
        """
        for name in changes:
            if name not in self.__struct_fields__:
                raise MessageTypeError(
                    f"{type(self).__name__} has no field {name!r}.{closest(name, self.__struct_fields__)}"
                )
        return msgspec.structs.replace(self, **changes)

    def __repr__(self) -> str:
        values = ", ".join(f"{name}={_shown(getattr(self, name))}" for name in self.__struct_fields__)
        return f"{self.__ros_type__.replace('/', '.')}({values})"


class MessageMeta(StructMeta):
    """Makes a message class: reads its annotations, fills in the defaults of ROS, leaves the checks to be compiled.

    The class it makes is a plain struct class, not an instance of this metaclass: calling a class whose metaclass is
    written in Python costs 0.19 us a message on Python 3.11, which is more than all the rest.
    """

    def __new__(mcls, name: str, bases: tuple[type, ...], namespace: dict[str, Any], **options: Any) -> Any:
        if bases == (MessageBase,):
            return super().__new__(mcls, name, bases, namespace, **options)
        _check_statement(name, bases, options)
        detached = namespace.pop("__ros_detached__", False)
        declared, constants = read_class(name, namespace, _caller_names())
        fields = tuple(Field(*each) for each in declared)
        for field in fields:
            namespace[field.name] = _default_of(name, field, namespace.get(field.name))
        if "__ros_type__" not in namespace:
            namespace["__ros_type__"] = own_type_name(namespace.get("__module__", ""), name)
        namespace["__ros_fields__"] = fields
        namespace["__ros_constants__"] = tuple(constants)
        namespace["__post_init__"] = _check_later(name, fields, namespace.get("__post_init__"))
        arrays = tuple(field.name for field in fields if field.type.is_numeric_array)
        if arrays:
            namespace["__eq__"], namespace["__hash__"] = _equality(tuple(f.name for f in fields), arrays)
        # gc=False: a message cannot take part in a reference cycle, since its parts exist before it does.
        cls = StructMeta(name, (MessageBase,), namespace, frozen=True, kw_only=True, gc=False)
        type.__setattr__(cls, "__setattr__", _refuse_to_change)  # msgspec's own does not say what to do instead
        if not detached:
            register(cls)
        return cls

    def __instancecheck__(cls, instance: object) -> bool:
        return isinstance(instance, MessageBase)

    def __subclasscheck__(cls, subclass: type) -> bool:
        return issubclass(subclass, MessageBase)


class Message(MessageBase, frozen=True, kw_only=True, metaclass=MessageMeta):
    """Base of all messages. Subclasses state `frozen=True, kw_only=True` themselves.

        class Pose2D(Message, frozen=True, kw_only=True):
            x: float64 = 0.0
            y: float64 = 0.0

    Guarantees: every field has the type and range of its declaration, checked when the message is built; numeric
    sequences are read-only numpy arrays of the declared dtype, other sequences tuples; nothing changes afterwards.
    A float32 field holds the value rounded to float32, so that a reader in this process and one on another machine see
    the same number. A bool field takes only a bool. Equality is element by element; a NaN equals nothing in an array.

    Raises, when built:
        MessageTypeError (a TypeError): a value of the wrong type; names type and field.
        MessageValueError (a ValueError): a value out of range, too long, or of the wrong length; names type and field.
        TypeError: a keyword that is no field.
    """


def _caller_names() -> dict[str, object]:
    """The names where the class statement stands: annotations may be text that mentions them."""
    return sys._getframe(2).f_locals  # pyright: ignore[reportPrivateUsage]


def make_message(name: str, body: dict[str, object]) -> type[Message]:
    """The message class of this name whose class body would be `body`. It is known by its ROS name from now on, but with `__ros_detached__`."""
    made: type[Message] = MessageMeta(name, (Message,), body, frozen=True, kw_only=True)
    return made


def _refuse_to_change(self: object, name: str, value: object) -> NoReturn:
    raise AttributeError(
        f"{type(self).__name__}.{name}: a message never changes once it is built. "
        f"Build a changed one: message.replace({name}=...)"
    )


def _check_statement(name: str, bases: tuple[type, ...], options: dict[str, object]) -> None:
    if len(bases) != 1:
        raise BadDeclaration(
            f"class {name}: a message has one parent, Message, got {[base.__name__ for base in bases]}"
        )
    if options.get("frozen") is not True or options.get("kw_only") is not True:
        raise BadDeclaration(
            f"class {name}: write `class {name}(Message, frozen=True, kw_only=True)`. Every message class states both, "
            "because they are not inherited"
        )
    if len(options) > 2:
        raise BadDeclaration(
            f"class {name}: a message class takes no options but frozen and kw_only, got {sorted(options)}"
        )


def _default_of(name: str, field: Field, written: object) -> object:
    """The default for msgspec: a value, or a factory that hands out one shared value made at its first use."""
    where, kind = f"{name}.{field.name}", field.type
    if kind.is_numeric_array:
        return msgspec.field(default_factory=_shared(lambda: _array_default(where, field)))
    if kind.is_array:
        return msgspec.field(default_factory=_shared(lambda: _tuple_default(where, field)))
    if field.message is not None:
        if isinstance(written, field.message):
            return written
        return msgspec.field(default_factory=_shared(field.message))
    from actors.interfaces.check import converter

    return converter(field)(where, zero(field) if field.default is None else field.default)


def zero(field: Field) -> bool | int | float | str:
    """The default of ROS 2 for one element of a primitive field."""
    base = field.type.base
    if base in STRINGS:
        return ""
    return 0.0 if base.startswith("float") else False if base == "bool" else 0


def _array_default(where: str, field: Field) -> object:
    from actors.interfaces.arrays import to_array

    size = field.type.size if field.type.array == "fixed" else 0
    return to_array(where, field.type, [zero(field)] * size if field.default is None else field.default)


def _tuple_default(where: str, field: Field) -> tuple[object, ...]:
    from actors.interfaces.check import to_tuple

    if field.default is not None:
        return to_tuple(where, field, field.default)
    size = field.type.size if field.type.array == "fixed" else 0
    return (field.message() if field.message else "",) * size if size else ()


def _shared(make: Callable[[], object]) -> Callable[[], object]:
    value: object = None

    def get() -> object:
        nonlocal value
        if value is None:
            value = make()
        return value

    return get


def _check_later(name: str, fields: tuple[Field, ...], invariant: Callable[[Any], None] | None) -> object:
    """A `__post_init__` that compiles itself at its first call, so that importing types costs nothing.

    It swaps its own code object: msgspec keeps the function it found when the class was made.
    """
    scope: dict[str, object] = {"__builtins__": __builtins__}
    check = FunctionType(_first_call.__code__, scope, "__post_init__")

    def compile_now(message: object) -> None:
        from actors.interfaces.check import compile_check

        check.__code__ = compile_check(name, fields, scope)
        check(message)

    scope["COMPILE"] = compile_now
    if invariant is None:
        return check

    def check_both(self: object) -> None:
        check(self)
        invariant(self)

    return check_both


def _first_call(self: object) -> None:
    # This code is copied into functions whose globals have COMPILE. Those of this module have not, so the checkers do not know the name.
    COMPILE(self)  # type: ignore[name-defined]  # noqa: F821  # pyright: ignore[reportUndefinedVariable]


def _equality(names: tuple[str, ...], arrays: tuple[str, ...]) -> tuple[object, object]:
    plain = tuple(name for name in names if name not in arrays)

    def __eq__(self: object, other: object) -> bool:
        if self is other:
            return True
        if type(self) is not type(other):
            return NotImplemented
        for name in plain:
            if getattr(self, name) != getattr(other, name):
                return False
        for name in arrays:
            mine, theirs = getattr(self, name), getattr(other, name)
            if mine is not theirs and (len(mine) != len(theirs) or not (mine == theirs).all()):
                return False
        return True

    def __hash__(self: object) -> NoReturn:
        raise TypeError(
            f"{type(self).__name__} cannot be hashed: its field {arrays[0]} is an array. Use a part of it as the key"
        )

    return __eq__, __hash__


def _shown(value: Any) -> str:
    if isinstance(value, tuple):
        return f"[{', '.join(_shown(item) for item in value)}]"  # pyright: ignore[reportUnknownVariableType]
    if hasattr(value, "dtype"):
        from actors.interfaces.arrays import shown

        return shown(value)
    return repr(value)


M = TypeVar("M", bound=Message)
Req = TypeVar("Req", bound=Message)
Resp = TypeVar("Resp", bound=Message)
G = TypeVar("G", bound=Message)
R = TypeVar("R", bound=Message)
F = TypeVar("F", bound=Message)


class ServiceType(Generic[Req, Resp]):
    """A service type: a request message and a response message under one name.

        class GetBatteryStatus(ServiceType[GetBatteryStatus_Request, GetBatteryStatus_Response]):
            Request: TypeAlias = GetBatteryStatus_Request
            Response: TypeAlias = GetBatteryStatus_Response

    It is never instantiated; its parts are. The aliases are for the type checker: at run time they are set anyway.
    """

    __ros_type__: ClassVar[str]

    def __init_subclass__(cls) -> None:
        _tie(cls, ServiceType, ("Request", "Response"))

    def __new__(cls, *args: object, **fields: object) -> Any:
        raise TypeError(f"{cls.__name__} is a service type; build {cls.__name__}.Request(...) or .Response(...)")


class ActionType(Generic[G, R, F]):
    """An action type: goal, result and feedback messages under one name.

        class MoveToPosition(ActionType[MoveToPosition_Goal, MoveToPosition_Result, MoveToPosition_Feedback]):
            Goal: TypeAlias = MoveToPosition_Goal
            Result: TypeAlias = MoveToPosition_Result
            Feedback: TypeAlias = MoveToPosition_Feedback

    It is never instantiated; its parts are.
    """

    __ros_type__: ClassVar[str]

    def __init_subclass__(cls) -> None:
        _tie(cls, ActionType, ("Goal", "Result", "Feedback"))

    def __new__(cls, *args: object, **fields: object) -> Any:
        raise TypeError(
            f"{cls.__name__} is an action type; build {cls.__name__}.Goal(...), .Result(...) or .Feedback(...)"
        )


def _tie(cls: type[Any], base: Any, parts: tuple[str, ...]) -> None:
    """Sets the parts and the ROS name of a service or action type from its generic base."""
    kind = "srv" if base is ServiceType else "action"
    stated = next((b for b in getattr(cls, "__orig_bases__", ()) if get_origin(b) is base), None)
    classes = get_args(stated)
    if (
        len(cls.__bases__) != 1
        or not all(isinstance(c, type) and issubclass(c, Message) for c in classes)
        or len(classes) != len(parts)
    ):
        names = ", ".join(f"{cls.__name__}_{part}" for part in parts)
        raise BadDeclaration(
            f"class {cls.__name__}: write `class {cls.__name__}({base.__name__}[{names}])` with message classes"
        )
    for part, message in zip(parts, classes, strict=True):
        if vars(cls).get(part, message) is not message:
            raise BadDeclaration(f"class {cls.__name__}: {part} is {vars(cls)[part]!r}, but the base says {message!r}")
        setattr(cls, part, message)
    if "__ros_type__" not in vars(cls):
        package, _, name = own_type_name(cls.__module__, cls.__name__).split("/")
        cls.__ros_type__ = f"{package}/{kind}/{name}"
    for part, message in zip(parts, classes, strict=True):
        if message.__ros_type__ != f"{cls.__ros_type__}_{part}":
            raise BadDeclaration(
                f"class {cls.__name__}: its {part} is {message.__ros_type__}, but ROS 2 wants {cls.__ros_type__}_{part}; "
                f"name the class {cls.__name__}_{part} (a message to share goes into a field of it)"
            )
    register(cls)


InterfaceClass: TypeAlias = type[Message] | type[ServiceType[Any, Any]] | type[ActionType[Any, Any, Any]]
"""The class of a message, a service or an action."""

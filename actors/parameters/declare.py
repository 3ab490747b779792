"""Parameters declared in class bodies: `speed = parameter(0.5, unit="m/s", ge=0.0, le=2.0)`.

On the class the attribute is the `ParameterDeclaration`; on a started node it is the plain value, with the type of the default. Errors in a
declaration are raised where it is written, before any node exists.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping
from typing import Any, Final, Generic, Never, NoReturn, Self, TypeVar, cast, overload

import msgspec

from actors.checks import NoPublicConstructor, create
from actors.errors import DeclarationError, NotStarted
from actors.parameters.descriptor import FloatingPointRange, IntegerRange, ParameterDescriptor
from actors.parameters.hooks import ParameterHook
from actors.parameters.values import INT64_MAX, INT64_MIN, SEQUENCES, Parameter, ParameterType, Value, widened

T_co = TypeVar("T_co", covariant=True)
E = TypeVar("E", bool, int, float, str, bytes)
Node = TypeVar("Node")


class ParameterDeclaration(Generic[T_co], metaclass=NoPublicConstructor):
    """A parameter that every node of a class has: its name, default value and descriptor.

    Reading it on an instance gives the current value by one dictionary lookup; it raises NotStarted before the node has started. Assignment
    is refused, because setting a parameter can fail and must be reported.

    It has no public constructor: `parameter` gives one.
    """

    __slots__ = ("_attribute", "default", "descriptor", "name")

    def __init__(self, default: Parameter, descriptor: ParameterDescriptor) -> None:
        self.default = default
        self.descriptor = descriptor
        self.name = default.name
        self._attribute = ""

    def __set_name__(self, owner: type, attribute: str) -> None:
        if self._attribute and self._attribute != attribute:
            raise DeclarationError(
                f"{owner.__name__}.{attribute} and .{self._attribute} are one and the same parameter(): declare each"
            )
        self._attribute = attribute
        if not self.name:
            self.name = attribute
            self.default = msgspec.structs.replace(self.default, name=attribute)
            self.descriptor = msgspec.structs.replace(self.descriptor, name=attribute)

    @overload
    def __get__(self, instance: None, owner: type) -> Self: ...
    @overload
    def __get__(self, instance: object, owner: type | None = None) -> T_co: ...
    def __get__(self, instance: Any, owner: type | None = None) -> Self | T_co:
        if instance is None:
            return self
        life = instance.__machinery__
        if life is None:
            raise NotStarted(
                f"{type(instance).__name__}.{self._attribute} has no value: the node is not started yet: "
                "read it in on_start or later"
            )
        try:
            return cast("T_co", life.parameters.values[self.name])
        except KeyError:
            return cast("T_co", life.parameters.value(self.name))

    def __set__(self, instance: object, value: Never) -> NoReturn:
        raise AttributeError(
            f"{type(instance).__name__}.{self._attribute} is a parameter and cannot be assigned; "
            f"call self.set_parameter({self.name!r}, {value!r}), which checks the value and reports the change."
        )

    def validate(self, function: Callable[[Node, T_co], str | None]) -> Callable[[Node, T_co], str | None]:
        """Decorate the method that checks each new value before it is stored. It returns None to accept, or the reason for refusing as
        text.

        It is a plain method without side effects, because a later check may still refuse. It is called for every set, including those
        requested by other nodes, and, before `on_start`, for the value with which the node is started. It is not called for the default.
        """
        ParameterHook("validate", self).attach(function)
        return function

    def changed(self, function: Callable[[Node, T_co], None]) -> Callable[[Node, T_co], None]:
        """Decorate the method called with the value after each set, even if the value is the same. It may have side effects."""
        ParameterHook("changed", self).attach(function)
        return function

    def __repr__(self) -> str:
        return f"<parameter {self.name!r}: {self.default.type.name} = {self.default.value!r}>"


@overload
def parameter(
    default: bool, *, name: str = "", unit: str = "", description: str = "", read_only: bool = False
) -> ParameterDeclaration[bool]: ...
@overload
def parameter(
    default: int,
    *,
    name: str = "",
    unit: str = "",
    ge: int | None = None,
    le: int | None = None,
    step: int | None = None,
    choices: Iterable[int] = (),
    description: str = "",
    read_only: bool = False,
) -> ParameterDeclaration[int]: ...
@overload
def parameter(
    default: float,
    *,
    name: str = "",
    unit: str = "",
    ge: float | None = None,
    le: float | None = None,
    step: float | None = None,
    choices: Iterable[float] = (),
    description: str = "",
    read_only: bool = False,
) -> ParameterDeclaration[float]: ...
@overload
def parameter(
    default: str,
    *,
    name: str = "",
    unit: str = "",
    choices: Iterable[str] = (),
    description: str = "",
    read_only: bool = False,
) -> ParameterDeclaration[str]: ...
@overload
def parameter(
    default: list[E] | tuple[E, ...],
    *,
    of: type[E],
    name: str = "",
    unit: str = "",
    description: str = "",
    read_only: bool = False,
) -> ParameterDeclaration[tuple[E, ...]]: ...
@overload
def parameter(
    default: list[bool] | tuple[bool, ...],
    *,
    name: str = "",
    unit: str = "",
    description: str = "",
    read_only: bool = False,
) -> ParameterDeclaration[tuple[bool, ...]]: ...
@overload
def parameter(
    default: list[int] | tuple[int, ...],
    *,
    name: str = "",
    unit: str = "",
    description: str = "",
    read_only: bool = False,
) -> ParameterDeclaration[tuple[int, ...]]: ...
@overload
def parameter(
    default: list[float] | tuple[float, ...],
    *,
    name: str = "",
    unit: str = "",
    description: str = "",
    read_only: bool = False,
) -> ParameterDeclaration[tuple[float, ...]]: ...
@overload
def parameter(
    default: list[str] | tuple[str, ...],
    *,
    name: str = "",
    unit: str = "",
    description: str = "",
    read_only: bool = False,
) -> ParameterDeclaration[tuple[str, ...]]: ...
@overload
def parameter(
    default: list[bytes] | tuple[bytes, ...],
    *,
    name: str = "",
    unit: str = "",
    description: str = "",
    read_only: bool = False,
) -> ParameterDeclaration[tuple[bytes, ...]]: ...
def parameter(
    default: object,
    *,
    of: type | None = None,
    name: str = "",
    unit: str = "",
    ge: float | None = None,
    le: float | None = None,
    step: float | None = None,
    choices: Iterable[object] = (),
    description: str = "",
    read_only: bool = False,
) -> ParameterDeclaration[object]:
    """Declare a parameter in the body of a node class.

    `default` gives the value and the static type; `of` is the type of the elements of an empty list: ``parameter([], of=str)``. An int with
    a float among its limits or choices is a float parameter, and so is a list that mixes int and float. `ge` and `le` (inclusive, each
    optional) and `step` (counted from `ge`) limit a number, `choices` a number or a string. `unit` is information for people. A `read_only`
    parameter takes its value at the start. `name` is the ROS name if it differs from the attribute ("pid.p").

    Raises DeclarationError for a default that no parameter can hold or that is outside its limits, and for limits that do not apply to its
    type.
    """
    try:
        value, limits = _checked(name, default, of, (ge, le, step), tuple(choices))
    except (TypeError, ValueError) as error:
        raise DeclarationError(f"parameter({default!r}): {error}") from None
    descriptor = msgspec.structs.replace(
        limits,
        name=name,
        description=description,
        additional_constraints=f"unit: {unit}" if unit else "",
        read_only=read_only,
    )
    return create(ParameterDeclaration, value, descriptor)  # pyright: ignore[reportUnknownVariableType]


def _checked(
    name: str,
    default: object,
    of: type | None,
    bounds: tuple[float | None, float | None, float | None],
    options: tuple[object, ...],
) -> tuple[Parameter, ParameterDescriptor]:
    """Return the default as a parameter, and a descriptor with its type and limits, after checking one against the other."""
    numbers = tuple(bound for bound in bounds if bound is not None)
    value = _as_declared(name, default, of, (*numbers, *options))
    _check_limits_apply(value, numbers, options)
    limits = ParameterDescriptor(
        type=value.type,
        integer_range=_integer_range(*bounds) if numbers and value.type is ParameterType.INTEGER else None,
        floating_point_range=_float_range(*bounds) if numbers and value.type is ParameterType.DOUBLE else None,
        choices=tuple(widened(name, option, value.type).value for option in options),
    )
    objection = limits.value_objection(value)
    if objection is not None:
        raise ValueError(f"the default does not obey its own limits: {objection.replace('Parameter  ', 'it ', 1)}")
    return value, limits


def _as_declared(name: str, default: object, of: type | None, limits: tuple[object, ...]) -> Parameter:
    """The default as a parameter of the type that follows from default and limits, or from the type `of` its elements."""
    if of is not None:
        return _array(name, default, of)
    if isinstance(default, SEQUENCES):
        elements = tuple(cast("Iterable[object]", default))
        if not elements:
            raise TypeError("an empty list has no element type; write parameter([], of=str), for instance.")
        mixed = {type(element) for element in elements} == {int, float}
        return widened(name, elements, ParameterType.DOUBLE_ARRAY) if mixed else Parameter(name, elements)
    if default is None:
        raise TypeError("a parameter needs a default value, whose type it keeps.")
    if any(isinstance(limit, float) for limit in limits):
        return widened(name, default, ParameterType.DOUBLE)
    return Parameter(name, default)


def _array(name: str, default: object, of: type) -> Parameter:
    kind = ParameterType.of((of(),)) if of in (bool, int, float, str, bytes) else None
    value = None if kind is None else widened(name, default, kind)
    if value is None or value.type is not kind:
        raise TypeError(
            f"of={of.__name__} is for a list of which all elements are of that type: bool, int, float, str or bytes."
        )
    return value


def _check_limits_apply(value: Parameter, numbers: tuple[float, ...], options: tuple[object, ...]) -> None:
    kind = value.type
    if numbers and kind not in (ParameterType.INTEGER, ParameterType.DOUBLE):
        raise TypeError(f"ge, le and step limit an int or a float, not a {kind.name} such as {value.value!r}.")
    if options and kind not in (ParameterType.INTEGER, ParameterType.DOUBLE, ParameterType.STRING):
        raise TypeError(f"choices limit an int, a float or a string, not a {kind.name} such as {value.value!r}.")
    for option in options:
        if widened("", option, kind).type is not kind:
            raise TypeError(f"the choice {option!r} is not of the type of the default {value.value!r}.")


def _integer_range(ge: Any, le: Any, step: Any) -> IntegerRange:
    _check_order(ge, le, step)
    return IntegerRange(INT64_MIN if ge is None else ge, INT64_MAX if le is None else le, step or 0)


def _float_range(ge: float | None, le: float | None, step: float | None) -> FloatingPointRange:
    _check_order(ge, le, step)
    return FloatingPointRange(
        -math.inf if ge is None else float(ge), math.inf if le is None else float(le), float(step or 0.0)
    )


def _check_order(ge: float | None, le: float | None, step: float | None) -> None:
    # ROS 2 allows a range with swapped ends. Written as ge and le, it can only be a mistake.
    if ge is not None and le is not None and ge > le:
        raise ValueError(f"ge={ge} is above le={le}, so no value would be allowed; swap them.")
    if step is not None and ge is None:
        raise ValueError(f"step={step} counts from ge; give ge as well.")


class ParameterTable:
    """The parameters of a node class, computed once, shared by all its nodes, and never changed.

    `values` and `descriptors` begin with the two parameters of every node (`use_sim_time` and the read-only
    `start_type_description_service`), followed by the declared ones. Raises DeclarationError for a name used twice.
    """

    __slots__ = ("descriptors", "values")

    def __init__(self, declarations: Iterable[ParameterDeclaration[object]] = ()) -> None:
        values: dict[str, Value] = {}
        descriptors: dict[str, ParameterDescriptor] = {}
        for declaration in (*_BUILT_IN, *declarations):
            if declaration.name in values:
                raise DeclarationError(f"the parameter {declaration.name!r} is declared twice: give one another name")
            values[declaration.name] = declaration.default.value
            descriptors[declaration.name] = declaration.descriptor
        self.values: Final[Mapping[str, Value]] = values
        self.descriptors: Final[Mapping[str, ParameterDescriptor]] = descriptors

    def __repr__(self) -> str:
        return f"<parameter table: {', '.join(self.values)}>"


_BUILT_IN: Final[tuple[ParameterDeclaration[bool], ...]] = (
    parameter(False, name="use_sim_time", description="Take the time from /clock instead of the system clock."),
    parameter(
        True,
        name="start_type_description_service",
        description="Serve the descriptions of the types in use.",
        read_only=True,
    ),
)


NO_PARAMETERS: Final = ParameterTable()
"""The table of a node class without parameters of its own."""


def _introspection(name: str, whose: str) -> ParameterDeclaration[str]:
    description = f"What {whose} tell of each call on the topic <service>/_service_event: off, metadata, or contents."
    return parameter("off", name=name, choices=("off", "disabled", "metadata", "contents"), description=description)


INTROSPECTION: Final = (
    "service_configure_introspection",
    "client_configure_introspection",
    "action_server_configure_introspection",
)
"""The parameters that say what services, clients and actions tell of their calls. Their names are those of the demos of ROS 2."""

LOGGER_SERVICE: Final = "enable_logger_service"
"""The parameter that says whether a node serves the levels of loggers. In ROS 2 it is a node option of this name."""

OPTIONAL_PARAMETERS: Final[Mapping[str, ParameterDeclaration[object]]] = {
    **{
        name: _introspection(name, f"the {whose} of this node")
        for name, whose in zip(INTROSPECTION, ("services", "service clients", "actions"), strict=True)
    },
    LOGGER_SERVICE: parameter(
        False, name=LOGGER_SERVICE, description="Serve the levels of the loggers of this process.", read_only=True
    ),
}
"""The parameters that a node has if it declares them, or if they are given at its start."""

"""Descriptors of parameters (type, ranges, choices, read-only), and the check of a value against one.

The rules are those of `rcl_interfaces/msg/ParameterDescriptor` as rclpy applies them. A range applies only to values of its own kind. Both
ends are valid even if they are not on the grid of steps, and swapped ends are put in order. Ends and steps of floating-point ranges are
compared with a relative tolerance of 1e-6. NaN is in no range.
"""

from __future__ import annotations

import math
from typing import Final

import msgspec

from actors.parameters.values import Parameter, ParameterType, Value

RELATIVE_TOLERANCE: Final = 1e-6


class IntegerRange(msgspec.Struct, frozen=True):
    """A range of integers: both ends, and `from_value + k * step` between them (a `step` of 0 allows all).

    Raises ValueError for a negative step.
    """

    from_value: int
    to_value: int
    step: int = 0

    def __post_init__(self) -> None:
        if self.step < 0:
            raise ValueError(f"the step of a range must not be negative; got {self.step}.")

    def objection(self, value: int) -> str | None:
        """Why `value` is not allowed; None if it is."""
        low, high = sorted((self.from_value, self.to_value))
        if value in (low, high):
            return None
        if not low < value < high:
            return f"out of range {low}..{high}, value {value}"
        if self.step and (value - low) % self.step:
            return f"not a valid step: {value} is not {low} plus a multiple of {self.step}, nor {high}"
        return None


class FloatingPointRange(msgspec.Struct, frozen=True):
    """A range of floating-point numbers: both ends, and `from_value + k * step` between them (a `step` of 0.0 allows all).

    Raises ValueError for an end that is NaN, a step that is negative or not finite, and a step without a finite lower end.
    """

    from_value: float
    to_value: float
    step: float = 0.0

    def __post_init__(self) -> None:
        if math.isnan(self.from_value) or math.isnan(self.to_value):
            raise ValueError("an end of a floating-point range must be a number; got NaN.")
        if not 0.0 <= self.step < math.inf:
            raise ValueError(f"the step of a range must be finite and not negative; got {self.step}.")
        if self.step and not math.isfinite(min(self.from_value, self.to_value)):
            raise ValueError("a range with a step needs a finite lower end, because steps count from there.")

    def objection(self, value: float) -> str | None:
        """Why `value` is not allowed; None if it is."""
        low, high = min(self.from_value, self.to_value), max(self.from_value, self.to_value)
        if _close(value, low) or _close(value, high):
            return None
        if not low < value < high:
            return f"out of range {low}..{high}, value {value}"
        if self.step and not self._on_grid(value, low):
            return f"not close enough to a valid step: {value} is not {low} plus a multiple of {self.step}, nor {high}"
        return None

    def _on_grid(self, value: float, low: float) -> bool:
        steps = (value - low) / self.step
        # With too many steps for a float to count, every float is as close to the grid as possible.
        return not math.isfinite(steps) or _close(low + round(steps) * self.step, value)


def _close(left: float, right: float) -> bool:
    return math.isclose(left, right, rel_tol=RELATIVE_TOLERANCE)


class ParameterDescriptor(msgspec.Struct, frozen=True, kw_only=True):
    """The description of a parameter: everything but its value.

    `name` and `type` are set by the store and ignored on input. A `read_only` parameter takes a value only when it is declared (from an
    override if there is one). `dynamic_typing` allows the type to change and the parameter to be deleted. `choices`, an addition to ROS 2,
    limits a scalar to the given values; other systems see it as text.
    """

    name: str = ""
    type: ParameterType = ParameterType.NOT_SET
    description: str = ""
    additional_constraints: str = ""
    read_only: bool = False
    dynamic_typing: bool = False
    floating_point_range: FloatingPointRange | None = None
    integer_range: IntegerRange | None = None
    choices: tuple[Value, ...] = ()

    def type_objection(self, parameter: Parameter) -> str | None:
        """Why the type of `parameter` is not allowed; None if it is. Static types are exact: an int is not a double."""
        kind = parameter.type
        if self.dynamic_typing or kind is self.type:
            return None
        if kind is ParameterType.NOT_SET:
            return (
                f"Static parameter cannot be undeclared: {parameter.name!r} keeps its type {self.type.name}; "
                "only a parameter with dynamic typing can be deleted by setting it to nothing."
            )
        return (
            f"Wrong parameter type, expected {self.type.name} got {kind.name}: "
            f"{parameter.name!r} cannot be set to {parameter.value!r}."
        )

    def value_objection(self, parameter: Parameter) -> str | None:
        """Why the value of `parameter` is outside its range or choices; None if it is not. The type is not checked."""
        found: str | None = None
        if parameter.type is ParameterType.INTEGER and self.integer_range is not None:
            found = self.integer_range.objection(parameter.value)
        elif parameter.type is ParameterType.DOUBLE and self.floating_point_range is not None:
            found = self.floating_point_range.objection(parameter.value)
        if found is not None:
            return f"Parameter {parameter.name} is {found}."
        if self.choices and parameter.type is not ParameterType.NOT_SET and parameter.value not in self.choices:
            allowed = ", ".join(repr(choice) for choice in self.choices)
            return f"Parameter {parameter.name} must be one of {allowed}; value {parameter.value!r}."
        return None


def declared_type(name: str, value: object, descriptor: ParameterDescriptor) -> ParameterType:
    """The static type of a declaration; NOT_SET for dynamic typing. Raises ValueError if no type or two types are given."""
    if isinstance(value, ParameterType):
        if value is ParameterType.NOT_SET:
            raise ValueError(f"parameter {name!r} cannot have NOT_SET as its type; use dynamic_typing=True instead.")
        if descriptor.dynamic_typing:
            raise ValueError(f"parameter {name!r} is given the type {value.name} and dynamic typing; drop one of them.")
        return value
    if descriptor.dynamic_typing:
        return ParameterType.NOT_SET
    if value is None:
        raise ValueError(
            f"parameter {name!r} has static typing but neither a default value nor a type; give a value, "
            "a ParameterType, or a descriptor with dynamic_typing=True."
        )
    return ParameterType.of(value)


def redescribed_type(new: ParameterDescriptor, old: ParameterDescriptor, current: Parameter) -> ParameterType:
    """The static type of a parameter with a new descriptor: unchanged, unless its typing becomes dynamic."""
    if new.dynamic_typing:
        return ParameterType.NOT_SET
    for kind in (current.type, old.type, new.type):
        if kind is not ParameterType.NOT_SET:
            return kind
    raise ValueError(
        f"parameter {old.name!r} has no type to keep; name one in the new descriptor, or let it be dynamic."
    )

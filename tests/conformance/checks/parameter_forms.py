"""Parameters as the vectors write them: values, descriptors and results, there and back, and what an expectation means."""

from __future__ import annotations

from typing import Any

from actors import Parameter, SetResult
from actors.parameters import FloatingPointRange, IntegerRange, ParameterDescriptor, ParameterType
from tests.conformance.checks.common import Unsupported, number


def value_of(given: Any) -> Any:
    """The Python value of a vector's `{"type": ..., "value": ...}`."""
    if given is None:
        return None
    value = given["value"]
    if given["type"] == "double":
        return float(number(value))
    if given["type"] == "double_array":
        return [float(number(element)) for element in value]
    if given["type"] == "byte_array":
        return [element.encode("latin-1") if isinstance(element, str) else bytes([element]) for element in value]
    if given["type"] not in _TYPES:
        raise Unsupported(f"unsupported type of a parameter {given['type']!r}")
    return value


_TYPES = {kind.name.lower() for kind in ParameterType}


def behavior_of(step: dict[str, Any], known: dict[str, Any]) -> Any:
    if step["behavior"] not in known:
        raise Unsupported(f"unsupported behavior {step['behavior']!r}: known are {', '.join(known)}")
    return known[step["behavior"]]


def default_of(step: dict[str, Any]) -> Any:
    if "static_type" in step:
        return ParameterType[step["static_type"].upper()]
    return value_of(step if "type" in step else step.get("value"))


def parameters_of(given: list[dict[str, Any]]) -> list[Parameter]:
    """Parameters of a vector, with exactly the type it states."""
    return [Parameter(item["name"], value_of(item), ParameterType[item["type"].upper()]) for item in given]


def descriptor_of(given: dict[str, Any] | None) -> ParameterDescriptor | None:
    """The descriptor of a vector; None where it names none."""
    if given is None:
        return None
    floats, integers = given.get("floating_point_range"), given.get("integer_range")
    return ParameterDescriptor(
        name=given.get("name", ""),
        type=ParameterType[given.get("type", "not_set").upper()],
        description=given.get("description", ""),
        additional_constraints=given.get("additional_constraints", ""),
        read_only=given.get("read_only", False),
        dynamic_typing=given.get("dynamic_typing", False),
        floating_point_range=FloatingPointRange(*(float(end) for end in _ends(floats))) if floats else None,
        integer_range=IntegerRange(*_ends(integers)) if integers else None,
    )


def _ends(given: dict[str, Any]) -> tuple[Any, Any, Any]:
    low = given.get("from", given.get("from_value"))
    high = given.get("to", given.get("to_value"))
    return low, high, given.get("step", 0)


def typed(parameter: Parameter) -> dict[str, Any]:
    """A parameter as vectors write it."""
    value = parameter.value
    if isinstance(value, tuple):
        value = list(value)
    return {"type": parameter.type.name.lower(), "value": value}


def shown(result: SetResult) -> dict[str, Any]:
    """A result as vectors write it; `reason` answers to `reason_prefix`."""
    return {"successful": result.successful, "reason_prefix": result.reason}


def described(descriptor: ParameterDescriptor) -> dict[str, Any]:
    """A descriptor as vectors write it."""
    fields = ("name", "description", "additional_constraints", "read_only", "dynamic_typing")
    found = {field: getattr(descriptor, field) for field in fields} | {"type": descriptor.type.name.lower()}
    for kind in ("integer_range", "floating_point_range"):
        limits = getattr(descriptor, kind)
        if limits is not None:
            found[kind] = {"from": limits.from_value, "to": limits.to_value, "step": limits.step}
            found[kind] |= {"from_value": limits.from_value, "to_value": limits.to_value}
    return found


def compare(found: Any, expect: Any) -> None:
    """What `expect` states must hold of `found`; keys that it leaves out are not checked."""
    if isinstance(expect, dict):
        assert isinstance(found, dict), f"expected {expect}, got {found!r}"
        for key, wanted in expect.items():
            assert key in found, f"expected {expect}, got {found}"
            if key == "reason_prefix":
                assert found[key].startswith(wanted), f"reason {found[key]!r} does not start with {wanted!r}"
            elif key == "error":
                assert wanted in ("any", found[key]), f"expected {expect}, got {found}"
            elif key in ("names", "prefixes", "keys"):  # order free
                compare(sorted(found[key]), sorted(wanted))
            else:
                compare(found[key], wanted)
    elif isinstance(expect, list):
        assert isinstance(found, list), f"expected {expect}, got {found!r}"
        assert len(found) == len(expect), f"expected {expect}, got {found}"
        for one, wanted in zip(found, expect, strict=True):
            compare(one, wanted)
    elif isinstance(found, float) and isinstance(expect, str):
        assert str(found) == expect
    elif isinstance(found, bytes):
        assert found == (expect.encode("latin-1") if isinstance(expect, str) else bytes([expect]))
    else:
        assert isinstance(found, bool) == isinstance(expect, bool), f"expected {expect!r}, got {found!r}"
        assert found == expect, f"expected {expect!r}, got {found!r}"

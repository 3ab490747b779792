"""Vectors of `parameters`: inference, declaration, sets, callbacks, events, and the six services."""

from __future__ import annotations

import array
import warnings
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import Any

from actors.parameters import (
    CallbackHandle,
    FloatingPointRange,
    IntegerRange,
    InvalidParameterName,
    InvalidParameterType,
    InvalidParameterValue,
    Parameter,
    ParameterAlreadyDeclared,
    ParameterChange,
    ParameterDescriptor,
    ParameterImmutable,
    ParameterNotDeclared,
    ParameterStore,
    ParameterType,
    ParameterUninitialized,
    SetResult,
)
from actors.parameters.messages import (
    PARAMETER_SERVICES,
    SERVICE_TYPES,
    from_descriptor,
    from_result,
    from_value,
    to_parameter,
)
from actors.parameters.text import parse_parameter
from tests.conformance.checks.common import Case, Unsupported, Vector, by_kind, number, steps_of

_ERRORS: list[tuple[type[Exception], str]] = [
    (ParameterAlreadyDeclared, "parameter_already_declared"),
    (ParameterNotDeclared, "parameter_not_declared"),
    (InvalidParameterName, "invalid_parameter_name"),
    (InvalidParameterType, "invalid_parameter_type"),
    (InvalidParameterValue, "invalid_parameter_value"),
    (ParameterImmutable, "parameter_immutable"),
    (ParameterUninitialized, "parameter_uninitialized"),
    (ValueError, "value_error"),
    (TypeError, "type_error"),
]


OF_CALLBACKS = ("when", "append", "arg", "handle")
"""Arguments of callbacks, which may never be called."""


def cases(path: Path) -> Iterator[Case]:
    """The cases of the vector file `path`."""

    def plain(check: Callable[[Vector, Vector], None]) -> Callable[[Vector], None]:
        return lambda vector: check(vector["input"], vector["expect"])

    return by_kind(path, {"steps": _steps, **{kind: plain(check) for kind, check in _CHECKS.items()}}, OF_CALLBACKS)


def _steps(vector: Vector) -> None:
    _Script(vector["input"].get("node", {})).play(steps_of(vector))


class _Array:
    """The name `array` in an expression: the module as well as its class, for tests of rclpy import either."""

    array = array.array

    def __call__(self, *given: Any) -> Any:
        return array.array(*given)


def _infer_type(given: dict[str, Any], expect: dict[str, Any]) -> None:
    value = _evaluated(given)
    found = _outcome(lambda: {"ok": True, "type": ParameterType.of(value).name.lower(), **_held(value, expect)})
    _compare(found, expect)


def _held(value: object, expect: dict[str, Any]) -> dict[str, Any]:
    """What a parameter of the inferred type holds, for a case that asks."""
    return {"value": typed(Parameter("p", value))["value"]} if "value" in expect else {}


def _construct(given: dict[str, Any], expect: dict[str, Any]) -> None:
    value = _evaluated(given)
    kind = ParameterType.__members__.get(str(given["type"]).upper(), given["type"])

    def build() -> dict[str, Any]:
        parameter = Parameter("p", value, kind)
        held = typed(parameter)
        wanted = expect.get("value")
        return {"ok": True, "type": held["type"], "value": held if isinstance(wanted, dict) else held["value"]}

    _compare(_outcome(build), expect)


def _evaluated(given: dict[str, Any]) -> Any:
    return eval(given["python_value"], {"array": _Array()})


def _cli_value(given: dict[str, Any], expect: dict[str, Any]) -> None:
    _compare(typed(parse_parameter("p", given["text"])), expect)


def _parameter_service(given: dict[str, Any], expect: dict[str, Any]) -> None:
    if given["service"] not in SERVICE_TYPES:
        raise Unsupported(f"unsupported service {given['service']!r}")
    found = {"name": f"{given['node']}/{given['service']}", "type": SERVICE_TYPES[given["service"]]}
    _compare(found, expect)


def _type_id(given: dict[str, Any], expect: dict[str, Any]) -> None:
    _compare({"value": ParameterType[given["type"].upper()].value}, expect)


_CHECKS = {
    "infer_type": _infer_type,
    "construct": _construct,
    "cli_value": _cli_value,
    "parameter_service": _parameter_service,
    "type_id": _type_id,
}


class _Script:
    """One node's store, and the operations of the vectors on it (`op_...`), each giving what is to be compared."""

    def __init__(self, node: dict[str, Any]) -> None:
        self.changes: list[ParameterChange] = []
        self.record: list[Any] = []
        self.handles: dict[Any, CallbackHandle] = {}
        self.store = ParameterStore(
            "/vectors/node",
            {name: value_of(given) for name, given in node.get("overrides", {}).items()},
            allow_undeclared=node.get("allow_undeclared_parameters", False),
            automatically_declare=node.get("automatically_declare_parameters_from_overrides", False),
            on_event=self.changes.append,
        )

    def play(self, steps: list[dict[str, Any]]) -> None:
        for index, step in enumerate(steps):
            operation = getattr(self, f"op_{step['op']}", None)
            if operation is None:
                raise Unsupported(f"unsupported step {step['op']!r}")
            found = _outcome(lambda operation=operation, step=step: operation(step))
            try:
                if "expect" in step:
                    _compare(found, step["expect"])
                else:
                    assert not (isinstance(found, dict) and found.get("ok") is False), found
            except Unsupported:
                raise
            except AssertionError as error:
                raise AssertionError(f"step {index} {step}: {error}") from None

    def op_declare(self, step: dict[str, Any]) -> Any:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", DeprecationWarning)
            declared = self.store.declare(
                step["name"],
                _default_of(step),
                descriptor_of(step.get("descriptor")),
                ignore_override=step.get("ignore_override", False),
            )
        return {"ok": True, "value": typed(declared)}

    def op_declare_many(self, step: dict[str, Any]) -> Any:
        wanted = [
            (item["name"], _default_of(item), descriptor_of(item.get("descriptor", {}))) for item in step["parameters"]
        ]
        return {"ok": True, "values": [typed(p) for p in self.store.declare_many(step["namespace"], wanted)]}

    def op_undeclare(self, step: dict[str, Any]) -> Any:
        self.store.undeclare(step["name"])
        return {"ok": True}

    def op_has(self, step: dict[str, Any]) -> Any:
        return self.store.has(step["name"])

    def op_get(self, step: dict[str, Any]) -> Any:
        return {"ok": True, "value": typed(self.store.get(step["name"]))}

    def op_get_or(self, step: dict[str, Any]) -> Any:
        return {"ok": True, "value": typed(self.store.get_or(step["name"], value_of(step["alternative"])))}

    def op_get_by_prefix(self, step: dict[str, Any]) -> Any:
        found = self.store.get_by_prefix(step["prefix"])
        return {"ok": True, "keys": list(found), "values": {name: typed(one) for name, one in found.items()}}

    def op_list(self, step: dict[str, Any]) -> Any:
        found = self.store.list(step["prefixes"], step["depth"])
        return {"ok": True, "names": list(found.names), "prefixes": list(found.prefixes)}

    def op_describe(self, step: dict[str, Any]) -> Any:
        return {"ok": True, "descriptor": described(self.store.describe(step["name"]))}

    def op_set_descriptor(self, step: dict[str, Any]) -> Any:
        descriptor = descriptor_of(step["descriptor"])
        assert descriptor is not None
        alternative = value_of(step.get("alternative"))
        return {"ok": True, "value": typed(self.store.set_descriptor(step["name"], descriptor, alternative))}

    def op_set(self, step: dict[str, Any]) -> Any:
        return {"ok": True, "results": [shown(result) for result in self.store.set(parameters_of(step["parameters"]))]}

    def op_set_atomically(self, step: dict[str, Any]) -> Any:
        return {"ok": True, "result": shown(self.store.set_atomically(parameters_of(step["parameters"])))}

    def op_add_pre_set_callback(self, step: dict[str, Any]) -> Any:
        def append(parameters: Sequence[Parameter]) -> Sequence[Parameter]:
            present = any(parameter.name == step["when"] for parameter in parameters)
            return [*parameters, *parameters_of([step["append"]])] if present else parameters

        def nothing(_: Sequence[Parameter]) -> Sequence[Parameter]:
            return []

        chosen = _behavior(step, {"append_if_present": append, "return_empty": nothing})
        self._keep(step, self.store.add_pre_set_callback(chosen))

    def op_add_on_set_callback(self, step: dict[str, Any]) -> Any:
        def reject(parameters: Sequence[Parameter]) -> SetResult:
            hit = any(step["arg"] in parameter.name for parameter in parameters)
            return SetResult(False, f"rejected by {step['arg']}") if hit else SetResult()

        def record(parameters: Sequence[Parameter]) -> SetResult:
            self.record.append(step["arg"] if "arg" in step else [parameter.name for parameter in parameters])
            return SetResult()

        def record_names(parameters: Sequence[Parameter]) -> SetResult:
            self.record.append([parameter.name for parameter in parameters])
            return SetResult()

        chosen = _behavior(step, {"reject_if_name_contains": reject, "record": record, "record_names": record_names})
        self._keep(step, self.store.add_on_set_callback(chosen))

    def op_add_post_set_callback(self, step: dict[str, Any]) -> Any:
        def names(parameters: Sequence[Parameter]) -> None:
            self.record.append([parameter.name for parameter in parameters])

        def record(_: Sequence[Parameter]) -> None:
            self.record.append(step["arg"])

        chosen = _behavior(step, {"record_names": names, "record": record})
        self._keep(step, self.store.add_post_set_callback(chosen))

    def op_remove_on_set_callback(self, step: dict[str, Any]) -> Any:
        """Take off the callback that a handle or an argument names; without either the one of this kind added last."""
        kind = step["op"].removeprefix("remove_").removesuffix("_set_callback")
        self.handles[step.get("handle", step.get("arg", kind))].remove()

    op_remove_pre_set_callback = op_remove_post_set_callback = op_remove_on_set_callback

    def _keep(self, step: dict[str, Any], handle: CallbackHandle) -> None:
        self.handles[handle.kind] = handle
        for key in ("handle", "arg"):
            if key in step:
                self.handles[step[key]] = handle

    def op_recorded(self, _: dict[str, Any]) -> Any:
        return self.record

    def op_clear_events(self, _: dict[str, Any]) -> None:
        self.changes.clear()

    def op_events(self, _: dict[str, Any]) -> Any:
        return [
            {kind: [parameter.name for parameter in getattr(change, kind)] for kind in ("new", "changed", "deleted")}
            for change in self.changes
        ]

    def op_service(self, step: dict[str, Any]) -> Any:
        return _call(self.store, step["service"], step["request"])


def _call(store: ParameterStore, name: str, request: dict[str, Any]) -> dict[str, Any]:
    """Call one of the six services through its messages, and give the response as vectors write it."""
    service = next((service for service in PARAMETER_SERVICES if service.name == name), None)
    if service is None:
        raise Unsupported(f"unsupported service {name!r}")
    plain = dict(request)
    if "parameters" in plain:
        plain["parameters"] = tuple(to_parameter(parameter) for parameter in parameters_of(plain["parameters"]))
    response = service.answer(store, service.type.Request(**plain))
    match name:
        case "get_parameters":
            return {"values": [typed(from_value("", value)) for value in response.values]}
        case "get_parameter_types":
            return {"types": response.types.tolist()}
        case "describe_parameters":
            return {"descriptors": [described(from_descriptor(message)) for message in response.descriptors]}
        case "set_parameters":
            return {"results": [shown(from_result(result)) for result in response.results]}
        case "set_parameters_atomically":
            return {"result": shown(from_result(response.result))}
        case "list_parameters":
            listed = {"names": list(response.result.names), "prefixes": list(response.result.prefixes)}
            return {"result": listed, **listed}
        case other:  # `next` found it
            raise Unsupported(f"unsupported service {other!r}")


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


def _behavior(step: dict[str, Any], known: dict[str, Any]) -> Any:
    if step["behavior"] not in known:
        raise Unsupported(f"unsupported behavior {step['behavior']!r}: known are {', '.join(known)}")
    return known[step["behavior"]]


def _default_of(step: dict[str, Any]) -> Any:
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


def _outcome(action: Callable[[], Any]) -> Any:
    try:
        return action()
    except Unsupported:
        raise
    except Exception as error:
        code = next((code for kind, code in _ERRORS if isinstance(error, kind)), None)
        if code is None:
            raise
        return {"ok": False, "error": code, "text": str(error)}


def _compare(found: Any, expect: Any) -> None:
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
                _compare(sorted(found[key]), sorted(wanted))
            else:
                _compare(found[key], wanted)
    elif isinstance(expect, list):
        assert isinstance(found, list), f"expected {expect}, got {found!r}"
        assert len(found) == len(expect), f"expected {expect}, got {found}"
        for one, wanted in zip(found, expect, strict=True):
            _compare(one, wanted)
    elif isinstance(found, float) and isinstance(expect, str):
        assert str(found) == expect
    elif isinstance(found, bytes):
        assert found == (expect.encode("latin-1") if isinstance(expect, str) else bytes([expect]))
    else:
        assert isinstance(found, bool) == isinstance(expect, bool), f"expected {expect!r}, got {found!r}"
        assert found == expect, f"expected {expect!r}, got {found!r}"

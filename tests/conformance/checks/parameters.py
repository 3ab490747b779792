"""Vectors of `parameters`: inference, declaration, sets, callbacks, events, and the six services."""

from __future__ import annotations

import array
import warnings
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import Any

from actors import Parameter, SetResult
from actors.interfaces import type_name
from actors.parameters import (
    CallbackHandle,
    InvalidParameterName,
    InvalidParameterType,
    InvalidParameterValue,
    ParameterAlreadyDeclared,
    ParameterChange,
    ParameterImmutable,
    ParameterNotDeclared,
    ParameterStore,
    ParameterType,
    ParameterUninitialized,
)
from actors.parameters.messages import (
    PARAMETER_SERVICES,
    from_descriptor,
    from_result,
    from_value,
    to_parameter,
)
from actors.parameters.text import parse_parameter
from tests.conformance import crossing
from tests.conformance.checks.common import Case, Unsupported, Vector, by_kind, steps_of
from tests.conformance.checks.parameter_forms import (
    behavior_of,
    compare,
    default_of,
    described,
    descriptor_of,
    parameters_of,
    shown,
    typed,
    value_of,
)

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
    compare(found, expect)


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

    compare(_outcome(build), expect)


def _evaluated(given: dict[str, Any]) -> Any:
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", DeprecationWarning)  # of arrays of characters, from Python 3.13 on
        return eval(given["python_value"], {"array": _Array()})


def _cli_value(given: dict[str, Any], expect: dict[str, Any]) -> None:
    compare(typed(parse_parameter("p", given["text"])), expect)


SERVICE_TYPES = {service.name: type_name(service.type) for service in PARAMETER_SERVICES}


def _parameter_service(given: dict[str, Any], expect: dict[str, Any]) -> None:
    if given["service"] not in SERVICE_TYPES:
        raise Unsupported(f"unsupported service {given['service']!r}")
    found = {"name": f"{given['node']}/{given['service']}", "type": SERVICE_TYPES[given["service"]]}
    compare(found, expect)


def _type_id(given: dict[str, Any], expect: dict[str, Any]) -> None:
    compare({"value": ParameterType[given["type"].upper()].value}, expect)


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
                    compare(found, step["expect"])
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
                default_of(step),
                descriptor_of(step.get("descriptor")),
                ignore_override=step.get("ignore_override", False),
            )
        return {"ok": True, "value": typed(declared)}

    def op_declare_many(self, step: dict[str, Any]) -> Any:
        wanted = [
            (item["name"], default_of(item), descriptor_of(item.get("descriptor", {}))) for item in step["parameters"]
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

        chosen = behavior_of(step, {"append_if_present": append, "return_empty": nothing})
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

        chosen = behavior_of(step, {"reject_if_name_contains": reject, "record": record, "record_names": record_names})
        self._keep(step, self.store.add_on_set_callback(chosen))

    def op_add_post_set_callback(self, step: dict[str, Any]) -> Any:
        def names(parameters: Sequence[Parameter]) -> None:
            self.record.append([parameter.name for parameter in parameters])

        def record(_: Sequence[Parameter]) -> None:
            self.record.append(step["arg"])

        chosen = behavior_of(step, {"record_names": names, "record": record})
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
    response = crossing.ask(service.type, lambda asked: service.answer(store, asked), service.type.Request(**plain))
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

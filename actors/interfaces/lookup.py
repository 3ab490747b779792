"""Types by their ROS names: a type that is not known yet is imported, loaded from its definition, or derived from another."""

from __future__ import annotations

import importlib
import re
from typing import Any, Final

from actors.interfaces.errors import UnknownInterface
from actors.interfaces.message import ActionType, InterfaceClass, Message, ServiceType
from actors.interfaces.naming import Kind, closest, full_name
from actors.interfaces.registry import find_definition, known, known_names

_FULL: Final = re.compile(r"[A-Za-z]\w*(/[A-Za-z]\w*){2}\Z", re.ASCII)
_loading: list[str] = []


def get_message(name: str) -> type[Message]:
    """The message class of `std_msgs/msg/String` or `std_msgs/String`, also of a part: `std_srvs/srv/SetBool_Request`.

    Raises:
        UnknownInterface: no such message. The text gives the closest names.
    """
    found: type[Message] = _get(name, "msg", Message)
    return found


def get_service(name: str) -> type[ServiceType[Any, Any]]:
    """The service type of `std_srvs/srv/SetBool` (or `std_srvs/SetBool`), also of a part: `pkg/action/Move_SendGoal`.

    Raises:
        UnknownInterface: no such service. The text gives the closest names.
    """
    found: type[ServiceType[Any, Any]] = _get(name, "srv", ServiceType)
    return found


def get_action(name: str) -> type[ActionType[Any, Any, Any]]:
    """The action type of `example_interfaces/action/Fibonacci` (or `example_interfaces/Fibonacci`).

    Raises:
        UnknownInterface: no such action. The text gives the closest names.
    """
    found: type[ActionType[Any, Any, Any]] = _get(name, "action", ActionType)
    return found


def _get(name: str, kind: Kind, base: type[object]) -> Any:
    found = find(full_name(name, kind))
    if found is None or not issubclass(found, base):
        raise _unknown(name, kind, found)
    return found


def find(name: str) -> type[Any] | None:
    """The class of a full name, or None. Imports the generated module or loads the definition if it must.

    The name may be that of any peer: what is not ``package/kind/Name`` is no name, and leads to no file.
    """
    found = known(name)
    if found is not None or not _FULL.match(name):
        return found
    definition = find_definition(name)
    if definition is None:
        return _derived(name)
    (_, module), file = definition
    package, kind, leaf = name.split("/")
    if module is not None and _import(f"{module}.{package}.{kind}") and (found := known(name)) is not None:
        return found
    if known(f"{package}/{kind}/{leaf.partition('_')[0]}") is None:
        _load_once(file, package)
    found = known(name)
    return found if found is not None else _derived(name)


def class_of(of: str | InterfaceClass) -> InterfaceClass:
    """The type of a full name, or the type that is given. Raises UnknownInterface."""
    if not isinstance(of, str):
        return of
    cls = find(full_name(of))
    if cls is None:
        raise UnknownInterface(f"unknown type {of!r}.{closest(full_name(of), known_names())}")
    return cls


def _derived(name: str) -> type[object] | None:
    """The type of this full name that ROS 2 derives from a service or an action, or None where it is not the name of one."""
    from actors.interfaces.derived import event_message, feedback_message, get_result_service, send_goal_service

    for suffix, make in (("_SendGoal", send_goal_service), ("_GetResult", get_result_service)):
        stem, found, part = name.partition(suffix)
        if found:
            action = _find(stem, ActionType)
            if action is None:
                return None
            service: Any = make(action)
            if part == "_Event":
                return event_message(service)
            return service if not part else getattr(service, part.removeprefix("_"), None)
    stem, found, part = name.rpartition("_")
    if found and part == "Event" and (parent := _find(stem, ServiceType)) is not None:
        return event_message(parent)
    if found and part == "FeedbackMessage" and (parent := _find(stem, ActionType)) is not None:
        return feedback_message(parent)
    return None


def _find(name: str, base: type[object]) -> Any:
    cls = find(name)
    return cls if cls is not None and issubclass(cls, base) else None


def _load_once(file: str, package: str) -> None:
    from actors.interfaces.loading import load_file
    from actors.interfaces.parse import DefinitionError

    if file in _loading:
        raise DefinitionError("invalid_type_name", "the type contains itself", None, file)
    _loading.append(file)
    try:
        load_file(file, package)
    finally:
        _loading.remove(file)


def _import(module: str) -> bool:
    try:
        importlib.import_module(module)
    except ModuleNotFoundError as error:
        if error.name is None or not module.startswith(error.name):
            raise
        return False
    return True


def _unknown(name: str, kind: Kind, found: object) -> UnknownInterface:
    words = {"msg": "message", "srv": "service", "action": "action"}
    if found is not None:
        actual = full_name(name, kind).split("/")[1]
        return UnknownInterface(f"{name} is not a {words[kind]} but belongs to {actual}; ask for it as such")
    full = full_name(name, kind)
    package = full.split("/")[0]
    names = known_names()
    if not any(known.startswith(f"{package}/") for known in names):
        hint = closest(package, {known.split("/")[0] for known in names})
        return UnknownInterface(f"unknown {words[kind]} {name!r}: no package {package!r} is known here.{hint}")
    return UnknownInterface(f"unknown {words[kind]} {name!r}.{closest(full, names)}")

"""The parameters of one incarnation: making its store, attaching its hooks, and applying changes to clock and timers."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING

from actors.inbox.border import outside
from actors.parameters.declare import LOGGER_SERVICE, OPTIONAL_PARAMETERS
from actors.parameters.hooks import attach_hooks
from actors.parameters.rates import guard_rates
from actors.runtime import introspection
from actors.runtime.timers import retime

if TYPE_CHECKING:
    from actors.parameters import ParameterChange, ParameterStore
    from actors.runtime.incarnation import Incarnation

__all__ = ["check_store", "make_store", "serves_loggers"]


def make_store(life: Incarnation, *, announce: bool) -> ParameterStore:
    """Make the store of the parameters that the node's class declares. With `announce` the observers are told of their values.

    Raises `ParameterError` for an override that does not fit its declaration.
    """
    from actors.parameters import ParameterStore

    def changed(change: ParameterChange) -> None:
        _changed(life, change)

    store = ParameterStore(
        life.fqn,
        life.identity.overrides,
        table=life.declarations.table,
        allow_undeclared=life.node.allow_undeclared_parameters,
        automatically_declare=life.node.automatically_declare_parameters_from_overrides,
        on_event=changed,
        announce=announce,
    )
    _declare_optional(life.identity.overrides, store)
    return store


def _declare_optional(overrides: Mapping[str, object], store: ParameterStore) -> None:
    """Declare the optional parameters that are given and that the node does not declare itself. Raises `ParameterError`."""
    for name, declaration in OPTIONAL_PARAMETERS.items():
        if name in overrides and not store.has(name):
            store.declare(name, declaration.default.value, declaration.descriptor)


def serves_loggers(life: Incarnation) -> bool:
    """Whether a node is told to serve the levels of the loggers of its process."""
    given = LOGGER_SERVICE in life.identity.overrides or LOGGER_SERVICE in life.declarations.table.values
    return given and life.parameters.value(LOGGER_SERVICE) is True


def check_store(life: Incarnation, store: ParameterStore) -> None:
    """Attach the node's hooks and the checks of timer rates to the store, then check the overrides. Raises `ParameterError`."""
    declarations = life.declarations
    if declarations.rates:
        guard_rates(store, declarations.rates)
    if declarations.parameter_hooks:
        attach_hooks(store, life.node, declarations.parameter_hooks)
    store.check_overrides()


def _changed(life: Incarnation, change: ParameterChange) -> None:
    for parameter in change.changed:
        if parameter.name == "use_sim_time":
            life.ros_time().use(parameter.value is True)
        elif parameter.name in life.declarations.rates:
            retime(life, parameter.name, parameter.value)
        elif parameter.name in introspection.PARAMETERS:
            introspection.apply(life)
    with outside():
        for observer in life.runtime.observers.parameters:
            observer(life, change)

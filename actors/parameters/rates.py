"""Timer rates given by parameters: the check of their values, and of later changes."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from actors.errors import DeclarationError
from actors.parameters.declare import ParameterDeclaration
from actors.parameters.store import ParameterStore
from actors.parameters.values import Parameter, ParameterType, SetResult


def rate_objection(rate: object) -> str | None:
    """Why a timer cannot have this rate, in Hz; None if it can."""
    if isinstance(rate, (int, float)) and not isinstance(rate, bool) and 0.0 < rate < 1e6:
        return None
    return f"the rate must be above 0 and below a million per second, not {rate!r:.40}"


def check_rate_parameter(where: str, name: str, declared: Mapping[str, ParameterDeclaration[object]]) -> None:
    """Raise `DeclarationError`, at the class, for an ``@every(hz="name")`` whose parameter does not exist or cannot be a rate."""
    parameter = declared.get(name)
    if parameter is None:
        raise DeclarationError(f"{where}: @every(hz={name!r}) names a parameter that the class does not declare")
    if parameter.default.type not in (ParameterType.INTEGER, ParameterType.DOUBLE):
        raise DeclarationError(f"{where}: @every(hz={name!r}) names {parameter!r}, which is no number")
    if (objection := rate_objection(parameter.default.value)) is not None:
        raise DeclarationError(f"{where}: @every(hz={name!r}) names {parameter!r}: {objection}")


def guard_rates(store: ParameterStore, timers: Mapping[str, str]) -> None:
    """Let `store` refuse invalid rates for `timers`, which maps a parameter to the handler that uses it."""

    def check(parameters: Sequence[Parameter]) -> SetResult:
        for one in parameters:
            handler = timers.get(one.name)
            if handler is not None and (objection := rate_objection(one.value)) is not None:
                return SetResult(False, f"{handler} ticks by {one.name}: {objection}")
        return SetResult()

    store.add_on_set_callback(check)

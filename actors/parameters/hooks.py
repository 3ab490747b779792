"""Methods of a node class that are called before or after parameters are set.

::

    class Driver(Node):
        speed = parameter(0.5, unit="m/s")

        @speed.validate
        def sane(self, value: float) -> str | None:
            return "1.3 m/s makes it sway" if value == 1.3 else None

        @speed.changed
        def told(self, value: float) -> None:
            self.log.info("new speed", speed=value)

        @on_set
        def together(self, wanted: Sequence[Parameter]) -> SetResult: ...

Hooks are plain methods, not coroutines: when a set returns, it has been done or refused. They run in ROS 2's order (pre-set, on-set,
store, event, post-set). Within a chain, those added at run time run first, then those of the class in the order of declaration.
"""

from __future__ import annotations

import inspect
from collections.abc import Callable, Iterable, Sequence
from functools import partial
from typing import TYPE_CHECKING, Any, Final, Literal, TypeVar

from actors.contracts.contracts import Declaration, positional
from actors.errors import DeclarationError, described
from actors.parameters.values import Parameter, ParameterType, SetResult

if TYPE_CHECKING:
    from actors.parameters.declare import ParameterDeclaration
    from actors.parameters.store import ParameterStore

Node = TypeVar("Node")
Kind = Literal["validate", "changed", "pre_set", "on_set", "post_set"]


class ParameterHook(Declaration):
    """The declaration made by ``@speed.validate``, ``@speed.changed``, ``@pre_set``, ``@on_set`` or ``@post_set``."""

    __slots__ = ("kind", "parameter")

    def __init__(self, kind: Kind, parameter: ParameterDeclaration[object] | None = None) -> None:
        super().__init__()
        self.kind: Final = kind
        self.parameter: Final = parameter
        """The parameter concerned; None for all."""

    def __repr__(self) -> str:
        return f"@{self.kind}" if self.parameter is None else f"@{self.parameter.name or 'parameter'}.{self.kind}"

    def check(self, where: str) -> None:
        """Raise `DeclarationError` if the method cannot be called with the arguments of its hook."""
        argument = "parameters" if self.parameter is None else "value"
        if inspect.iscoroutinefunction(self.function) or positional(self.function) != 2:
            raise DeclarationError(
                f"{where} is {self!r}: make it a plain `def {self.attribute}(self, {argument})`, which must not wait; "
                "self.create_task(...) runs what has to"
            )


def pre_set(
    function: Callable[[Node, Sequence[Parameter]], Iterable[Parameter]],
) -> Callable[[Node, Sequence[Parameter]], Iterable[Parameter]]:
    """Decorate the method that rewrites the parameters of every set. It receives them and returns those to set instead.

    It is ROS 2's pre-set callback. If no parameters are left, the set is refused.
    """
    ParameterHook("pre_set").attach(function)
    return function


def on_set(
    function: Callable[[Node, Sequence[Parameter]], SetResult],
) -> Callable[[Node, Sequence[Parameter]], SetResult]:
    """Decorate the method that accepts or refuses every set as a whole, by returning ``SetResult()`` or ``SetResult(False, reason)``.

    It is ROS 2's on-set callback. It must have no side effects, because the values are not stored yet and a later check may still refuse.
    It is also called, before `on_start`, for the values with which the node is started.
    """
    ParameterHook("on_set").attach(function)
    return function


def post_set(function: Callable[[Node, Sequence[Parameter]], None]) -> Callable[[Node, Sequence[Parameter]], None]:
    """Decorate the method called after every set, when it is stored and reported. It may have side effects.

    It is ROS 2's post-set callback.
    """
    ParameterHook("post_set").attach(function)
    return function


def attach_hooks(store: ParameterStore, node: object, hooks: Sequence[ParameterHook]) -> None:
    """Add the hooks declared by a class to the callback chains of its node's store."""
    add: dict[Kind, Callable[[Any], object]] = {
        "validate": store.add_on_set_callback,
        "changed": store.add_post_set_callback,
        "pre_set": store.add_pre_set_callback,
        "on_set": store.add_on_set_callback,
        "post_set": store.add_post_set_callback,
    }
    for hook in reversed(hooks):  # in a chain, the callback added last runs first
        method = getattr(node, hook.attribute)
        if hook.parameter is not None:
            method = partial(_asked if hook.kind == "validate" else _told, method, hook.parameter.name)
        add[hook.kind](method)


def _asked(method: Callable[[Any], object], name: str, parameters: Sequence[Parameter]) -> SetResult:
    for one in parameters:
        if one.name == name and one.type is not ParameterType.NOT_SET and (reason := method(one.value)) is not None:
            if not isinstance(reason, str) or not reason:
                raise TypeError(
                    f"@{name}.validate {method.__qualname__} answered {described(reason)}; return None to accept the value, "
                    "or the reason why not"
                )
            return SetResult(False, reason)
    return SetResult()


def _told(method: Callable[[Any], None], name: str, parameters: Sequence[Parameter]) -> None:
    values = [one.value for one in parameters if one.name == name and one.type is not ParameterType.NOT_SET]
    if values:  # if a name is given twice, its last value counts
        method(values[-1])

"""What a node is asked before it is replayed alone: whether it can be, with these parameters, and where it is to stop."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING

from actors.logs import INFO
from actors.replay.errors import ReplayError
from actors.running.options import options_of
from actors.runtime.options import identity_of

if TYPE_CHECKING:
    from actors.replay.debugger import Break
    from actors.supervision.child import Child


def check_alone(child: Child) -> None:
    """Raise `ReplayError` for a node that cannot be run alone, because its class or an argument of it says so by `no_replay`."""
    for each, what in (
        (child.factory, ""),
        *((type(one), f"its argument {type(one).__name__} ") for one in child.args),
    ):
        why: str | None = getattr(each, "no_replay", None)
        if why is not None:
            raise ReplayError(f"{what}{why}")


def check_parameters(child: Child, parameters: Mapping[str, object]) -> None:
    """Raise `ReplayError`, in one line, for a parameter that the node does not have, or a value that it cannot have."""
    fqn = identity_of(child, ("replay", child.name)).fqn
    try:
        options_of("parameters", child, {fqn: dict(parameters)}, None, INFO)
    except ValueError as error:
        raise ReplayError(str(error)) from error


def stop_at(topic: str, number: int, debugger: Callable[[], object] | None) -> Break:
    """The break before the `number`-th message of `topic`. Python's debugger is imported only for that."""
    from actors.replay.debugger import Break

    return Break(topic, number, debugger)

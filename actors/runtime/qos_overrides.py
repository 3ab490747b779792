"""Quality of service by parameters: an endpoint that allows it declares its policies as parameters and takes their values."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from actors.parameters.descriptor import ParameterDescriptor
from actors.qos import InvalidQoS
from actors.qos.overriding import changes

if TYPE_CHECKING:
    from actors.qos.policies import QoS
    from actors.runtime.incarnation import Incarnation

__all__ = ["overridden"]


def overridden(life: Incarnation, topic: str, kind: str, qos: QoS) -> QoS:
    """The profile of a new endpoint, a ``publisher`` or ``subscription`` of `topic` (its full name), as the node's parameters say.

    The parameters are declared, unless an earlier endpoint has done that. Raises `InvalidQoS` for values that are none, or that the
    endpoint refuses.
    """
    overriding = qos.overriding
    if overriding is None:
        return qos
    store, values = life.parameters, dict[str, Any]()
    for policy, (name, default) in overriding.parameters(topic, kind, qos).items():
        if not store.has(name):
            description = f"{policy} for {kind} `{topic}`{f' with id `{overriding.id}`' if overriding.id else ''}"
            store.declare(name, default, ParameterDescriptor(description=description, read_only=True))
        if (value := store.value(name)) != default:
            values[policy] = value
    try:
        found = qos.replace(**changes(values))
    except InvalidQoS as error:
        raise InvalidQoS(f"{life.fqn}: the parameters for its {kind} of {topic}: {error}") from None
    reason = None if overriding.validate is None else overriding.validate(found)
    if reason is not None:
        raise InvalidQoS(f"{life.fqn}: its {kind} of {topic} cannot be {found!r}: {reason}")
    return found

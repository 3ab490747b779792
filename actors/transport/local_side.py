"""What this process has on the network: its nodes, and what they need to have endpoints."""

from __future__ import annotations

from typing import Any, Final

from actors.interfaces.hashes import type_hash
from actors.runtime.runtime import Runtime
from actors.transport.protocol import NodeHere, Participant, Transport, TypeInfo
from actors.transport.unreadable import Unreadable


class LocalSide:
    """One system on the network: its transport, and its nodes.

    Invariants: `participant` is set while the transport is open, and before anything is shown. A node is shown from its first endpoint, or its
    first start, until it has ended for good.
    """

    participant: Participant

    def __init__(self, transport: Transport, runtime: Runtime) -> None:
        self.session = transport.session
        self.runtime = runtime
        self.wall_ns = runtime.clock.wall_ns
        """The time of day, in nanoseconds since 1970."""
        self.unreadable = Unreadable(runtime.log.warning)
        self._nodes: dict[str, NodeHere] = {}

    def node(self, fqn: str) -> NodeHere:
        """A node of this process, which is shown from now on. Raises WireFormatError."""
        known = self._nodes.get(fqn)
        if known is None:
            known = self._nodes[fqn] = self.participant.node(fqn)
        return known

    def named(self, number: int) -> str | None:
        """The name of the node with this number; None if there is none."""
        return next((fqn for fqn, node in self._nodes.items() if node.number == number), None)

    def forget(self, fqn: str) -> None:
        """Withdraw a node. Its endpoints have been closed before."""
        known = self._nodes.pop(fqn, None)
        if known is not None:
            known.close()


_BYTES: Final = ("uint8", "int8", "byte", "char")


def type_info(cls: Any) -> TypeInfo:
    """What a transport must know of a type of this process."""
    fields = getattr(cls, "__ros_fields__", ())  # a service has none
    unbounded = {field.type.base for field in fields if field.type.array == "unbounded"}
    return TypeInfo(cls.__ros_type__, type_hash(cls), any(each in unbounded for each in _BYTES), "uint8" in unbounded)

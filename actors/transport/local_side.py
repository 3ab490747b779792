"""What this process has on the network: its nodes, and what they need to have endpoints."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, Final

from actors.interfaces.hashes import type_hash
from actors.runtime.runtime import Runtime
from actors.transport.protocol import NodeHere, Participant, Transport, TypeInfo

_PLACES: Final = 1000
"""So many places are remembered; what comes at others is only counted, so that a stranger can fill neither the memory nor the log."""


class Unreadable:
    """Counts for one system.

    Invariants: `count` is the number of all `note`s, and never falls; for each kind of data and place there is at most one line in the log.
    """

    def __init__(self, warn: Callable[..., Any]) -> None:
        """`warn` writes a line to the log of the system."""
        self._warn = warn
        self._reported: set[tuple[str, str]] = set()
        self.count = 0

    def note(
        self, what: str, place: str, error: Exception, *, warn: Callable[..., Any] | None = None, **fields: object
    ) -> None:
        """Something has come. `what` is the line for the log, and `place` the topic or service where it has come; `warn` writes it."""
        self.count += 1
        if (what, place) not in self._reported and len(self._reported) < _PLACES:
            self._reported.add((what, place))
            (warn or self._warn)(what, **fields, because=str(error), next="further ones are counted only")


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
        """Withdraw a node that has ended for good. Its endpoints have been closed before."""
        known = self._nodes.pop(fqn, None)
        if known is not None:
            known.close()


_BYTES: Final = ("uint8", "int8", "byte", "char")


def type_info(cls: Any) -> TypeInfo:
    """What a transport must know of a type of this process."""
    fields = getattr(cls, "__ros_fields__", ())  # a service has none
    unbounded = {field.type.base for field in fields if field.type.array == "unbounded"}
    return TypeInfo(cls.__ros_type__, type_hash(cls), any(each in unbounded for each in _BYTES), "uint8" in unbounded)

"""Servers of other processes, as they stand in the graph of this one."""

from __future__ import annotations

import asyncio
import math
from collections.abc import Collection
from typing import Any, Final, Protocol

from actors.errors import CallTimeout, NotRunning, ServiceFailed
from actors.interfaces import registry
from actors.interfaces.cdr import decode, encode
from actors.interfaces.errors import CdrError
from actors.interfaces.foreign import ForeignType
from actors.interfaces.message import Message
from actors.services.peers import Caller
from actors.transport.format.errors import WireFormatError
from actors.transport.format.replies import TIMED_OUT, parse_reply_error
from actors.transport.local_clients import Clients
from actors.transport.protocol import Answer, Failed, Handle, NoAnswer, RemoteEndpoint, Replied

_LONGEST: Final = {"type_description_interfaces/srv/GetTypeDescription": 2 << 20}
"""The longest replies, in bytes, of services that are asked of nodes that nobody here has chosen. What is longer is not read."""
_LATER: Final = 1.0
"""Seconds from the deadline of a call until the transport may forget it: the deadline comes first."""
_DROPPED: Final = (
    "{} is served, but not this request; a server of ROS 2 keeps the newest of those that wait, 10 by default: "
    "send fewer at once, or give it a greater depth"
)


class Server(Protocol):
    """What the text of an error needs of a server."""

    @property
    def name(self) -> str: ...

    @property
    def host(self) -> str: ...

    @property
    def gone(self) -> bool:
        """Whether it has vanished."""
        ...


class RemoteServer:
    """A server of another process.

    Invariant: `open` holds the calls that have been sent there and have no answer yet.
    """

    node = None
    concurrent = 0  # only its own process knows the number; the chain of a request tells that process which nodes wait

    def __init__(self, endpoint: RemoteEndpoint, type: ForeignType, clients: Clients) -> None:
        self.type: Any = type
        self.name = endpoint.name
        self.calls = 0
        self._node = endpoint.node
        self._endpoint = endpoint
        self._clients = clients
        self._open: dict[RemoteCall, None] = {}
        self.gone = False

    def __repr__(self) -> str:
        return f"<server of {self.name} in {self.host}, elsewhere: {len(self._open)} open>"

    @property
    def host(self) -> str:
        return self._node.fqn

    @property
    def identity(self) -> tuple[str, int]:
        """What distinguishes its node from all others."""
        return self._node.identity

    def open(self) -> Collection[RemoteCall]:
        return tuple(self._open)

    def suspect(self, caller: Caller, node: Caller) -> None:
        """See `actors.services.peers.Elsewhere`."""
        self._clients.cycles.suspect(caller, node)

    def submit(self, message: Message, caller: Caller, timeout: float) -> RemoteCall:
        """Send a request. Raises CdrError for a message that cannot be encoded."""
        payload = encode(message)
        client = self._clients.of(caller.fqn, self._endpoint)
        extension = self._clients.cycles.extension_of(caller)
        call = RemoteCall(self, caller.inbox.loop.create_future(), client.next)
        caller.deadlines.watch(call, timeout)
        self.calls += 1
        self._open[call] = None
        forgotten = None if timeout == math.inf else timeout + _LATER
        call.question = client.ask(payload, call.done, extension, forgotten)
        call.future.add_done_callback(call.over)
        return call

    def ended(self, call: RemoteCall) -> None:
        """Forget a call that has its answer, or whose caller has given up."""
        del self._open[call]


class RemoteCall:
    """A call to a server of another process.

    Invariant: `future` is completed once, by `done`, by the deadline (`late`) or by the caller, which cancels it when it gives up; then the
    question is closed.
    """

    question: Handle

    def __init__(self, server: RemoteServer, future: asyncio.Future[Any], call_id: tuple[bytes, int]) -> None:
        self.server = server
        self.future = future
        self.call_id = call_id
        self.due = math.inf

    def __repr__(self) -> str:
        return f"<call of {self.server.name} in {self.server.host}>"

    @property
    def answered(self) -> bool:
        return self.future.done()

    def late(self) -> CallTimeout:
        return CallTimeout(
            f"{self.server.host} did not answer {self.server.name} in time: give the call more time, or make it an action"
        )

    def over(self, future: object) -> None:
        """Close the question: the call has its answer, or its caller has given up."""
        self.question.close()
        self.server.ended(self)

    def done(self, answer: Answer) -> None:
        """Give the caller what has come."""
        if self.future.done():
            return
        if not isinstance(answer, Replied):
            self.future.set_exception(failure_of(self.server, answer) or self.late())
            return
        name = self.server.type.__ros_type__
        service: Any = registry.known(name)
        try:
            if len(answer.payload) > (most := _LONGEST.get(name, len(answer.payload))):
                raise CdrError(f"a reply of {len(answer.payload)} bytes, more than {most}")
            self.future.set_result(decode(service.Response, answer.payload))
        except CdrError as error:
            self.future.set_exception(ServiceFailed(self.server.host, "CdrError", str(error)))


def failure_of(server: Server, answer: Failed | NoAnswer) -> Exception | None:
    """The error that a caller gets for an answer that is none; None if the time is over."""
    if answer == NoAnswer(timed_out=True) or (isinstance(answer, Failed) and answer.payload == TIMED_OUT):
        return None
    if isinstance(answer, NoAnswer):
        if not server.gone:
            return ServiceFailed(server.host, "request dropped", _DROPPED.format(server.name))
        return NotRunning(
            f"{server.host}, which serves {server.name}, has ended or is lost, and has not answered: ask again when it is back"
        )
    try:
        return parse_reply_error(answer.payload)
    except WireFormatError:
        return ServiceFailed(server.host, "error reply", answer.payload.decode(errors="backslashreplace")[:200])

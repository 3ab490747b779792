"""Servers and clients of this process on DDS: a service is two topics, of which each client takes the replies to itself."""

from __future__ import annotations

import secrets
import struct
from asyncio import TimerHandle
from collections.abc import Callable
from functools import partial
from typing import TYPE_CHECKING, Final, NamedTuple

from actors.errors import ServiceFailed
from actors.transport.dds.format.names import Role
from actors.transport.dds.format.requests import RequestId, parse_request, write_request
from actors.transport.format.errors import WireFormatError
from actors.transport.format.replies import write_reply_error
from actors.transport.protocol import Answer, Failed, NoAnswer, Replied, Request

if TYPE_CHECKING:
    from actors.transport.dds.domain import Domain, Pair
    from actors.transport.dds.endpoints import Sample, Status
    from actors.transport.dds.known import NodeHere, Shown

_END: Final = struct.Struct("<IB7s")
_MARK: Final = b"robactr"


class Extra(NamedTuple):
    """What is added to requests and replies, behind the message: others never get it, because it is sent to our peers only.

    ====  ==========================================
    size  content, from the end
    ====  ==========================================
    7     ``robactr``
    1     0: an extension; 1: an error in place of a reply
    4     the length of the content, little endian
    any   the content, padded to a multiple of 4
    ====  ==========================================
    """

    content: bytes = b""
    is_error: bool = False


def add_extra(message: bytes, extra: Extra) -> bytes:
    """The message with what is added. Its length is a multiple of 4, so that the wire pads nothing."""
    padded = b"%b%b%b%b" % (message, bytes(-len(message) % 4), extra.content, bytes(-len(extra.content) % 4))
    return padded + _END.pack(len(extra.content), extra.is_error, _MARK)


def split_extra(data: bytes) -> tuple[bytes, Extra]:
    """The message, perhaps with padding, and what is added; nothing if there is none, or if it is none of ours."""
    if len(data) < _END.size:
        return data, Extra()
    length, is_error, mark = _END.unpack_from(data, len(data) - _END.size)
    start = len(data) - _END.size - length - (-length % 4)
    if mark != _MARK or start < 0:
        return data, Extra()
    return data[:start], Extra(data[start : start + length], bool(is_error))


_PATIENCE: Final = 5.0
"""Seconds for which a reply waits until its client is matched; `rmw_cyclonedds_cpp` waits for a part of a second."""
_MOST_WAITING: Final = 1000
REMEDY: Final = "start the other side with RMW_IMPLEMENTATION=rmw_cyclonedds_cpp, or both with rmw_zenoh_cpp"
_EMPTY: Final = b"\x00\x01\x00\x00"


class _Ends:
    """Both ends of one service in this process: what reads, and what writes."""

    def __init__(
        self,
        domain: Domain,
        node: NodeHere,
        pair: Pair,
        take: Callable[[list[Sample]], None],
        changed: Callable[[Status], None],
    ) -> None:
        self.reader = domain.engine.reader(*pair.reads, pair.read_qos, take, on_status=changed, last=True)
        self.writer = domain.engine.writer(*pair.writes, pair.write_qos, changed)
        self._node = node
        node.add(reader=self.reader.guid, writer=self.writer.guid)

    def close(self) -> None:
        self._node.remove(reader=self.reader.guid, writer=self.writer.guid)
        self.reader.close()
        self.writer.close()


class _Reply(NamedTuple):
    """A reply that waits for its client's reader."""

    client: Shown
    data: bytes
    until: float


class Server:
    """A server of this process.

    Invariants: `_early` holds the requests whose clients have not been discovered yet, and `_waiting` the replies whose clients are not matched yet;
    while there are some, a timer runs.
    """

    def __init__(self, domain: Domain, node: NodeHere, name: str, pair: Pair, take: Callable[[Request], None]) -> None:
        self._domain = domain
        self._name = name
        self._take = take
        self._early: list[tuple[Sample, float]] = []
        self._waiting: list[_Reply] = []
        self._timer: TimerHandle | None = None
        self._ends: _Ends | None = _Ends(domain, node, pair, self._arrived, self._changed)
        self.gid = self._ends.reader.guid
        domain.services.add(self)

    def close(self) -> None:
        ends, self._ends = self._ends, None
        self._domain.services.discard(self)
        if ends is not None:
            ends.close()
        self._early, self._waiting = [], []
        if self._timer is not None:
            self._timer.cancel()

    def _arrived(self, samples: list[Sample]) -> None:
        for sample in samples:
            client = self._client(sample.writer)
            if client is not None:
                self._asked(sample, client)
            elif len(self._early) < _MOST_WAITING:  # a request may be faster than the discovery of its client
                self._early.append((sample, self._domain.loop.time() + _PATIENCE))
                self._watch()

    def _client(self, writer: bytes) -> Shown | None:
        return self._domain.known.services.get((Role.REQUEST, self._name), {}).get(writer)

    def _asked(self, sample: Sample, client: Shown) -> None:
        if self._ends is None:
            return
        if client.unanswerable:
            self._domain.explain(f"clients of {self._name} are of rmw_fastrtps: no reply can reach them")
            return
        try:
            request, message = parse_request(sample.payload)
        except WireFormatError as error:
            self._domain.events.unreadable("a request cannot be read", self._name, error, service=self._name)
            return
        ours = self._domain.known.ours(sample.writer)
        message, extra = split_extra(message) if ours else (message, Extra())
        self._take(_Request(self, request, message, extra.content, client, ours))

    def reply(self, client: Shown, data: bytes) -> None:
        """Send a reply as soon as the reader of its client is matched."""
        if self._ends is None:
            return
        if self._reached(client):
            self._ends.writer.put(data)
        elif len(self._waiting) < _MOST_WAITING:
            self._waiting.append(_Reply(client, data, self._domain.loop.time() + _PATIENCE))
            self._watch()

    def _reached(self, client: Shown) -> bool:
        """Whether the reader of the replies to a client is matched: it has the same id as what has written the request, if that has one."""
        assert self._ends is not None
        if not client.data.client:
            return True
        matched = self._ends.writer.matched_guids()
        ends = self._domain.known.services.get((Role.REPLY, self._name), {})
        return any(guid in matched for guid, end in ends.items() if end.data.client == client.data.client)

    def _changed(self, status: Status) -> None:
        if status.kind == "matched":
            self.look()

    def look(self) -> None:
        """Somebody has been discovered or matched: go on with what waits for that."""
        if self._ends is None:
            return
        now = self._domain.loop.time()
        early, self._early = self._early, []
        for sample, until in early:
            if (client := self._client(sample.writer)) is not None:
                self._asked(sample, client)
            elif until > now:
                self._early.append((sample, until))
        waiting, self._waiting = self._waiting, []
        for one in waiting:
            if self._reached(one.client):
                self._ends.writer.put(one.data)
            elif one.until > now:
                self._waiting.append(one)

    def _watch(self) -> None:
        if self._timer is None:
            self._timer = self._domain.loop.call_later(_PATIENCE, self._expire)

    def _expire(self) -> None:
        self._timer = None
        self.look()
        if self._early or self._waiting:
            self._watch()


class _Request:
    """A request of another process."""

    def __init__(
        self,
        server: Server,
        request: RequestId,
        payload: bytes,
        extension: bytes,
        client: Shown,
        ours: bool,
    ) -> None:
        self._server = server
        self._request = request
        self.payload = payload
        self.gid = client.of_dds.guid
        self.number = request.number
        self.extension = extension
        self._client = client
        self._ours = ours
        self._open = True

    def reply(self, payload: bytes, source_time: int, extension: bytes) -> None:
        self._end(payload, Extra(extension))

    def fail(self, payload: bytes) -> None:
        if self._ours:
            self._end(_EMPTY, Extra(payload, is_error=True))

    def drop(self) -> None:
        self._open = False

    def _end(self, payload: bytes, extra: Extra) -> None:
        if self._open:
            self._open = False
            data = write_request(self._request, payload)
            self._server.reply(self._client, add_extra(data, extra) if self._ours else data)


class _Asked:
    """A request of this process, until it is answered or given up."""

    def __init__(self, client: Client, number: int, done: Callable[[Answer], None]) -> None:
        self.done = done
        self.data: tuple[bytes, bytes] | None = None
        """The message and the extension, until they are sent."""
        self.timer: TimerHandle | None = None
        self._client = client
        self._number = number

    def close(self) -> None:
        self._client.forget(self._number)


class Client:
    """A client of this process.

    Invariants: `_asked` holds the requests that are open, by number; those with `data` wait until both ends of a server are matched.
    """

    def __init__(self, domain: Domain, node: NodeHere, name: str, pair: Pair) -> None:
        self._domain = domain
        self._name = name
        self._id = secrets.randbits(64)
        self._asked: dict[int, _Asked] = {}
        self._ends: _Ends | None = _Ends(domain, node, pair, self._arrived, self._changed)
        self.gid = self._ends.writer.guid
        domain.services.add(self)

    def close(self) -> None:
        ends, self._ends = self._ends, None
        self._domain.services.discard(self)
        for number in tuple(self._asked):
            self.forget(number)
        if ends is not None:
            ends.close()

    def ask(
        self,
        payload: bytes,
        number: int,
        source_time: int,
        extension: bytes,
        timeout: float | None,
        done: Callable[[Answer], None],
    ) -> _Asked:
        asked = self._asked[number] = _Asked(self, number, done)
        asked.data = payload, extension
        loop = self._domain.loop
        if timeout is not None:
            asked.timer = loop.call_later(max(timeout, 0.0), self._finish, number, NoAnswer(timed_out=True))
        loop.call_soon(self.look)
        return asked

    def forget(self, number: int) -> None:
        """A request is given up, or over."""
        asked = self._asked.pop(number, None)
        if asked is not None and asked.timer is not None:
            asked.timer.cancel()

    def _finish(self, number: int, answer: Answer) -> None:
        asked = self._asked.get(number)
        if asked is not None:
            self.forget(number)
            asked.done(answer)

    def look(self) -> None:
        """Send what waits, if a server is matched; end what nobody can answer any more."""
        if self._ends is None or not self._asked:
            return
        servers = self._domain.known.services.get((Role.REQUEST, self._name), {})
        servers = {guid: end for guid, end in servers.items() if not end.of_dds.writes}
        answering = {guid: end for guid, end in servers.items() if not end.unanswerable}
        if not servers:
            self._end_all(NoAnswer(timed_out=False))
        elif not answering:
            text = f"its server is of rmw_fastrtps, whose replies cannot be told apart on Cyclone DDS: {REMEDY}"
            self._domain.explain(f"the server of {self._name} is of rmw_fastrtps: it cannot be called")
            self._end_all(Failed(write_reply_error(ServiceFailed(self._host(servers), "rmw_fastrtps", text))))
        elif any(one.data is not None for one in self._asked.values()) and self._matched(answering):
            ours = all(self._domain.known.ours(guid) for guid in servers)
            for number, one in tuple(self._asked.items()):
                if one.data is not None:
                    payload, extension = one.data
                    one.data = None
                    data = write_request(RequestId(self._id, number), payload)
                    self._ends.writer.put(add_extra(data, Extra(extension)) if ours else data)

    def _host(self, servers: dict[bytes, Shown]) -> str:
        return next((end.endpoint.node.fqn for end in servers.values() if end.endpoint is not None), "a node elsewhere")

    def _matched(self, servers: dict[bytes, Shown]) -> bool:
        """Whether a server takes our requests, and we its replies."""
        assert self._ends is not None
        readers, writers = self._ends.writer.matched_guids(), self._ends.reader.matched_guids()
        replying = self._domain.known.services.get((Role.REPLY, self._name), {})
        ids = {end.data.server for guid, end in replying.items() if guid in writers}
        return any(guid in readers and end.data.server in ids for guid, end in servers.items())

    def _end_all(self, answer: Answer) -> None:
        for number in tuple(self._asked):
            self._domain.loop.call_soon(partial(self._finish, number, answer))

    def _changed(self, status: Status) -> None:
        if status.kind == "matched":
            self.look()

    def _arrived(self, samples: list[Sample]) -> None:
        for sample in samples:
            try:
                request, message = parse_request(sample.payload)
            except WireFormatError as error:
                self._domain.events.unreadable("a reply cannot be read", self._name, error, service=self._name)
                continue
            if request.client != self._id or request.number not in self._asked:
                continue  # of another client, or late
            extra = Extra()
            if self._domain.known.ours(sample.writer):
                message, extra = split_extra(message)
            answer = Failed(extra.content) if extra.is_error else Replied(message, extra.content)
            self._finish(request.number, answer)

"""What a Foxglove client publishes."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, NamedTuple

from actors.interfaces import CdrError
from actors.interfaces.errors import InterfaceError
from cli.web.clients.errors import BadRequest, Refused
from cli.web.clients.fields import entries, number, objects, text
from cli.web.clients.names import interface
from cli.web.graph.client_nodes import Publications

if TYPE_CHECKING:
    from actors.typing import Publisher
    from cli.web.hub import Hub

ENCODINGS = ("cdr", "json")


class ClientChannel(NamedTuple):
    """A channel that a client has advertised."""

    publisher: Publisher[Any]
    encoding: str


class Publishing:
    """The channels of one client, by the numbers that it has given them."""

    def __init__(self, hub: Hub) -> None:
        self._hub = hub
        self._publications = Publications(hub.client_nodes)
        self._channels: dict[int, ClientChannel] = {}

    async def advertise(self, request: dict[str, Any]) -> None:
        """Open channels. Raises `Refused` for one that cannot be had."""
        for channel in objects(request, "channels"):
            encoding = text(channel, "encoding")
            if encoding not in ENCODINGS:
                raise Refused(f"encoding {encoding!r:.40}: messages come in {' or '.join(ENCODINGS)}")
            topic, name = text(channel, "topic"), interface(text(channel, "schemaName"), "msg")
            entry = self._hub.system.graph.topics.get(topic)
            ends: list[Any] = [] if entry is None else [*entry.publishers, *entry.subscriptions]
            kind = await self._hub.types.message(name, [(end.node.fqn, end.type) for end in ends])
            publisher = await self._publications.open(topic, kind)
            self._channels[number(channel, "id")] = ClientChannel(publisher, encoding)

    def unadvertise(self, request: dict[str, Any]) -> None:
        """Close channels; those that are not open are ignored."""
        for channel in entries(request, "channelIds", int):
            self._channels.pop(channel, None)

    async def publish(self, channel: int, payload: bytes) -> None:
        """Publish a message. Raises `Refused`."""
        found = self._channels.get(channel)
        if found is None:
            raise BadRequest(f"client channel {channel} is not advertised")
        publisher, conversions = found.publisher, self._hub.conversions
        if found.encoding == "json":
            data = await conversions.object(payload)
            publisher.publish(await conversions.message(publisher.type, data, self._hub.system.clock.stamp()))
            return
        try:
            message = await conversions.cdr(publisher.type, payload)
        except (CdrError, InterfaceError) as error:
            raise BadRequest(f"{publisher.entry.name}: {error}") from None
        publisher.publish(message)

    def close(self) -> None:
        """Stop publishing."""
        self._publications.close()

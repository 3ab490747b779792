"""The process of the clients: ``python -m tests.conformance.elsewhere SOCKET`` does what `apart.Remote` tells it to."""

from __future__ import annotations

import asyncio
import pickle
import sys
from typing import Any

from actors.transport.protocol import Transport
from actors.transport.zenoh import ZenohConfig, ZenohTransport
from tests.conformance.client import Client
from tests.conformance.pickled import dumps


def transport_at(wire: str, place: int) -> Transport:
    """A transport that meets only those of the same place: of a gossip port, or over ``dds`` of a domain."""
    if wire == "dds":
        from tests.actors.transport.dds.meeting import MeetingTransport

        return MeetingTransport(place)
    return ZenohTransport(ZenohConfig(gossip_port=place))


class Program:
    """Makes clients, and lets them do what comes by the socket; each order is one connection."""

    def __init__(self) -> None:
        self._clients: dict[int, Client] = {}

    async def serve(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        verb, client, arguments = pickle.loads(await reader.read())
        try:
            done = True, await self._do(verb, client, arguments)
        except Exception as error:
            done = False, f"{type(error).__name__}: {error}"
        writer.write(dumps(done))
        writer.close()

    async def _do(self, verb: str, client: int, arguments: tuple[Any, ...]) -> Any:
        if verb == "make":
            self._clients[client] = Client(transport_at(arguments[0], client))
            return None
        return await getattr(self._clients[client], verb)(*arguments)


async def main(path: str) -> None:
    async with await asyncio.start_unix_server(Program().serve, path) as server:
        print("ready", flush=True)
        await server.serve_forever()


if __name__ == "__main__":
    asyncio.run(main(sys.argv[1]))

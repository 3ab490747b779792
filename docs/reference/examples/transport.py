"""A transport of your own: the interface below the graph, and two ends of it in one program."""

import asyncio
import socket
import time

from actors import Node, Topic, every, publishes, qos, run
from actors.interfaces import type_hash
from actors.interfaces.std_msgs.msg import String
from actors.interfaces.std_srvs.srv import Trigger
from actors.transport import (
    Answer, ClientHere, EndpointHere, EndpointKind, Events, Failed, Handle, Link, NoAnswer, NodeHere, Participant, PublisherHere,
    RemoteEndpoint, RemoteNode, Replied, Request, Take, Transport, TypeInfo, Wait, WireUnavailable,
    transport_from_environment,
)
from actors.transport.zenoh import ZenohConfig, ZenohTransport

# -- who takes part

CHATTER = Topic(String, "chatter")


class Talker(Node):
    out = publishes(CHATTER)

    @every(hz=10)
    def talk(self) -> None:
        self.out(String(data="hello"))


async def talk(seconds: float, config: ZenohConfig) -> list[str]:
    async with run(Talker, transport=ZenohTransport(config)) as system:
        await asyncio.sleep(seconds)
        return [node.name for node in system.snapshot().nodes]


# gossip_port=0: this example meets nobody; leave it out to meet the processes of this machine
print(asyncio.run(talk(0.1, ZenohConfig(gossip_port=0))))

# -- a transport of your own

class Desk:
    """What a transport tells its owner: the nodes and endpoints that are there, who is wanted, and what is lost."""

    def __init__(self) -> None:
        self.found: asyncio.Queue[RemoteEndpoint] = asyncio.Queue()

    def node(self, node: RemoteNode, there: bool) -> None: ...

    def appeared(self, endpoint: RemoteEndpoint) -> None:
        self.found.put_nowait(endpoint)

    def vanished(self, endpoint: RemoteEndpoint) -> None: ...

    def wanted(self, publisher: PublisherHere) -> None: ...

    def link(self, session: str, up: bool) -> None: ...

    def told(self, data: bytes) -> None: ...

    def lost(self, taker: object, messages: int) -> None: ...

    def unreadable(self, what: str, place: str, error: Exception, **fields: object) -> None: ...


STRING = TypeInfo("std_msgs/msg/String", type_hash(String))
TRIGGER = TypeInfo("std_srvs/srv/Trigger", type_hash(Trigger))


def answer(request: Request) -> None:
    request.reply(b"\x00\x01\x00\x00" + b"42", time.time_ns(), b"")


async def two_ends() -> None:
    with socket.create_server(("127.0.0.1", 0)) as free:
        place = f"tcp/127.0.0.1:{free.getsockname()[1]}"
    robot: Transport = ZenohTransport(ZenohConfig(gossip_port=0, listen=(place,)))
    desk: Transport = ZenohTransport(ZenohConfig(gossip_port=0, connect=(place,)))
    owner: Events = Desk()
    there: Participant = await robot.join(0, Desk())
    node: NodeHere = there.node("/robot")
    state: PublisherHere = there.publisher(node, "/state", STRING, qos.LATCHED)  # kept for those who come later
    state.open()
    state.put(b"\x00\x01\x00\x00" + b"state", 1, time.time_ns())
    drained: Wait | None = state.drained  # something to await before the next message, if this one may not be dropped
    assert drained is None
    served: EndpointHere = there.server(node, "/poke", TRIGGER, qos.SERVICES, answer)

    seen = Desk()
    owner = seen
    here = await desk.join(0, owner)
    while (await asyncio.wait_for(seen.found.get(), timeout=10.0)).kind is not EndpointKind.SERVER:
        pass
    me = here.node("/desk")
    client: ClientHere = here.client(me, "/poke", TRIGGER, qos.SERVICES)
    replied: asyncio.Future[Answer] = asyncio.get_running_loop().create_future()
    asked: Handle = client.ask(b"\x00\x01\x00\x00", 1, time.time_ns(), b"", 5.0, replied.set_result)
    match await replied:
        case Replied(payload=payload):
            assert payload.endswith(b"42")
        case Failed() | NoAnswer() as lost:
            raise AssertionError(lost)
    asked.close()

    messages: asyncio.Queue[bytes] = asyncio.Queue()
    take: Take = lambda takers, gid, number, sent, payload, since: messages.put_nowait(payload)
    here.subscription(me, "/state", STRING, qos.LATCHED, take, "desk")
    assert (await asyncio.wait_for(messages.get(), timeout=10.0)).endswith(b"state")
    links: tuple[Link, ...] = desk.report()
    assert [link.session for link in links] == [robot.session]
    served.close()
    await desk.close()
    await robot.close()


asyncio.run(two_ends())

assert transport_from_environment({"RMW_IMPLEMENTATION": "in_process"}) is None
try:
    transport_from_environment({"RMW_IMPLEMENTATION": "rmw_connextdds"})
except WireUnavailable as error:
    print(error)

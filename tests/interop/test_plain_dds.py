"""A program of plain `cyclonedds` that knows nothing of ROS: it is heard, and hears, as any DDS program on a topic of ours would."""

from __future__ import annotations

import random
from collections.abc import AsyncIterator
from pathlib import Path

import pytest
import pytest_asyncio

from actors import Topic
from actors.interfaces.std_msgs.msg import String
from actors.transport import transport_from_environment
from tests.interop.parties import Ours, Program, deliver, our_system

pytestmark = [pytest.mark.interop, pytest.mark.realtime]

TYPE = "std_msgs/msg/String"
CHATTER = Topic(String, "/chatter")
MESSAGES = [{"data": text} for text in ("first", "zwölf 🦊", "", "x" * 70_000, "last")]
PEERS = (
    "<General><AllowMulticast>false</AllowMulticast></General>"
    '<Discovery><ParticipantIndex>auto</ParticipantIndex><Peers><Peer address="localhost"/></Peers></Discovery>'
)


@pytest.fixture
def domain(monkeypatch: pytest.MonkeyPatch) -> str:
    number = str(random.randrange(1, 100))
    monkeypatch.setenv("ROS_DOMAIN_ID", number)
    return number


@pytest_asyncio.fixture
async def ours(domain: str) -> AsyncIterator[Ours]:
    environment = {
        "RMW_IMPLEMENTATION": "rmw_cyclonedds_cpp",
        "ROS_DOMAIN_ID": domain,
        "ROS_AUTOMATIC_DISCOVERY_RANGE": "LOCALHOST",
    }
    async with our_system(0, transport=transport_from_environment(environment)) as one:
        yield one


@pytest_asyncio.fixture
async def there(python: Path, ours: Ours, domain: str) -> AsyncIterator[Program]:
    program = await Program.start(python, "with_cyclonedds", domain, CYCLONEDDS_URI=PEERS)
    yield program
    await program.end()


async def test_it_hears_what_we_publish(ours: Ours, there: Program) -> None:
    await there.do("subscription", topic="/chatter")
    publisher = ours.node.publisher(CHATTER)

    await deliver(lambda one: publisher(String(**one)), lambda: there.heard("/chatter"), TYPE, MESSAGES)


async def test_we_hear_what_it_publishes(ours: Ours, there: Program) -> None:
    got = ours.listen(CHATTER)
    await there.do("publisher", topic="/chatter")

    await deliver(lambda one: there.do("publish", topic="/chatter", message=one), lambda: got, TYPE, MESSAGES)

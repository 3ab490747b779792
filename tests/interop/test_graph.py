"""What zenoh-ros2-sdk sees of our graph, and what we see of the nodes of the SDK and of pyzeros (which cannot look at a graph)."""

from __future__ import annotations

import asyncio
from collections.abc import Awaitable, Callable
from typing import Any

import pytest

from actors import QoS, Topic
from actors.interfaces import type_hash
from actors.interfaces.example_interfaces.srv import AddTwoInts
from actors.interfaces.std_msgs.msg import Char, String
from actors.transport.format.qos import write_qos
from tests.interop.parties import PATIENCE, Ours, Program, until
from tests.interop.test_services import ADD, add

pytestmark = [pytest.mark.interop, pytest.mark.realtime]

StartProgram = Callable[[str], Awaitable[Program]]
WORDS = Topic(String, "/some/words", QoS(depth=7))
TYPE = "std_msgs/msg/String"
NODES = {"with_zenoh_ros2_sdk": "/sdk_talker", "with_pyzeros": "/third/pyzeros_node"}
every_program = pytest.mark.parametrize("program", tuple(NODES))


async def _told(there: Program, what: str, *needed: str, **whom: str) -> Any:
    """What the SDK sees of a topic or service, as soon as it sees what is needed: tokens come one by one."""
    async with asyncio.timeout(PATIENCE):
        while not (info := await there.do(what, **whom)) or not all(info[name] for name in needed):
            pass
    return info


async def _listed(there: Program, what: str, *needed: str) -> dict[str, list[str]]:
    """The topics or services that the SDK sees with their types, as soon as those that are needed are among them."""
    async with asyncio.timeout(PATIENCE):
        while not set(needed) <= (found := dict(await there.do(what))).keys():
            pass
    return found


async def test_the_sdk_sees_our_nodes_topics_and_services(ours: Ours, start: StartProgram) -> None:
    ours.node.publisher(WORDS)
    ours.listen(WORDS)
    ours.node.serve(ADD, add)
    there = await start("with_zenoh_ros2_sdk")
    seen = await _told(there, "service_info", "servers", service="/math/add")

    end = {"node_name": "robot", "node_namespace": "/ours", "gid": None}
    service = {**end, "service_type": "example_interfaces/srv/AddTwoInts", "type_hash": type_hash(AddTwoInts)}
    assert seen["servers"] == [{**service, "qos": "::,10:,:,:,,"}]
    topic = {**end, "topic_type": TYPE, "type_hash": type_hash(String), "qos": write_qos(WORDS.qos)}
    seen = await _told(there, "topic_info", "publishers", "subscribers", topic="/some/words")
    assert (seen["publishers"], seen["subscribers"]) == ([topic], [topic])
    await _listed(there, "topics", "/some/words", "/rosout", "/parameter_events")
    services = await _listed(there, "services", "/math/add", "/ours/robot/list_parameters")
    assert services["/math/add"] == ["example_interfaces/srv/AddTwoInts"]
    assert services["/ours/robot/list_parameters"] == ["rcl_interfaces/srv/ListParameters"]


async def test_what_we_close_is_gone_there(ours: Ours, start: StartProgram) -> None:
    publisher = ours.node.publisher(WORDS)
    there = await start("with_zenoh_ros2_sdk")
    await _told(there, "topic_info", "publishers", topic="/some/words")

    publisher.close()

    while await there.do("topic_info", topic="/some/words"):
        pass


@every_program
async def test_we_see_their_nodes_and_endpoints_until_they_close_or_are_killed(
    program: str, ours: Ours, start: StartProgram
) -> None:
    there, node = await start(program), NODES[program]
    profile = {"reliability": "BEST_EFFORT", "depth": 3}
    await there.do("publisher", topic="/some/words", type=TYPE, qos=profile)
    await there.do("subscription", topic="/other/words", type=TYPE, qos={})
    await there.do("server", service="/math/add", type="example_interfaces/srv/AddTwoInts", answers={})
    await until(lambda: "/math/add" in ours.services(), "the service is known")

    shown = await until(lambda: ours.publishers("/some/words"), "the publisher is known")
    assert list(shown) == [node]
    assert "best_effort" in shown[node] and "3" in shown[node]
    reads = await until(lambda: ours.subscriptions("/other/words"), "the subscription is known")
    assert ours.view("/some/words").types == (TYPE,)
    server = ours.services()["/math/add"]
    assert {node, server, *reads} <= ours.nodes()

    await there.do("close", kind="publisher", name="/some/words")
    await until(lambda: not ours.publishers("/some/words"), "the publisher has gone")
    assert list(ours.subscriptions("/other/words")) == list(reads)
    there.process.kill()
    await until(lambda: ours.nodes() == {"/ours/robot"}, "all its nodes have gone")
    assert not ours.subscriptions("/other/words") and not ours.services().get("/math/add")


# Where the SDK computes another hash, and so another key --------------------------------------------------------------------


async def test_a_type_that_the_sdk_hashes_in_its_own_way_is_said_to_be_another_one(
    ours: Ours, start: StartProgram
) -> None:
    """The SDK takes a ``char`` for that of IDL; ROS 2 takes it for ``uint8``."""
    got = ours.listen(Topic(Char, "/letters"))
    there = await start("with_zenoh_ros2_sdk")
    await there.do("publisher", topic="/letters", type="std_msgs/msg/Char", qos={})
    theirs = await there.do("type_hash", definition="char data")
    token = (await there.do("token", kind="publisher", name="/letters")).split()[0]

    (text,) = await until(lambda: ours.view("/letters").mismatches, "the mismatch is known")

    assert theirs != type_hash(Char) and type_hash(Char) not in token
    assert "/sdk_talker" in text and type_hash(Char) in text
    assert got == []

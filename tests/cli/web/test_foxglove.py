"""The Foxglove WebSocket protocol, frame by frame."""

from __future__ import annotations

import asyncio
import json
import struct
from pathlib import Path

import pytest

import robot
from actors import Child, Node, Topic
from actors.interfaces import decode, encode
from actors.interfaces.builtin_interfaces.msg import Time
from actors.interfaces.example_interfaces.srv import AddTwoInts
from actors.interfaces.rosgraph_msgs.msg import Clock
from actors.interfaces.std_msgs.msg import Int32, String
from tests.cli.web.stage import CHATTER, WAIT, Foxglove, Stage, serving, until


async def subscribed(stage: Stage, client: Foxglove, topic: str, id: int) -> None:
    channel = await client.channel(topic)
    await client.say("subscribe", subscriptions=[{"id": id, "channelId": channel["id"]}])
    entry = stage.system.graph.topics[topic]
    await until(lambda: any(end.node.fqn == "/_web" for end in entry.subscriptions))


@pytest.mark.parametrize("name", ["foxglove.sdk.v1", "foxglove.websocket.v1"])
async def test_both_names_of_the_protocol_are_spoken(name: str) -> None:
    async with serving() as stage, stage.foxglove(name) as client:
        assert client.socket.subprotocol == name
        hello = await client.next()
        assert hello["op"] == "serverInfo" and "clientPublish" in hello["capabilities"]
        channel = await client.channel("/chatter")
        assert channel == {
            "id": channel["id"], "topic": "/chatter", "encoding": "cdr", "schemaName": "std_msgs/msg/String",
            "schema": "string data\n", "schemaEncoding": "ros2msg",
        }  # fmt: skip


async def test_messages_come_with_the_clients_number_the_time_and_the_cdr_of_the_message() -> None:
    async with serving() as stage, stage.foxglove() as client:
        await subscribed(stage, client, "/chatter", 77)
        before = stage.system.clock.wall_ns()
        stage.talker.chatter(String(data="hallo"))
        frame = await client.binary()
        op, id, at = struct.unpack_from("<BIQ", frame)
        assert (op, id) == (1, 77)
        assert before <= at <= stage.system.clock.wall_ns()
        assert frame[13:] == b"\0\1\0\0" + struct.pack("<I", 6) + b"hallo\0"


async def test_a_late_subscription_gets_what_a_latched_topic_keeps_also_the_second_one() -> None:
    async with serving() as stage:
        stage.talker.latched(String(data="map"))
        async with stage.foxglove() as first, stage.foxglove() as second:
            for client in (first, second):
                channel = await client.channel("/latched")
                await client.say("subscribe", subscriptions=[{"id": 1, "channelId": channel["id"]}])
                assert decode(String, (await client.binary())[13:]).data == "map"


async def test_after_unsubscribing_nothing_comes_and_the_server_leaves_the_topic() -> None:
    async with serving() as stage, stage.foxglove() as client:
        await subscribed(stage, client, "/chatter", 1)
        await client.say("unsubscribe", subscriptionIds=[1])
        await until(lambda: not stage.system.graph.topics["/chatter"].subscriptions)


@pytest.mark.parametrize(
    ("encoding", "payload"), [("cdr", encode(String(data="up"))), ("json", b'{"data": "up"}')], ids=["cdr", "json"]
)
async def test_what_a_client_publishes_reaches_the_nodes(encoding: str, payload: bytes) -> None:
    async with serving() as stage, stage.foxglove() as client:
        async with stage.talker.subscribe(CHATTER) as messages:
            channel = {"id": 5, "topic": "/chatter", "encoding": encoding, "schemaName": "std_msgs/msg/String"}
            await client.say("advertise", channels=[channel])
            await client.socket.send(b"\x01" + struct.pack("<I", 5) + payload)
            assert (await messages.next(timeout=10)).data == "up"


async def test_what_clients_publish_alike_has_one_publisher_which_ends_with_the_last_of_them() -> None:
    channel = {"id": 5, "topic": "/new", "encoding": "cdr", "schemaName": "std_msgs/msg/String"}
    async with serving() as stage:
        entry = stage.system.graph.topic("/new")
        async with stage.foxglove() as first:
            async with stage.foxglove() as second:
                for client in (first, second):
                    await client.say("advertise", channels=[channel])
                    await client.say("getParameters", parameterNames=[], id="done")
                    await client.find("parameterValues", id="done")
                assert len(entry.publishers) == 1
            await until(lambda: len(stage.server.clients) == 1)
            assert len(entry.publishers) == 1
        await until(lambda: not entry.publishers)


async def test_a_channel_whose_topic_cannot_be_is_refused_with_its_name() -> None:
    async with serving() as stage, stage.foxglove() as client:
        await client.say(
            "advertise",
            channels=[{"id": 5, "topic": "/no topic", "encoding": "cdr", "schemaName": "std_msgs/msg/String"}],
        )
        assert "/no topic" in (await client.find("status", level=2))["message"]


async def test_a_service_answers_in_the_encoding_of_the_request() -> None:
    async with serving() as stage, stage.foxglove() as client:
        service = await client.service("/add")
        assert service["request"]["schema"] == "int64 a\nint64 b\n"
        for encoding, payload in (("cdr", encode(AddTwoInts.Request(a=2, b=40))), ("json", b'{"a": 2, "b": 40}')):
            head = b"\x02" + struct.pack("<III", service["id"], 9, len(encoding)) + encoding.encode()
            await client.socket.send(head + payload)
            frame = await client.binary()
            assert struct.unpack_from("<BIII", frame) == (3, service["id"], 9, len(encoding))
            body = frame[13 + len(encoding) :]
            total = decode(AddTwoInts.Response, body).sum if encoding == "cdr" else json.loads(body)["sum"]
            assert total == 42


async def test_a_call_that_fails_says_why() -> None:
    async with serving() as stage, stage.foxglove() as client:
        service = await client.service("/add")
        request = encode(AddTwoInts.Request(a=13, b=0))
        await client.socket.send(b"\x02" + struct.pack("<III", service["id"], 4, 3) + b"cdr" + request)
        failure = await client.find("serviceCallFailure")
        assert (failure["serviceId"], failure["callId"]) == (service["id"], 4)
        assert "13 is not added" in failure["message"]


async def test_parameters_are_read_set_and_refused_with_the_reason() -> None:
    async with serving() as stage, stage.foxglove() as client:
        await client.say("getParameters", parameterNames=[], id="all")
        values = {one["name"]: one for one in (await client.find("parameterValues", id="all"))["parameters"]}
        assert values["/talker.speed"] == {"name": "/talker.speed", "value": 0.5, "type": "float64"}
        assert values["/talker.gains"] == {"name": "/talker.gains", "value": [1.0, 2.0], "type": "float64_array"}
        assert values["/talker.label"] == {"name": "/talker.label", "value": "red"}
        await client.say("setParameters", parameters=[{"name": "/talker.speed", "value": 2}], id="set")
        assert (await client.find("parameterValues", id="set"))["parameters"][0]["value"] == 2.0
        assert stage.talker.speed == 2.0
        await client.say("setParameters", parameters=[{"name": "/talker.speed", "value": 9.0}], id="far")
        status = await client.find("status", id="far")
        assert status["level"] == 2 and "out of range 0.0..2.0" in status["message"]
        assert (await client.find("parameterValues", id="far"))["parameters"][0]["value"] == 2.0


async def test_a_client_hears_of_changes_of_the_parameters_it_watches_and_of_no_others() -> None:
    async with serving() as stage, stage.foxglove() as client:
        await client.say("subscribeParameterUpdates", parameterNames=["/talker.count"])
        await client.say("getParameters", parameterNames=["/talker.count"], id="there")
        await client.find("parameterValues", id="there")
        stage.talker.set_parameter("label", "blue")
        stage.talker.set_parameter("count", 4)
        heard = await client.find("parameterValues")
        assert heard["parameters"] == [{"name": "/talker.count", "value": 4}]


async def test_the_connection_graph_comes_whole_and_then_as_differences() -> None:
    async with serving() as stage, stage.foxglove() as client:
        await client.say("subscribeConnectionGraph")
        whole = await client.find("connectionGraphUpdate")
        assert {"name": "/chatter", "publisherIds": ["/talker"]} in whole["publishedTopics"]
        assert {"name": "/add", "providerIds": ["/worker"]} in whole["advertisedServices"]
        async with stage.system.node("worker").subscribe(CHATTER):
            update = await client.find("connectionGraphUpdate")
            assert update["subscribedTopics"] == [{"name": "/chatter", "subscriberIds": ["/worker"]}]
            assert update["publishedTopics"] == []


async def test_an_asset_is_a_file_of_a_package_and_nothing_else_is(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    share = tmp_path / "share" / "meshes_of_mine"
    share.mkdir(parents=True)
    (share / "leg.stl").write_bytes(b"solid leg")
    (share / "key.pem").write_text("secret")
    (tmp_path / "share" / "outside.stl").write_text("outside")
    (share / "link.stl").symlink_to(tmp_path / "share" / "outside.stl")
    monkeypatch.setenv("AMENT_PREFIX_PATH", str(tmp_path))
    assert robot.__file__  # the package exists, and its sources are not given out either
    refused = (
        "package://meshes_of_mine/key.pem", "package://meshes_of_mine/../outside.stl", "package://meshes_of_mine/%2e%2e/outside.stl",
        "package://meshes_of_mine/link.stl", "package://robot/__init__.py", "file:///etc/passwd", "package://../leg.stl", "package://", 7,
    )  # fmt: skip
    async with serving() as stage, stage.foxglove() as client:
        await client.say("fetchAsset", uri="package://meshes_of_mine/leg.stl", requestId=3)
        assert await client.binary() == b"\x04" + struct.pack("<IBI", 3, 0, 0) + b"solid leg"
        for uri in refused:
            await client.say("fetchAsset", uri=uri, requestId=4)
            frame = await client.binary()
            assert struct.unpack_from("<BIB", frame) == (4, 4, 1), uri


async def test_channels_and_services_come_and_go_with_the_nodes() -> None:
    async with serving() as stage, stage.foxglove() as client:
        async with stage.rosbridge() as other:
            await other.say("advertise", topic="/news", type="std_msgs/msg/Int32")
            channel = await client.channel("/news")
            assert channel["schemaName"] == "std_msgs/msg/Int32"
        gone = await client.find("unadvertise")
        assert gone["channelIds"] == [channel["id"]]


async def test_the_state_of_the_system_is_told_to_those_who_ask() -> None:
    async with serving() as stage, stage.foxglove() as client:
        await client.say("robactor.subscribeSystem")
        state = await client.find("robactor.system")
        nodes = {one["name"]: one for one in state["nodes"]}
        assert (nodes["/talker"]["path"], nodes["/talker"]["state"]) == ("tree/talker", "running")
        assert state["canKill"] is True and state["restarts"]["/talker"] == 0
        await client.say("robactor.killNode", node="/talker", id=8)
        assert await client.find("robactor.done") == {"op": "robactor.done", "id": 8, "error": None}
        while {one["name"]: one["incarnation"] for one in (await client.find("robactor.system"))["nodes"]}[
            "/talker"
        ] < 2:
            pass
        await client.say("robactor.killNode", node="/nobody", id=9)
        assert "nobody" in (await client.find("robactor.done"))["error"]


async def test_a_parameter_of_bytes_travels_in_base64() -> None:
    async with serving() as stage, stage.foxglove() as client:
        await client.say("setParameters", parameters=[{"name": "/talker.code", "value": "AP8="}], id="set")
        values = (await client.find("parameterValues", id="set"))["parameters"]
        assert values == [{"name": "/talker.code", "value": "AP8=", "type": "byte_array"}]
        assert stage.talker.code == (b"\x00", b"\xff")


async def test_the_time_is_that_of_the_clock_topic_while_there_is_one_and_the_viewers_own_else() -> None:
    async with serving() as stage, stage.foxglove() as client:
        assert "time" not in (await client.find("serverInfo"))["capabilities"]
        simulation = await stage.system.join(Child(Node, name="simulation"))
        clock = simulation.node.publisher(Topic(Clock, "/clock"))
        assert "time" in (await client.find("serverInfo"))["capabilities"]
        await until(lambda: any(end.node.fqn == "/_web" for end in stage.system.graph.topics["/clock"].subscriptions))
        clock.publish(Clock(clock=Time(sec=7, nanosec=8)))
        assert struct.unpack("<BQ", await client.binary()) == (2, 7_000_000_008)

        async with stage.foxglove() as later:
            assert "time" in (await later.find("serverInfo"))["capabilities"]
        await stage.system.leave(simulation)
        assert "time" not in (await client.find("serverInfo"))["capabilities"]


async def test_what_the_doctor_finds_is_told_as_it_arises_and_no_more_when_nobody_asks(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr("cli.web.server.audience.LOOK_EVERY", 0.1)
    async with serving() as stage, stage.foxglove() as client:
        await client.say("robactor.subscribeFindings")
        assert (await client.find("robactor.findings"))["findings"] == []
        listener = await stage.system.join(Child(Node, name="listener"))
        async with listener.node.subscribe(Topic(Int32, "/chatter")), asyncio.timeout(WAIT):
            while not (findings := (await client.find("robactor.findings"))["findings"]):
                pass
        assert [(one["level"], one["check"], one["subject"]) for one in findings] == [
            ("problem", "types of topics", "/chatter")
        ]
        assert findings[0]["remedy"] == "give one of them another name"
        figures = stage.system.graph.topics["/_robactor/figures"]
        assert len(figures.subscriptions) == 1, "other processes tell their figures"
        await client.say("robactor.unsubscribeFindings")
        await until(lambda: not figures.subscriptions)

"""The rosbridge protocol, frame by frame."""

from __future__ import annotations

import asyncio
import base64
import json
import math
import zlib
from typing import Any

import numpy as np
import pytest

from actors import Action, GoalAborted, Service, ServiceFailed, Topic
from actors.interfaces import encode
from actors.interfaces.example_interfaces.action import Fibonacci
from actors.interfaces.example_interfaces.srv import AddTwoInts
from actors.interfaces.sensor_msgs.msg import Image, LaserScan
from actors.interfaces.std_msgs.msg import Int64, String
from actors.logs import ERROR, LogRecord
from tests.cli.web.stage import ADD, CHATTER, Bridge, Stage, serving, until


async def reading(stage: Stage, client: Bridge, topic: str = "/chatter", **more: Any) -> None:
    """Subscribe, and wait until the server has done so."""
    await client.say("subscribe", topic=topic, **more)
    await client.call("/rosapi/get_time")


async def test_messages_are_sent_and_received_with_types_in_two_or_three_parts() -> None:
    async with serving() as stage, stage.rosbridge() as client:
        for number, kind in enumerate(("std_msgs/String", "std_msgs/msg/String")):
            topic = f"/words{number}"
            await client.say("advertise", topic=topic, type=kind)
            await reading(stage, client, topic, type=kind)
            await client.say("publish", topic=topic, msg={"data": "hi"})
            assert await client.find("publish") == {"op": "publish", "topic": topic, "msg": {"data": "hi"}}


async def test_numbers_that_json_lacks_are_null_and_bytes_are_base64() -> None:
    async with serving() as stage, stage.rosbridge() as client:
        node = stage.talker
        scans, images = node.publisher(Topic(LaserScan, "/scan")), node.publisher(Topic(Image, "/image"))
        await reading(stage, client, "/scan")
        await reading(stage, client, "/image")
        scans(LaserScan(ranges=[1.5, math.inf, math.nan], range_max=-math.inf))
        scan = (await client.find("publish", topic="/scan"))["msg"]
        assert (scan["ranges"], scan["range_max"]) == ([1.5, None, None], None)
        images(Image(width=2, height=1, data=np.array([0, 255], np.uint8)))
        assert (await client.find("publish", topic="/image"))["msg"]["data"] == "AP8="
        async with stage.system.node("worker").subscribe(Topic(Image, "/image")) as seen:
            for data in ("AP8=", [0, 255]):
                await client.say("publish", topic="/image", msg={"data": data})
                assert (await seen.next(timeout=10)).data.tolist() == [0, 255]
        async with stage.system.node("worker").subscribe(Topic(LaserScan, "/scan")) as seen_scans:
            await client.socket.send('{"op": "publish", "topic": "/scan", "msg": {"ranges": [null, NaN, 2]}}')
            ranges = (await seen_scans.next(timeout=10)).ranges.tolist()
            assert math.isnan(ranges[0]) and math.isnan(ranges[1]) and ranges[2] == 2.0


async def test_whole_numbers_of_64_bits_are_exact_both_ways() -> None:
    async with serving() as stage, stage.rosbridge() as client:
        out = stage.talker.publisher(Topic(Int64, "/big"))
        await reading(stage, client, "/big")
        for number in (2**63 - 1, -(2**63), 2**53 + 1):
            out(Int64(data=number))
            assert (await client.find("publish"))["msg"] == {"data": number}
        async with stage.system.node("worker").subscribe(Topic(Int64, "/big")) as seen:
            await client.say("publish", topic="/big", msg={"data": 2**63 - 1})
            assert (await seen.next(timeout=10)).data == 2**63 - 1


async def test_a_header_without_a_stamp_gets_the_present_time_and_one_with_a_stamp_keeps_it() -> None:
    async with serving() as stage, stage.rosbridge() as client:
        topic = Topic(LaserScan, "/scan")
        await client.say("advertise", topic="/scan", type="sensor_msgs/LaserScan")
        await client.call("/rosapi/get_time")
        async with stage.talker.subscribe(topic) as scans:
            before = stage.system.clock.wall_ns() // 10**9
            await client.say("publish", topic="/scan", msg={"header": {"frame_id": "lidar"}})
            scan = await scans.next(timeout=10)
            assert scan.header.frame_id == "lidar" and scan.header.stamp.sec >= before
            await client.say("publish", topic="/scan", msg={"header": {"stamp": {"sec": 7}}})
            assert (await scans.next(timeout=10)).header.stamp.sec == 7


async def test_a_message_with_a_field_that_its_type_lacks_is_refused_by_name() -> None:
    async with serving() as stage, stage.rosbridge() as client:
        await client.say("publish", id="wrong", topic="/chatter", msg={"dta": "x"})
        status = await client.find("status")
        assert (status["level"], status["id"]) == ("error", "wrong")
        assert "no field 'dta'" in status["msg"]


async def test_a_service_answers_and_fails_with_the_text_of_the_error() -> None:
    async with serving() as stage, stage.rosbridge() as client:
        answer = await client.call("add", {"a": 2**62, "b": 1})
        assert (answer["result"], answer["values"]) == (True, {"sum": 2**62 + 1})
        assert (await client.call("/add", [4, 5]))["values"] == {"sum": 9}
        answer = await client.call("/add", {"a": 13, "b": 1})
        assert answer["result"] is False and "13 is not added" in answer["values"]
        answer = await client.call("/nothing_here")
        assert answer["result"] is False and "nobody serves" in answer["values"]


async def test_a_service_of_the_browser_is_called_by_a_node() -> None:
    async with serving() as stage, stage.rosbridge() as client:
        double = Service(AddTwoInts, "/browser_add")
        await client.say("advertise_service", service="/browser_add", type="example_interfaces/AddTwoInts")
        await client.call("/rosapi/get_time")
        call = stage.talker.create_task(_call(stage, double, AddTwoInts.Request(a=4, b=5)), name="caller")
        request = await client.find("call_service")
        assert (request["service"], request["args"]) == ("/browser_add", {"a": 4, "b": 5})
        await client.say("service_response", id=request["id"], service="/browser_add", values={"sum": 9}, result=True)
        await call
        assert stage.answer.sum == 9  # type: ignore[attr-defined]
        await client.say("unadvertise_service", service="/browser_add")
        await until(lambda: "/browser_add" not in _served(stage))


async def _call(stage: Any, service: Any, request: Any) -> None:
    stage.answer = await stage.talker.call(service, request, timeout=10)


def _served(stage: Stage) -> list[str]:
    return [name for name, entry in stage.system.graph.services.items() if entry.server is not None]


async def test_what_a_client_serves_ends_with_it_even_without_a_farewell() -> None:
    async with serving() as stage:
        async with stage.rosbridge() as client:
            await client.say("advertise_service", service="/browser_add", type="example_interfaces/AddTwoInts")
            await client.say("advertise_action", action="/browser_count", type="example_interfaces/Fibonacci")
            await client.say("subscribe", topic="/chatter")
            await client.call("/rosapi/get_time")
            assert "/browser_add" in _served(stage) and "/browser_count" in stage.system.graph.actions
            client.socket.transport.abort()
        await until(lambda: "/browser_add" not in _served(stage) and "/browser_count" not in stage.system.graph.actions)
        await until(lambda: not stage.system.graph.topics["/chatter"].subscriptions)
        assert not [path for path in stage.system.nodes if "_web_client" in path[-1]]


async def test_a_goal_gives_feedback_and_a_result() -> None:
    async with serving() as stage, stage.rosbridge() as client:
        goal = {"action": "/count", "action_type": "example_interfaces/action/Fibonacci", "args": {"order": 3}}
        await client.say("send_action_goal", id="g1", feedback=True, **goal)
        assert (await client.find("action_feedback", id="g1"))["values"] == {"sequence": [0, 1, 1]}
        result = await client.find("action_result", id="g1")
        assert (result["values"], result["status"], result["result"]) == ({"sequence": [0, 1, 1, 2]}, 4, True)


async def test_a_goal_is_canceled() -> None:
    async with serving() as stage, stage.rosbridge() as client:
        await client.say("send_action_goal", id="g1", action="/count", feedback=True, args={"order": 99})
        await client.find("action_feedback")
        await client.say("cancel_action_goal", id="g1", action="/count")
        assert (await client.find("action_result", id="g1"))["status"] == 5


async def test_a_goal_that_is_canceled_before_it_is_accepted_is_canceled_once_it_is() -> None:
    async with serving() as stage, stage.rosbridge() as client:
        for id in ("g1", "g2", "g3"):  # at once, so that no handle is there yet
            await client.say("send_action_goal", id=id, action="/count", args={"order": 99})
            await client.say("cancel_action_goal", id=id, action="/count")
            assert (await client.find("action_result", id=id))["status"] == 5
        assert not [one for one in client.frames if one["op"] == "status"]


async def test_a_goal_that_nobody_accepts_cannot_be_canceled() -> None:
    async with serving() as stage, stage.rosbridge() as client:
        goal = {"action": "/nowhere", "action_type": "example_interfaces/action/Fibonacci", "timeout": 0.2}
        await client.say("send_action_goal", id="g", args={"order": 2}, **goal)
        await client.say("cancel_action_goal", id="g", action="/nowhere")
        assert "goal g was not accepted" in (await client.find("status"))["msg"]
        assert (await client.find("action_result", id="g"))["result"] is False


async def test_a_topic_of_another_type_is_refused_with_the_type_that_it_has() -> None:
    async with serving() as stage, stage.rosbridge() as client:
        for op in ("subscribe", "advertise"):
            await client.say(op, topic="/chatter", type="std_msgs/Int32", id=op)
            said = await client.find("status", id=op)
            assert said["level"] == "error"
            assert said["msg"] == "/chatter has the type std_msgs/msg/String, not std_msgs/msg/Int32"


@pytest.mark.parametrize(
    ("stamp", "seconds", "nanoseconds"),
    [({"secs": 5, "nsecs": 7}, 5, 7), ({"sec": 5, "nanosec": 7}, 5, 7), ({"secs": 5}, 5, 0), ("now", None, None)],
)
async def test_a_time_is_now_or_has_the_names_of_ros_1(
    stamp: Any, seconds: int | None, nanoseconds: int | None
) -> None:
    async with serving() as stage, stage.rosbridge() as client:
        await client.say("subscribe", topic="/poses", type="geometry_msgs/PoseStamped")
        await client.say("advertise", topic="/poses", type="geometry_msgs/PoseStamped")
        await client.call("/rosapi/get_time")
        before = stage.system.clock.stamp().sec
        await client.say("publish", topic="/poses", msg={"header": {"stamp": stamp, "frame_id": "map"}})
        told = (await client.find("publish"))["msg"]["header"]
    assert told["frame_id"] == "map"
    if seconds is None:
        assert before <= told["stamp"]["sec"] <= before + 10
    else:
        assert told["stamp"] == {"sec": seconds, "nanosec": nanoseconds}


async def test_two_goals_of_one_id_are_not_confused() -> None:
    async with serving() as stage, stage.rosbridge() as client:
        for _ in range(2):
            await client.say("send_action_goal", id="g1", action="/count", args={"order": 3})
        refused, done = (
            await client.find("action_result", result=False),
            await client.find("action_result", result=True),
        )
        assert "runs already" in refused["values"] and done["values"] == {"sequence": [0, 1, 1, 2]}
        assert (await client.call("/add", [1, 1]))["values"] == {"sum": 2}


async def test_a_goal_of_a_client_that_goes_is_canceled() -> None:
    async with serving() as stage:
        async with stage.rosbridge() as client:
            await client.say("send_action_goal", id="g1", action="/count", feedback=True, args={"order": 99})
            await client.find("action_feedback")
            server: Any = stage.system.graph.actions["/count"].server
            assert server.active == 1
        await until(lambda: server.active == 0)


async def test_the_browser_carries_out_a_goal() -> None:
    async with serving() as stage, stage.rosbridge() as client:
        await client.say("advertise_action", action="/browser_count", type="example_interfaces/Fibonacci")
        await client.call("/rosapi/get_time")
        action = Action(Fibonacci, "/browser_count")
        async with stage.talker.send_goal(action, Fibonacci.Goal(order=2)) as goal:
            request = await client.find("send_action_goal")
            assert (request["action"], request["args"]) == ("/browser_count", {"order": 2})
            told = {"id": request["id"], "action": "/browser_count"}
            await client.say("action_feedback", values={"sequence": [0, 1]}, **told)
            assert (await anext(aiter(goal))).sequence.tolist() == [0, 1]
            await client.say("action_result", values={"sequence": [0, 1, 1]}, status=4, result=True, **told)
            assert (await goal).sequence.tolist() == [0, 1, 1]


async def test_the_browser_is_asked_to_cancel_a_goal() -> None:
    async with serving() as stage, stage.rosbridge() as client:
        await client.say("advertise_action", action="/browser_count", type="example_interfaces/Fibonacci")
        await client.call("/rosapi/get_time")
        goal = stage.talker.send_goal(Action(Fibonacci, "/browser_count"), Fibonacci.Goal(order=2))
        await goal.send()
        request = await client.find("send_action_goal")
        assert await goal.cancel()
        canceled = await client.find("cancel_action_goal")
        assert canceled["id"] == request["id"]
        await client.say("action_result", id=request["id"], action="/browser_count", values={}, status=5, result=True)
        assert (await goal.ended()).status == 5


async def test_what_the_browser_serves_no_more_fails_at_once_and_the_connection_goes_on() -> None:
    """It used to stand still until the nodes that serve it were given up: they waited for answers that were not read meanwhile."""
    add, count = Service(AddTwoInts, "/browser_add"), Action(Fibonacci, "/browser_count")
    async with serving() as stage, stage.rosbridge() as client:
        await client.say("advertise_service", service=add.name, type="example_interfaces/AddTwoInts")
        await client.say("advertise_action", action=count.name, type="example_interfaces/Fibonacci")
        await client.call("/rosapi/get_time")
        goal = stage.talker.send_goal(count, Fibonacci.Goal(order=2))
        await goal.send()
        await client.find("send_action_goal")
        call = asyncio.ensure_future(stage.talker.call(add, AddTwoInts.Request(a=4, b=5), timeout=10))
        await client.find("call_service")
        await client.say("unadvertise_service", service=add.name)
        await client.say("unadvertise_action", action=count.name)
        await client.call("/rosapi/get_time")
        with pytest.raises(ServiceFailed, match="the client serves /browser_add no more"):
            await call
        with pytest.raises(GoalAborted, match="the client serves /browser_count no more"):
            await goal


async def test_of_two_clients_that_serve_the_same_at_the_same_time_the_second_is_refused_by_name() -> None:
    """Its node used to be started, and to fail with an error in the log."""
    records: list[LogRecord] = []
    async with serving() as stage, stage.rosbridge() as first, stage.rosbridge() as second:
        stage.system.observe(lines=records.append)
        asked = [
            {"op": "advertise_service", "service": "/browser_add", "type": "example_interfaces/AddTwoInts"},
            {"op": "advertise_action", "action": "/browser_count", "type": "example_interfaces/Fibonacci"},
        ]
        for one in asked:
            await asyncio.gather(*(client.socket.send(json.dumps(one)) for client in (first, second)))
        for client in (first, second):
            await client.call("/rosapi/get_time")
        refused = [frame["msg"] for client in (first, second) for frame in client.frames if frame["op"] == "status"]
    assert sorted(one.split(" ", 1)[1] for one in refused) == [
        "serves /browser_add already",
        "serves /browser_count already",
    ]
    assert not [record for record in records if record.level >= ERROR]


async def test_fragments_are_put_together_and_long_answers_are_cut_as_asked() -> None:
    async with serving() as stage, stage.rosbridge() as client:
        whole = json.dumps({"op": "call_service", "id": "f", "service": "/rosapi/interfaces", "fragment_size": 500})
        parts = [whole[begin : begin + 20] for begin in range(0, len(whole), 20)]
        for index in reversed(range(len(parts))):
            await client.say("fragment", id="x", data=parts[index], num=index, total=len(parts))
        first = await client.find("fragment")
        pieces = [first] + [await client.find("fragment") for _ in range(first["total"] - 1)]
        assert len(pieces) > 3 and all(len(piece["data"]) <= 500 for piece in pieces)
        answer = json.loads("".join(piece["data"] for piece in sorted(pieces, key=lambda piece: piece["num"])))
        assert "std_msgs/msg/String" in answer["values"]["interfaces"]


async def test_a_message_comes_as_a_picture_whose_pixels_are_its_text() -> None:
    async with serving() as stage, stage.rosbridge() as client:
        await reading(stage, client, compression="png")
        stage.talker.chatter(String(data="hallo"))
        data = base64.b64decode((await client.find("png"))["data"])
        assert json.loads(pixels(data)) == {"op": "publish", "topic": "/chatter", "msg": {"data": "hallo"}}


async def test_a_picture_that_too_many_requests_keep_from_being_made_is_counted_as_dropped(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    async with serving() as stage, stage.rosbridge() as client:
        await reading(stage, client, compression="png")
        await client.say("send_action_goal", id="g1", action="/count", feedback=True, args={"order": 99})
        await client.find("action_feedback")
        (one,) = stage.server.clients
        with monkeypatch.context() as few:
            few.setattr("cli.web.clients.client.MOST_TASKS", 1)
            stage.talker.chatter(String(data="lost"))
            await until(lambda: one.outbox.dropped)
            assert one.outbox.dropped == 1
        stage.talker.chatter(String(data="shown"))
        data = base64.b64decode((await client.find("png"))["data"])
        assert json.loads(pixels(data))["msg"] == {"data": "shown"}
        assert one.outbox.dropped == 1


def pixels(picture: bytes) -> bytes:
    """The bytes of all pixels, by the description of the format: signature, then chunks of length, kind, data and checksum."""
    assert picture[:8] == b"\x89PNG\r\n\x1a\n"
    chunks: dict[bytes, bytes] = {}
    rest = picture[8:]
    while rest:
        length = int.from_bytes(rest[:4])
        assert zlib.crc32(rest[4 : 8 + length]) == int.from_bytes(rest[8 + length : 12 + length])
        chunks[rest[4:8]] = rest[8 : 8 + length]
        rest = rest[12 + length :]
    width, height = int.from_bytes(chunks[b"IHDR"][:4]), int.from_bytes(chunks[b"IHDR"][4:8])
    rows = zlib.decompress(chunks[b"IDAT"])
    assert len(rows) == height * (width * 3 + 1)
    return b"".join(rows[row * (width * 3 + 1) + 1 : (row + 1) * (width * 3 + 1)] for row in range(height))


async def test_messages_come_in_cbor_with_typed_arrays() -> None:
    async with serving() as stage, stage.rosbridge() as client:
        out = stage.talker.publisher(Topic(LaserScan, "/scan"))
        await reading(stage, client, "/scan", compression="cbor")
        out(LaserScan(ranges=[1.0, math.inf], angle_min=-0.5))
        frame = await client.binary()
        assert frame.startswith(b"\xa3\x62op\x67publish\x65topic\x65/scan\x63msg\xaa")
        ranges = np.array([1.0, math.inf], "<f4").tobytes()
        assert b"\x66ranges\xd8\x55\x48" + ranges in frame  # tag 85, a byte string of 8
        assert b"\x69angle_min\xfb" + np.array(-0.5, ">f8").tobytes() in frame


async def test_raw_messages_are_the_cdr_in_cbor() -> None:
    async with serving() as stage, stage.rosbridge() as client:
        await reading(stage, client, compression="cbor-raw")
        stage.talker.chatter(String(data="hallo"))
        frame = await client.binary()
        payload = encode(String(data="hallo"))
        assert frame.endswith(b"\x65bytes" + bytes([0x40 | len(payload)]) + payload)
        assert b"\x64secs\x1a" in frame


async def test_a_throttled_subscription_keeps_its_pause_and_the_newest_messages_of_its_queue() -> None:
    async with serving() as stage, stage.rosbridge() as client:
        await reading(stage, client, throttle_rate=60, queue_length=2)
        for number in range(6):
            stage.talker.chatter(String(data=str(number)))
        seen = [(await client.find("publish"))["msg"]["data"] for _ in range(3)]
        assert seen == ["0", "4", "5"]


@pytest.mark.parametrize(("queue", "dropped"), [(0, 2), (1, 1)])
async def test_what_comes_too_early_is_counted_as_dropped_but_for_the_newest_that_a_queue_holds(
    queue: int, dropped: int
) -> None:
    async with serving() as stage, stage.rosbridge() as client:
        await reading(stage, client, throttle_rate=3_600_000, queue_length=queue)
        for number in range(3):
            stage.talker.chatter(String(data=str(number)))
        assert (await client.find("publish"))["msg"]["data"] == "0"
        assert [one.outbox.dropped for one in stage.server.clients] == [dropped]


async def test_several_ids_of_one_topic_have_one_stream_by_the_shortest_pause() -> None:
    async with serving() as stage, stage.rosbridge() as client:
        await reading(stage, client, id="slow", throttle_rate=3_600_000, queue_length=1)
        await reading(stage, client, id="quick", throttle_rate=0, queue_length=0)
        for word in ("a", "b"):
            stage.talker.chatter(String(data=word))
            assert (await client.find("publish"))["msg"]["data"] == word
        await client.say("unsubscribe", id="quick", topic="/chatter")
        await client.call("/rosapi/get_time")
        stage.talker.chatter(String(data="c"))
        assert stage.system.graph.topics["/chatter"].subscriptions
        await client.say("unsubscribe", topic="/chatter")
        await until(lambda: not stage.system.graph.topics["/chatter"].subscriptions)
        await client.call("/rosapi/get_time")
        assert not [frame for frame in client.frames if frame["op"] == "publish"]


async def test_a_latched_message_waits_for_those_who_come_later() -> None:
    async with serving() as stage, stage.rosbridge() as client:
        await client.say("advertise", topic="/late", type="std_msgs/String", latch=True)
        await client.say("publish", topic="/late", msg={"data": "kept"})
        await reading(stage, client, "/late")
        assert (await client.find("publish"))["msg"] == {"data": "kept"}


@pytest.mark.parametrize(
    ("level", "told"), [("none", False), ("error", True), ("info", True)], ids=["none", "error", "info"]
)
async def test_a_client_chooses_what_it_is_told_of_its_mistakes(level: str, told: bool) -> None:
    async with serving() as stage, stage.rosbridge() as client:
        await client.say("set_level", level=level)
        await client.say("unsubscribe", topic="/never")
        await client.call("/rosapi/get_time")
        assert any(frame["op"] == "status" for frame in client.frames) is told


async def test_a_message_of_ours_reaches_a_service_beside_a_slow_call() -> None:
    async with serving() as stage, stage.rosbridge() as client:
        await client.say("send_action_goal", id="g", action="/count", args={"order": 99})
        assert (await client.call(ADD.name, {"a": 1, "b": 1}))["values"] == {"sum": 2}
        async with stage.system.node("worker").subscribe(CHATTER) as words:
            await client.say("publish", topic="/chatter", msg={"data": "on"})
            assert (await words.next(timeout=10)).data == "on"

"""Recorded traffic of `rmw_zenoh`, played back by plain eclipse-zenoh: we understand it, and what we send is the same byte for byte.

A token contains the session's identity and numbers of its own; these are put in place of those of the record before the two are compared.
"""

from __future__ import annotations

import json
import sys
from collections.abc import AsyncIterator, Awaitable, Callable
from pathlib import Path
from typing import Any

import pytest
import pytest_asyncio

from actors import QoS, Service, Topic
from actors.interfaces.example_interfaces.srv import AddTwoInts
from actors.interfaces.std_msgs.msg import String
from actors.qos import Durability, Reliability
from tests.interop.parties import Ours, Program, until

pytestmark = [pytest.mark.interop, pytest.mark.realtime]

RECORD = json.loads(
    (Path(__file__).parents[1] / "conformance" / "vectors" / "rmw_zenoh_captures.json").read_text(encoding="utf-8")
)
PEER, HISTORY, REFERENCE, PUBLISHED = (
    RECORD[name]
    for name in ("a_sdk_capture", "b_transient_local_capture", "c_reference_vectors", "d_published_examples")
)
TALKER_SESSION = PEER["liveliness_put"][4].split("/")[2]
CHATTER = Topic(String, "/chatter")
ADD = Service(AddTwoInts, "/add_two_ints")
StartRaw = Callable[[str], Awaitable[Program]]


@pytest_asyncio.fixture
async def start_raw(ours: Ours) -> AsyncIterator[StartRaw]:
    """Starts a plain session with a given identity."""
    started: list[Program] = []

    async def one(session: str) -> Program:
        started.append(await Program.start(sys.executable, "raw_zenoh", ours.port, session))
        await started[-1].do("watch", keys="@ros2_lv/**")
        await started[-1].until("appeared")  # our node is seen, so the two are connected
        return started[-1]

    yield one
    for program in started:
        await program.end()


def appeared(there: Program, kind: str, name: str) -> str | None:
    """The token of an endpoint of ours, as the other side has seen it."""
    mangled = name.replace("/", "%")
    tokens = [line["token"] for line in there.said("appeared")]
    found = [token for token in tokens if f"/{kind}/" in token and f"/{mangled}/" in token]
    return found[-1] if found else None


def as_of(recorded: str, seen: str) -> str:
    """A recorded token with the domain, session and numbers of `seen`."""
    parts, other = recorded.split("/"), seen.split("/")
    parts[1:5] = other[1:5]
    return "/".join(parts)


def with_own_node(recorded: str, number: int) -> str:
    """A recorded token with another number of its node: the records give one number to several nodes, which no process does."""
    parts = recorded.split("/")
    parts[4] = parts[3] = str(number)
    return "/".join(parts)


def gid_in(attachment: str) -> str:
    return attachment[34:66]


# We understand it -----------------------------------------------------------------------------------------------------------


async def test_the_tokens_of_a_peer_make_its_nodes_and_endpoints_known_until_they_are_withdrawn(
    ours: Ours, start_raw: StartRaw
) -> None:
    there = await start_raw(TALKER_SESSION)
    for token in PEER["liveliness_put"]:
        await there.do("announce", token=token)
    nodes = {"/sdk_listener", "/ns1/sdk_server", "/sdk_talker", "/sdk_client"}
    await until(lambda: nodes <= ours.nodes(), "its nodes are known")
    await until(lambda: ours.services().get("/add_two_ints"), "its service is known")

    assert list(ours.publishers("/chatter")) == ["/sdk_talker"]
    assert list(ours.subscriptions("/chatter")) == ["/sdk_listener"]
    assert ours.services()["/add_two_ints"] == "/ns1/sdk_server"
    view = next(view for view in ours.system.snapshot().services if view.name == "/add_two_ints")
    assert (view.type, view.clients) == ("example_interfaces/srv/AddTwoInts", ("/sdk_client",))

    for token in PEER["liveliness_delete_after_exit"]:
        await there.do("withdraw", token=token)
    await until(lambda: ours.nodes() == {"/ours/robot"}, "they have gone")


async def test_the_messages_of_a_talker_are_heard(ours: Ours, start_raw: StartRaw) -> None:
    got = ours.listen(CHATTER)
    there = await start_raw(TALKER_SESSION)
    for token in PEER["liveliness_put"][4:6]:
        await there.do("announce", token=token)
    await until(lambda: ours.publishers("/chatter"), "the talker is known")
    await until(lambda: appeared(there, "MS", "/chatter"), "our listener is known there")

    for sample in PEER["topic_samples"][:3]:
        await there.do("put", key=sample["key"], payload=sample["payload_hex"], attachment=sample["attachment_hex"])

    await until(lambda: len(got) >= 3, "all have come")
    assert got == [{"data": f"Hello World: {number}"} for number in (1, 2, 3)]


async def test_a_message_without_an_attachment_is_discarded_as_in_ros_2(ours: Ours, start_raw: StartRaw) -> None:
    got = ours.listen(CHATTER)
    there = await start_raw(TALKER_SESSION)
    await until(lambda: appeared(there, "MS", "/chatter"), "our listener is known there")
    bare, whole = PEER["topic_samples"][:2]

    await there.do("put", key=bare["key"], payload=bare["payload_hex"], attachment=None)
    await there.do("put", key=whole["key"], payload=whole["payload_hex"], attachment=whole["attachment_hex"][:64])
    await there.do("put", key=whole["key"], payload=whole["payload_hex"], attachment=whole["attachment_hex"])

    await until(lambda: got, "the last one has come")
    assert got == [{"data": "Hello World: 2"}]


async def test_every_endpoint_that_the_sources_of_ros_2_describe_is_shown_with_its_node_type_and_quality(
    ours: Ours, start_raw: StartRaw
) -> None:
    entities = [one for one in REFERENCE["entities"] if one["domain_id"] == 0]
    there = await start_raw(entities[0]["zid"])
    for number, one in enumerate(entities):
        await there.do("announce", token=with_own_node(one["liveliness_token"], number))
    services = [one for one in entities if one["kind"] == "SS"]
    await until(lambda: {one["name"] for one in services} <= ours.services().keys(), "its services are known")

    for one in entities:
        node = f"{one['namespace'].rstrip('/')}/{one['node_name']}"
        assert node in ours.nodes(), one
        if one["kind"] in ("MP", "MS"):
            edges = (ours.publishers if one["kind"] == "MP" else ours.subscriptions)(one["name"])
            assert node in edges, one
            assert one["type"] in ours.view(one["name"]).types, one
        elif one["kind"] == "SS":
            assert ours.services()[one["name"]] == node, one


async def test_a_message_of_a_talker_whose_gid_is_that_of_its_token_is_counted_as_its(
    ours: Ours, start_raw: StartRaw
) -> None:
    (talker,) = (one for one in REFERENCE["entities"] if one.get("name") == "/chatter" and "::,7:" in str(one))
    stream = ours.node.subscribe(CHATTER)
    there = await start_raw(talker["zid"])
    await there.do("announce", token=talker["liveliness_token"])
    await until(lambda: stream.publisher_count, "the talker is matched")
    await until(lambda: appeared(there, "MS", "/chatter"), "our listener is known there")
    numbers = (1, 2, 5)  # 3 and 4 are lost

    for number in numbers:
        attachment = number.to_bytes(8, "little") + bytes(8) + b"\x10" + bytes.fromhex(talker["gid_hex"])
        payload = PEER["topic_samples"][0]["payload_hex"]
        await there.do("put", key=talker["data_key"], payload=payload, attachment=attachment.hex())

    await until(lambda: stream.received == 3, "all have come")
    assert stream.status.message_lost == 2
    assert ours.publishers("/chatter").keys() == {"/talker"}


async def test_a_humble_talker_is_shown_and_said_to_have_another_type(ours: Ours, start_raw: StartRaw) -> None:
    (humble,) = (one for one in REFERENCE["entities"] if "TypeHashNotSupported" in one["liveliness_token"])
    got = ours.listen(CHATTER)
    there = await start_raw(humble["zid"])
    await there.do("announce", token=humble["liveliness_token"])

    (text,) = await until(lambda: ours.view("/chatter").mismatches, "the mismatch is known")

    assert "/humble" in text and "TypeHashNotSupported" in text
    assert got == []


async def test_a_recorded_request_is_answered_by_our_server_with_the_recorded_bytes(
    ours: Ours, start_raw: StartRaw
) -> None:
    async def add(request: AddTwoInts.Request) -> AddTwoInts.Response:
        return AddTwoInts.Response(sum=request.a + request.b)

    ours.node.serve(ADD, add)
    there = await start_raw(TALKER_SESSION)
    await until(lambda: appeared(there, "SS", "/add_two_ints"), "our server is known there")
    exchange = PEER["service_reply_from_server"]
    (recorded,) = exchange["replies"]

    asked = {"payload": exchange["request_payload_hex"], "attachment": exchange["request_attachment_hex"]}
    (reply,) = await there.do("ask", key=recorded["key"], timeout=30.0, **asked)

    assert reply["key"] == recorded["key"]
    assert reply["payload"] == recorded["payload_hex"]
    wanted, found = recorded["attachment_hex"], reply["attachment"]
    assert (found[:16], found[32:]) == (wanted[:16], wanted[32:])  # between them is the time
    assert (reply["priority"], reply["express"]) == (recorded["priority"], recorded["express"])


@pytest.mark.parametrize("attachment", [None, "0700"])
async def test_a_request_without_a_whole_attachment_gets_no_answer(
    attachment: str | None, ours: Ours, start_raw: StartRaw
) -> None:
    async def add(request: AddTwoInts.Request) -> AddTwoInts.Response:
        raise AssertionError("it must not be asked")

    ours.node.serve(ADD, add)
    there = await start_raw(TALKER_SESSION)
    await until(lambda: appeared(there, "SS", "/add_two_ints"), "our server is known there")
    exchange = PEER["service_reply_from_server"]
    key = exchange["replies"][0]["key"]

    assert (
        await there.do("ask", key=key, timeout=30.0, payload=exchange["request_payload_hex"], attachment=attachment)
        == []
    )


# What we send is the same ---------------------------------------------------------------------------------------------------


async def test_the_key_token_payload_and_attachment_of_our_talker_are_those_of_the_record(
    ours: Ours, start_raw: StartRaw
) -> None:
    recorded = PEER["topic_samples"][:3]
    publisher = ours.node.publisher(CHATTER)
    there = await start_raw(TALKER_SESSION)
    await there.do("record", keys=recorded[0]["key"])
    token = await until(lambda: appeared(there, "MP", "/chatter"), "our talker is known there")
    await until(lambda: _put_again(publisher, there), "the first message has come")

    for text in ("Hello World: 1", "Hello World: 2", "Hello World: 3"):
        publisher(String(data=text))
    await until(lambda: b"Hello World: 3".hex() in there.said("sample")[-1]["payload"], "the last has come")

    node = [line["token"] for line in there.said("appeared") if line["token"].endswith("/NN/%/%ours/robot")]
    assert len(node) == 1
    assert token == as_of(PEER["liveliness_put"][5].replace("%/%/sdk_talker", "%/%ours/robot"), token)
    assert _gid_of_token(token) == gid_in(there.said("sample")[-1]["attachment"])
    last = [line["attachment"] for line in there.said("sample")[-4:]]
    numbers = [int.from_bytes(bytes.fromhex(attachment)[:8], "little") for attachment in last]
    assert numbers == list(range(numbers[0], numbers[0] + 4))
    for sent, wanted in zip(there.said("sample")[-3:], recorded, strict=True):
        assert sent["key"] == wanted["key"]
        assert sent["payload"] == wanted["payload_hex"]
        assert len(sent["attachment"]) == len(wanted["attachment_hex"])
        assert sent["attachment"][32:34] == wanted["attachment_hex"][32:34] == "10"
        for setting in ("congestion_control", "priority", "express"):
            assert sent[setting] == wanted[setting]


def _put_again(publisher: Any, there: Program) -> bool:
    publisher(String(data="first"))
    return bool(there.said("sample"))


def _gid_of_token(token: str) -> str:
    """As in the sources of ROS 2: both halves of XXH3, each in the machine's byte order."""
    import xxhash

    whole: int = xxhash.xxh3_128_intdigest(token.encode())
    return ((whole & (2**64 - 1)).to_bytes(8, "little") + (whole >> 64).to_bytes(8, "little")).hex()


async def test_the_request_of_our_client_is_the_recorded_one_and_the_recorded_answer_is_understood(
    ours: Ours, start_raw: StartRaw
) -> None:
    (recorded,) = PEER["service_request_from_client"]
    (reply,) = PEER["service_reply_from_server"]["replies"]
    there = await start_raw(PEER["liveliness_put"][3].split("/")[2])
    time = reply["attachment_hex"][16:32]
    await there.do("serve", key=reply["key"], payload=reply["payload_hex"], time=time, complete=True)
    await there.do("announce", token=PEER["liveliness_put"][3])

    answer = await ours.node.call(ADD, AddTwoInts.Request(a=2, b=40), timeout=30.0)

    assert answer == AddTwoInts.Response(sum=42)
    asked = await there.until("asked")
    assert (asked["selector"], asked["payload"]) == (recorded["selector"], recorded["payload_hex"])
    sent, wanted = asked["attachment"], recorded["attachment_hex"]
    assert (sent[:16], sent[32:34]) == (wanted[:16], wanted[32:34])
    token = await until(lambda: appeared(there, "SC", "/add_two_ints"), "our client is known there")
    assert token == as_of(PEER["liveliness_put"][7].replace("%/%/sdk_client", "%/%ours/robot"), token)
    assert gid_in(sent) == _gid_of_token(token)


# What is kept for later subscriptions ---------------------------------------------------------------------------------------

TL_KEY = HISTORY["samples_and_heartbeats"][0]["key"]
KEPT = Topic(String, "/tl", QoS(depth=1, durability=Durability.TRANSIENT_LOCAL))


async def test_the_recorded_history_is_heard_by_our_late_subscription_and_what_follows(
    ours: Ours, start_raw: StartRaw
) -> None:
    samples = [one for one in HISTORY["samples_and_heartbeats"] if "source_sn" in one]
    there = await start_raw(HISTORY["publisher_zid"])
    await there.do("keep", key=TL_KEY, depth=1, reliable=True)
    for sample in samples:
        await there.do("put_kept", key=TL_KEY, payload=sample["payload_hex"], attachment=sample["attachment_hex"])
    numbers: list[dict[str, Any]] = ours.listen(KEPT)

    await until(lambda: numbers, "what is kept has come")
    after = (3).to_bytes(8, "little").hex() + samples[0]["attachment_hex"][16:]
    await there.do("put_kept", key=TL_KEY, payload=samples[0]["payload_hex"], attachment=after)
    await until(lambda: len(numbers) > 1, "what follows has come")

    assert numbers == [{"data": "hi"}, {"data": "hi"}]


@pytest.mark.parametrize("reliability", list(Reliability)[1:3])
async def test_what_we_keep_is_heard_by_a_late_subscription_declared_as_in_ros_2(
    reliability: Reliability, ours: Ours, start_raw: StartRaw
) -> None:
    publisher = ours.node.publisher(KEPT, qos=KEPT.qos.replace(reliability=reliability, depth=2))
    for text in ("one", "two", "three"):
        publisher(String(data=text))
    there = await start_raw(HISTORY["subscriber_zid"])
    await there.do("catch_up", key=TL_KEY, depth=5, reliable=reliability is Reliability.RELIABLE)

    await until(lambda: len(there.said("sample")) >= 2, "what is kept has come")
    publisher(String(data="four"))
    await until(lambda: len(there.said("sample")) >= 3, "what follows has come")

    texts = [bytes.fromhex(line["payload"])[8:-1].decode() for line in there.said("sample")]
    assert texts == ["two", "three", "four"]
    numbers = [int.from_bytes(bytes.fromhex(line["attachment"])[:8], "little") for line in there.said("sample")]
    assert numbers == [2, 3, 4]


async def test_the_traffic_of_our_transient_local_endpoints_is_that_of_the_record(
    ours: Ours, start_raw: StartRaw
) -> None:
    """But for the heartbeat, which our publishers do not send; instead they wait for a slow reader, where those of ROS 2 drop."""
    there = await start_raw(HISTORY["subscriber_zid"])
    await there.do("watch", keys=f"{TL_KEY}/@adv/**")
    await there.do("record", keys=TL_KEY)
    await there.do("serve", key=f"{TL_KEY}/@adv/**", payload=None, time="", complete=False)
    publisher = ours.node.publisher(KEPT)
    subscription = ours.node.subscribe(KEPT)
    await until(lambda: _of_role(there, "pub") and _of_role(there, "sub"), "both are known there")
    await until(lambda: there.said("asked"), "the history is asked for")
    await until(lambda: publisher(String(data="hi")) or there.said("sample"), "a sample has come")

    presences = [key for _, key in HISTORY["adv_liveliness"]]
    assert [_of_role(there, role) for role in ("pub", "sub")] == [
        as_presence(recorded, _of_role(there, role)) for role, recorded in zip(("pub", "sub"), presences, strict=True)
    ]
    assert there.said("asked")[0]["selector"] == HISTORY["history_queries_seen_by_spy"][0]
    sample, recorded = there.said("sample")[0], HISTORY["samples_and_heartbeats"][0]
    assert (sample["key"], sample["payload"]) == (recorded["key"], recorded["payload_hex"])
    assert len(sample["attachment"]) == len(recorded["attachment_hex"])
    assert (sample["congestion_control"], recorded["congestion_control"]) == ("BLOCK", "DROP")
    assert (sample["priority"], sample["express"]) == (recorded["priority"], recorded["express"])
    subscription.close()


def _of_role(there: Program, role: str) -> str:
    """The presence of our publisher or subscription among the traffic of Zenoh's extension."""
    found = [line["token"] for line in there.said("appeared") if f"/@adv/{role}/" in line["token"]]
    return str(found[-1]) if found else ""


def as_presence(recorded: str, seen: str) -> str:
    """A recorded presence with the session and entity of `seen`."""
    parts = recorded.split("/")
    parts[-3:-1] = seen.split("/")[-3:-1]
    return "/".join(parts)

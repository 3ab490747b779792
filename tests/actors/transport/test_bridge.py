"""The life of the connection with other processes: how it is switched on, what it shows of nodes, and what it leaves behind."""

from __future__ import annotations

import asyncio
from typing import Any

import pytest

from actors import Child, LifecycleNode, Node, StartFailed, Topic, publishes, run, subscribes
from actors.interfaces import encode, type_hash
from actors.interfaces.message import make_message
from actors.interfaces.std_msgs.msg import Int32
from actors.testing import Rig
from actors.transport.format.attachments import Attachment, write_attachment
from actors.transport.format.gids import gid_of
from actors.transport.keyed.protocol import Delivery, Events
from tests.actors.transport.hosts import Hosts
from tests.actors.transport.memory import End, Network
from tests.actors.transport.test_bridge_actions import Counter
from tests.actors.transport.test_bridge_services import Adder
from tests.stage import ADD, COUNT, NUMBERS, events, number, order, result, total, two

pytestmark = pytest.mark.virtual


class Talker(Node):
    out = publishes(NUMBERS)


class Listener(Node):
    numbers = subscribes(NUMBERS)


async def test_a_program_is_connected_by_run_with_a_transport_and_withdraws_everything_at_its_end() -> None:
    network = Network()
    async with run(Talker, sinks=(), transport=network.end()) as talking:
        async with run(Listener, sinks=(), transport=network.end()) as listening:
            assert talking.node(Talker).out.subscription_count == 1
            talking.node(Talker).out(number(5))
            assert (await listening.node(Listener).numbers.next()).data == 5
        assert talking.node(Talker).out.subscription_count == 0
    assert (network.tokens, network.ends) == ({}, {})


async def test_nodes_of_other_processes_are_listed_with_host_and_process(hosts: Hosts) -> None:
    rig = await hosts.start(Talker)
    other = await hosts.start(Child(Listener, namespace="robot1"))

    seen = [(node.name, node.state, node.host, node.process) for node in rig.system.snapshot().nodes]
    assert seen == [
        ("/rig", "running", "", 0),
        ("/rig", "elsewhere", "box", 2),
        ("/robot1/listener", "elsewhere", "box", 2),
        ("/talker", "running", "", 0),
    ]
    assert [node.name for node in other.system.snapshot().nodes if node.state == "elsewhere"] == ["/rig", "/talker"]


async def test_two_nodes_of_one_name_are_logged_once_on_both_sides_when_that_lasts(hosts: Hosts) -> None:
    first = await hosts.start(Talker, Child(Listener, name="_hidden"))
    second = await hosts.start(Talker, Child(Listener, name="_hidden"))

    def lines() -> list[list[Any]]:
        return [
            [line.fields["node_name"] for line in events(rig.logs, "another process has a node of this name")]
            for rig in (first, second)
        ]

    await first.advance(9.0)
    assert lines() == [[], []]
    await first.advance(2.0)
    assert lines() == [["/talker"], ["/talker"]]
    third = await hosts.start(Talker)
    await first.advance(11.0)
    assert lines() == [["/talker"], ["/talker"]]
    assert len(events(third.logs, "another process has a node of this name")) == 1


async def test_a_process_that_takes_the_place_of_a_crashed_one_is_no_second_node_of_its_name(hosts: Hosts) -> None:
    crashed = await hosts.start(Talker)
    instead = await hosts.start(Talker)
    await instead.advance(5.0)
    hosts.lose(crashed)
    await instead.advance(20.0)
    assert events(instead.logs, "another process has a node of this name") == []


async def test_a_snapshot_says_what_was_exchanged_with_the_endpoints_of_other_processes(hosts: Hosts) -> None:
    rig = await hosts.start(Talker)
    other = await hosts.start(Listener)
    out = rig.node(Talker).out
    for value in range(3):
        out(number(value))
    await rig.quiet()
    gap = write_attachment(
        Attachment(
            7, 0, gid_of(next(token for token in hosts.network.tokens if "/MP/" in token and "numbers" in token))
        )
    )
    key = next(outlet.key for outlet in hosts.ends[rig].outlets if "/numbers/" in outlet.key)
    hosts.ends[rig].outlet(key, Delivery()).put(encode(number(9)), gap)
    await rig.quiet()

    (there,) = next(view for view in rig.system.snapshot().topics if view.name == "/numbers").subscriptions
    (here,) = next(view for view in other.system.snapshot().topics if view.name == "/numbers").publishers

    assert (there.node, there.host, there.process, there.bytes, there.dropped) == ("/listener", "box", 2, 24, 0)
    assert (here.node, here.host, here.process, here.bytes, here.dropped) == ("/talker", "box", 1, 32, 3)
    assert [(link.host, link.process) for link in rig.system.snapshot().links] == [("box", 2)]
    own = next(view for view in rig.system.snapshot().topics if view.name == "/numbers").publishers[0]
    assert (own.host, own.process, own.bytes) == ("", 0, 0)
    assert '"links"' in rig.system.snapshot().to_json()


async def test_what_was_sent_for_a_subscription_elsewhere_counts_while_it_was_matched(hosts: Hosts) -> None:
    rig, other = await hosts.start(Talker), await hosts.start(Listener)
    later = await hosts.start(Node)
    publisher = rig.me.publisher(NUMBERS)
    await rig.quiet()
    publisher.publish(number(1))
    rig.node(Talker).out(number(2))
    probe = later.probe(NUMBERS)
    await rig.quiet()
    publisher.close()
    rig.node(Talker).out(number(3))
    await rig.quiet()

    edges = next(view for view in rig.system.snapshot().topics if view.name == "/numbers").subscriptions

    assert [(edge.node, edge.process, edge.bytes) for edge in edges] == [("/listener", 2, 24), ("/rig", 3, 8)]
    assert len(probe) == 1
    assert other.system.snapshot().links[0].process == 1


async def test_a_node_whose_process_the_transport_does_not_know_has_no_host(hosts: Hosts) -> None:
    rig, other = await hosts.start(Node), await hosts.start(Node)
    ghost = hosts.ends[other].announce("@ros2_lv/0/77/0/0/NN/%/%robot1/ghost")
    await rig.quiet()

    (seen,) = (node for node in rig.system.snapshot().nodes if node.name == "/robot1/ghost")
    assert (seen.host, seen.process) == ("", 0)
    ghost.close()


async def test_a_node_is_listed_from_its_start_to_its_end_for_good(hosts: Hosts) -> None:
    rig, other = await hosts.start(Node), await hosts.start(Node)
    versions = [rig.system.graph.version]
    joined = await other.system.join(Child(Node, name="guest"))
    await rig.quiet()
    present = [node.name for node in rig.system.snapshot().nodes]
    versions.append(rig.system.graph.version)
    await other.system.leave(joined)
    await rig.quiet()
    versions.append(rig.system.graph.version)

    assert "/guest" in present
    assert "/guest" not in [node.name for node in rig.system.snapshot().nodes]
    assert versions[0] < versions[1] < versions[2], "who watches the graph is told"


async def test_a_transport_that_cannot_be_opened_is_one_line_and_the_tree_runs_alone(rig: Rig) -> None:
    network = Network()
    network.broken = True
    await rig.start(Talker, Listener, transport=network.end())
    rig.node(Talker).out(number(1))

    assert (await rig.node(Listener).numbers.next()).data == 1
    (line,) = events(rig.logs, "no connection with other processes")
    assert (line.level, line.fields) == (40, {"because": "port 7447 is in use: end the program that uses it"})


async def test_a_transport_that_raises_what_it_must_not_is_one_line_with_the_place_and_the_tree_runs_alone(
    rig: Rig,
) -> None:
    class Faulty(End):
        async def open(self, *_: object) -> None:
            raise RuntimeError("a mistake")

    await rig.start(Talker, Listener, transport=Faulty(Network(), "faulty"))
    rig.node(Talker).out(number(1))

    assert (await rig.node(Listener).numbers.next()).data == 1
    (line,) = events(rig.logs, "what begins beside the start has failed; the system runs without it")
    assert (line.level, line.fields["error"]) == (40, "RuntimeError: a mistake")


async def test_a_tree_that_fails_to_start_closes_the_transport() -> None:
    class Broken(Node):
        async def on_start(self) -> None:
            await self.clock.sleep(1.0)
            raise OSError("no such device")

    network = Network()
    with pytest.raises(StartFailed):
        async with run(Broken, sinks=(), transport=network.end()):
            raise AssertionError("it has started")
    assert (network.tokens, network.ends) == ({}, {})


async def test_a_system_that_is_stopped_while_the_transport_opens_does_not_wait_for_it() -> None:
    class Slow(End):
        async def open(self, *_: object) -> None:
            await asyncio.sleep(3600.0)

    loop = asyncio.get_running_loop()
    begun = loop.time()
    task = asyncio.create_task(_run_with(Slow(Network(), "1")))
    await asyncio.sleep(1.0)
    task.cancel()
    with pytest.raises(asyncio.CancelledError):
        await task
    assert loop.time() - begun == 1.0


async def _run_with(transport: End) -> None:
    async with run(Talker, sinks=(), transport=transport):
        raise AssertionError("it has started")


async def test_tokens_that_come_while_it_opens_are_taken_in_and_those_that_cannot_be_read_are_logged(
    hosts: Hosts,
) -> None:
    await hosts.start(Talker)
    hosts.network.tokens["@ros2_lv/0/not a token"] = hosts.ends[hosts.rigs[0]]
    rig = await hosts.start(Listener)

    assert rig.node(Listener).numbers.publisher_count == 1
    (line,) = events(rig.logs, "a token cannot be read")
    assert line.fields["token"] == "@ros2_lv/0/not a token"
    del hosts.network.tokens["@ros2_lv/0/not a token"]
    rig.system.runtime.log.info("it goes on")
    hosts.network.ends[hosts.ends[rig].session].events.vanished("@ros2_lv/0/not a token")


class Late(Node):
    async def on_start(self) -> None:
        await self.clock.sleep(2.0)


class SlowEnd(End):
    """Is known to others a second before `open` returns."""

    async def open(self, tokens: str, events: Events) -> None:
        await super().open(tokens, events)
        await asyncio.sleep(1.0)


async def test_what_is_there_when_the_transport_is_open_is_shown_and_what_it_told_before_is_taken_in(
    hosts: Hosts,
) -> None:
    other = await hosts.start(Talker)
    network = hosts.network
    rig = Rig()
    hosts.rigs.append(rig)
    end = SlowEnd(network, "f")
    opening = asyncio.create_task(rig.start(Child(Talker, name="two"), Listener, Adder, Counter, Late, transport=end))
    await other.advance(0.5)
    brief = hosts.ends[other].announce("@ros2_lv/0/77/0/0/NN/%/%/brief")
    gone = hosts.ends[other].announce(
        f"@ros2_lv/0/77/0/1/MP/%/%/brief/%numbers/std_msgs::msg::dds_::Int32_/{type_hash(Int32)}/::,10:,:,:,,"
    )
    await other.advance(0.1)
    bridge: Any = end.events._events  # type: ignore[attr-defined]
    bridge.told(b"no question")  # one that opens waits for nobody yet
    brief.close()
    gone.close()
    before = other.node(Talker).out.subscription_count
    await opening
    await other.quiet()
    probe = other.probe(NUMBERS)
    await other.quiet()
    rig.node("two").out(number(1))  # type: ignore[attr-defined]
    await other.quiet()

    assert len(probe) == 1
    assert (before, other.node(Talker).out.subscription_count) == (0, 2)
    assert rig.node(Listener).numbers.publisher_count == 2
    assert await other.call(ADD, two(1, 0)) == total(1)
    assert await (await other.send_goal(COUNT, order(1))) == result(1)
    assert "/brief" not in [node.name for node in rig.system.snapshot().nodes]


async def test_what_a_transport_has_lost_is_counted_where_it_would_have_arrived(hosts: Hosts) -> None:
    rig = await hosts.start(Listener)
    bridge: Any = hosts.ends[rig].events._events  # type: ignore[attr-defined]
    (subscription,) = rig.system.graph.topic("/numbers").subscriptions
    bridge.lost(subscription, 3)
    bridge.lost(subscription, 1)
    assert rig.node(Listener).numbers.dropped == rig.node(Listener).numbers.status.message_lost == 4
    bridge.liveliness(bytes(16))  # of a publisher that has gone meanwhile
    assert rig.node(Listener).numbers.publisher_count == 0


async def test_a_name_that_no_key_may_hold_does_not_end_the_others(hosts: Hosts) -> None:
    rig, other = await hosts.start(Node), await hosts.start(Talker)
    hosts.ends[other].announce(
        "@ros2_lv/0/2/90/91/MP/%/%/odd/%topic/std_msgs::msg::dds_::Int32_/RIHS01_0/no quality"
    ).close()
    await rig.quiet()
    (line,) = events(rig.logs, "a token cannot be read")
    assert "no quality" in str(line.fields["token"])


async def test_what_the_format_cannot_represent_stays_in_its_process_and_is_logged(hosts: Hosts) -> None:
    odd = make_message(
        "Odd", {"__module__": "x", "__qualname__": "Odd", "__ros_type__": "_x/msg/Odd", "__annotations__": {}}
    )
    rig = await hosts.start(Node)
    topic = Topic(odd, "odd")
    probe = rig.probe(topic)
    rig.publish(topic, odd())
    await rig.quiet()

    assert len(probe) == 1
    assert {line.fields["what"] for line in events(rig.logs, "not visible to other processes")} == {"/odd"}


@pytest.mark.parametrize(("domain", "seen"), [("7", True), ("0", False), ("", False)])
async def test_a_domain_is_apart_from_the_others(monkeypatch: pytest.MonkeyPatch, domain: str, seen: bool) -> None:
    network = Network()
    monkeypatch.setenv("ROS_DOMAIN_ID", "7")
    async with run(Talker, sinks=(), transport=network.end()) as system:
        monkeypatch.setenv("ROS_DOMAIN_ID", domain)
        async with run(Listener, sinks=(), transport=network.end()):
            assert system.node(Talker).out.subscription_count == int(seen)


@pytest.mark.parametrize("domain", ["-1", "233", "seven", "٣"])
async def test_a_domain_that_is_none_is_refused(monkeypatch: pytest.MonkeyPatch, domain: str) -> None:
    monkeypatch.setenv("ROS_DOMAIN_ID", domain)
    with pytest.raises(ValueError, match=r"ROS_DOMAIN_ID='.*': a domain is a number from 0 to 232"):
        async with run(Talker, sinks=(), transport=Network().end()):
            raise AssertionError("it has started")


class Managed(LifecycleNode):
    """Has made no transition."""


async def test_the_transition_events_of_a_lifecycle_node_are_shown_from_its_start_as_in_ros_2(hosts: Hosts) -> None:
    await hosts.start(Managed, Child(Node, name="plain"))
    there = await hosts.start(Node)

    views = [view for view in there.system.snapshot().topics if view.name.endswith("/transition_event")]

    assert [view.name for view in views] == ["/managed/transition_event"]
    assert views[0].types == ("lifecycle_msgs/msg/TransitionEvent",)
    assert [edge.node for edge in views[0].publishers] == ["/managed"]

"""The graph as a node sees it: who is there, with which types and qualities of service, and waiting for them."""

from __future__ import annotations

import asyncio
import math

import pytest

from actors import (
    CallTimeout,
    Child,
    DynamicSupervisor,
    Node,
    Service,
    ServiceUnavailable,
    Steps,
    every,
    graph_of,
    publishes,
    qos,
)
from actors.errors import NotStarted  # fmt: skip
from actors.interfaces.example_interfaces.action import Fibonacci
from actors.interfaces.example_interfaces.srv import AddTwoInts
from actors.interfaces.std_msgs.msg import String
from actors.interfaces.std_srvs.srv import Trigger
from actors.testing import Rig
from tests.stage import ADD, COUNT, NUMBERS, WORDS, word


class Talker(Node):
    words = publishes(WORDS, qos=qos.LATCHED)

    @every(hz=1)
    def talk(self) -> None:
        self.words(word("hello"))


class Listener(Node):
    @WORDS.on(qos=5)
    def hear(self, message: String) -> None:
        """Take it."""


class Server(Node):
    @ADD.serve()
    async def add(self, request: AddTwoInts.Request) -> AddTwoInts.Response:
        return AddTwoInts.Response(sum=request.a + request.b)

    @COUNT.serve()
    async def count(self, goal: Fibonacci.Goal) -> Steps[Fibonacci.Feedback, Fibonacci.Result]:
        yield Fibonacci.Feedback()


async def test_topics_services_actions_and_nodes_by_name(rig: Rig) -> None:
    await rig.start(Child(Talker), Child(Listener), Child(Server))
    graph = graph_of(rig.node(Talker))
    assert graph.topics() == {"/words": ("std_msgs/msg/String",)}
    assert graph.services() == {"/add": "example_interfaces/srv/AddTwoInts"}
    assert graph.actions() == {"/count": "example_interfaces/action/Fibonacci"}
    assert graph.nodes() == ("/listener", "/rig", "/server", "/talker")
    assert repr(graph).startswith("<the graph as /talker sees it: ")


async def test_the_endpoints_of_a_topic_have_node_type_and_quality_of_service(rig: Rig) -> None:
    await rig.start(Child(Talker), Child(Listener))
    graph = graph_of(rig.node(Listener))
    (publisher,), (subscription,) = graph.publishers("words"), graph.subscriptions("/words")
    assert (publisher.node, publisher.topic, publisher.type, publisher.here) == (
        "/talker",
        "/words",
        "std_msgs/msg/String",
        True,
    )
    assert (
        publisher.qos.transient_local
        and publisher.qos.depth == 1
        and subscription.qos.depth == 5
        and subscription.node == "/listener"
    )
    assert (graph.count_publishers("words"), graph.count_subscribers("words")) == (1, 1)
    assert graph.publishers("nothing") == graph.subscriptions("nothing") == ()
    assert "/nothing" not in rig.system.graph.topics


async def test_names_are_those_of_the_asking_node(rig: Rig) -> None:
    await rig.start(
        Child(Talker, namespace="/spot"), Child(Listener, namespace="/spot"), Child(Node, name="far", remap={"words": "/spot/words"})
    )  # fmt: skip
    near, far = graph_of(rig.node(Listener)), graph_of(rig.node("far"))
    assert near.count_publishers("words") == far.count_publishers("words") == 1
    assert far.count_publishers("/words") == 1  # the rule reaches the full name, too
    assert [one.topic for one in near.published_by("talker")] == ["/spot/words"]
    assert [one.topic for one in far.subscribed_by("/spot/listener")] == ["/spot/words"]
    assert far.published_by("talker") == ()


async def test_servers_and_clients_are_counted(rig: Rig) -> None:
    await rig.start(Server)
    graph = graph_of(rig.node(Server))
    assert (graph.count_services("add"), graph.count_clients("add")) == (1, 0)
    await rig.call(ADD, AddTwoInts.Request(a=1, b=2))
    assert (graph.count_services("add"), graph.count_clients("add")) == (1, 1)
    assert (graph.count_services("nothing"), graph.count_clients("nothing")) == (0, 0)
    assert graph.served_by("server") == {
        "/add": "example_interfaces/srv/AddTwoInts", "/count": "example_interfaces/action/Fibonacci",
    }  # fmt: skip
    assert graph.called_by("/rig") == ("/add",)
    with pytest.raises(ServiceUnavailable):
        await rig.call(Service(Trigger, "reset"), Trigger.Request(), timeout=0.1)
    assert graph.count_services("reset") == 0 and "/reset" not in graph.services()


async def test_it_waits_for_publishers_and_subscribers_that_are_to_come(rig: Rig) -> None:
    await rig.start(Node)
    graph = graph_of(rig.me)
    both = asyncio.gather(
        graph.wait_for_publishers("words", timeout=10.0), graph.wait_for_subscribers("words", 2, timeout=10.0)
    )
    rig.probe(WORDS)
    await rig.advance(1.0)
    rig.me.publisher(WORDS)
    assert not both.done()
    await rig.advance(1.0)
    stream = rig.me.subscribe(WORDS)
    await both
    assert rig.now == 2.0 and stream.publisher_count == 1
    await graph.wait_for_publishers("words")
    assert rig.now == 2.0


async def test_a_wait_that_takes_too_long_says_what_did_not_come(rig: Rig) -> None:
    await rig.start(Node)
    graph = graph_of(rig.me)
    with pytest.raises(CallTimeout, match=r"^no 1 publisher\(s\) of /words within 2.0 s$"):
        await graph.wait_for_publishers("words", timeout=2.0)
    with pytest.raises(CallTimeout, match=r"^no 3 subscription\(s\) of /words within 1.0 s$"):
        await graph.wait_for_subscribers("words", 3, timeout=1.0)
    with pytest.raises(CallTimeout, match=r"^no node /talker within 0.5 s$"):
        await graph.wait_for_node("talker", timeout=0.5)
    assert rig.now == 3.5
    with pytest.raises(ValueError, match="the wait for node /talker: timeout=nan must be a number of seconds"):
        await graph.wait_for_node("talker", timeout=math.nan)


async def test_it_waits_for_a_node(rig: Rig) -> None:
    await rig.start(DynamicSupervisor("workers", Child(Node)))
    waiting = asyncio.ensure_future(graph_of(rig.me).wait_for_node("/painter", timeout=10.0))
    await rig.advance(1.0)
    assert not waiting.done()
    supervisor = rig.system.supervisor
    assert supervisor is not None
    await supervisor.spawn(name="painter")
    await waiting
    assert rig.now <= 1.1
    await supervisor.terminate_child("painter")
    assert "/painter" not in graph_of(rig.me).nodes()


async def test_its_changes_come_one_after_another_and_together_for_a_busy_reader(rig: Rig) -> None:
    await rig.start(Node)
    changes = graph_of(rig.me).changes()
    publisher = rig.me.publisher(WORDS)
    assert await anext(changes) == ("+ /rig publishes /words",)
    waiting = asyncio.ensure_future(anext(changes))
    await rig.settled()
    assert not waiting.done()
    publisher.close()
    stream = rig.me.subscribe(NUMBERS)
    assert await waiting == ("- /rig publishes /words", "+ /rig subscribes /numbers")
    await changes.aclose()
    assert stream.received == 0


async def test_what_is_undone_before_it_is_seen_is_no_change(rig: Rig) -> None:
    await rig.start(Node)
    changes = graph_of(rig.me).changes()
    waiting = asyncio.ensure_future(anext(changes))
    await rig.settled()
    rig.me.publisher(WORDS).close()
    await rig.settled()
    assert not waiting.done()
    rig.me.publisher(NUMBERS)
    assert await waiting == ("+ /rig publishes /numbers",)


def test_a_node_that_was_not_started_has_no_graph() -> None:
    with pytest.raises(NotStarted):
        graph_of(Talker())

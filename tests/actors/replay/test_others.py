"""What a node sees of others in the graph is in its journal: servers that come and go, numbers of calls, who is alive, who is there."""

from __future__ import annotations

import asyncio

import pytest

from actors import (
    ActionUnavailable,
    Child,
    Node,
    Service,
    ServiceUnavailable,
    Topic,
    background,
    every,
    execute,
    graph_of,
    parameter,
    publishes,
    run,
)
from actors.interfaces.derived import event_message
from actors.interfaces.example_interfaces.action import Fibonacci
from actors.interfaces.rcl_interfaces.srv import GetParameters
from actors.interfaces.std_msgs.msg import Int32, String
from actors.interfaces.std_srvs.srv import Trigger, Trigger_Request, Trigger_Response
from actors.qos.policies import QoS
from actors.replay import Journal, Recording, replay
from tests.actors.replay.nodes import OWN, OWN_GOAL, Closed
from tests.actors.replay.story import TOLD

PARAMETERS = Service(GetParameters, "/closed/get_parameters")
EVENTS = Topic(event_message(Trigger), "/own/_service_event", 100)
BEAT = Topic(Int32, "beat", QoS(depth=5, liveliness="manual_by_topic", liveliness_lease=0.05))
EARLY: list[str] = []
SEEN: list[str] = []
CHOICES = ("off", "metadata", "contents")


class Asking(Node):
    """Asks another node for its parameters again and again, and tells who serves them."""

    told = publishes(TOLD)

    @every(hz=20)
    async def asks(self) -> None:
        try:
            await self.call(PARAMETERS, GetParameters.Request(names=["use_sim_time"]), timeout=0.01)
            became = "answered"
        except ServiceUnavailable:
            became = "unavailable"
        self.told(String(data=f"{became} {graph_of(self).services().get(PARAMETERS.name)}"))


class Introspected(Node):
    """Asks and serves, with introspection of both."""

    asks_with = parameter("contents", name="client_configure_introspection", choices=CHOICES)
    serves_with = parameter("metadata", name="service_configure_introspection", choices=CHOICES)

    @background
    async def asks(self) -> None:
        await self.clock.sleep(0.02)
        for _ in range(3):
            await self.call(OWN, Trigger.Request())
            await self.clock.sleep(0.02)

    @Service(Trigger, "mine").serve()
    async def answer(self, request: Trigger_Request) -> Trigger_Response:
        return Trigger.Response(success=True)


class Onlooker(Introspected):
    """Looks at the graph, too."""

    node_name = "introspected"

    @background
    async def looks(self) -> None:
        async for change in graph_of(self).changes():
            SEEN.extend(change)


class Busy(Node):
    """Asks both."""

    @background
    async def asks(self) -> None:
        for service in (OWN, Service(Trigger, "mine")) * 3:
            await self.call(service, Trigger.Request())
            await self.clock.sleep(0.013)


class Beating(Node):
    """Shows signs of life, for a while."""

    beat = publishes(BEAT)

    @background
    async def beats(self) -> None:
        for number in range(10):
            self.beat(Int32(data=number))
            await self.clock.sleep(0.02)


class Watching(Node):
    """Tells whether the other one is alive."""

    told = publishes(TOLD)

    @BEAT.on()
    def hear(self, message: Int32) -> None:
        pass

    @every(hz=20)
    def look(self) -> None:
        status = self.subscription(BEAT).status
        self.told(String(data=f"{status.alive} of {status.matched} alive"))


class Watcher(Watching):
    """Tells it in other words, and every change of it."""

    node_name = "watching"

    @background
    async def follows(self) -> None:
        async for event in self.subscription(BEAT).events():
            self.told(String(data=f"{type(event).__name__}"))


class Starting(Node):
    """Has a goal followed."""

    told = publishes(TOLD)

    @background
    async def follows(self) -> None:
        async with self.send_goal(OWN_GOAL, Fibonacci.Goal(order=2), timeout=0.05) as goal:
            self.told(String(data=f"{(await goal).sequence.tolist()}"))


class StartingTwice(Starting):
    """Asks for one more."""

    node_name = "starting"

    @background
    async def follows(self) -> None:
        await super().follows()
        try:
            await super().follows()
        except ActionUnavailable as error:
            self.told(String(data=str(error)))


class Early(Node):
    """Has something called when it has said its word."""

    told = publishes(TOLD)
    word = "recorded"

    async def on_start(self) -> None:
        asyncio.get_running_loop().call_soon(EARLY.append, "called")
        self.told(String(data=self.word))


async def recorded(node: type[Node], *others: Child | type[Node], seconds: float = 0.4) -> Recording:
    child = Child(node)
    journal = Journal(child.name)
    async with run(*others, child, observers=(journal,), sinks=()) as system:
        await system.clock.sleep(seconds)
    return journal.recording(child.name)


def texts(recording: Recording) -> list[str]:
    return [value.data for kind, name, value in recording.outputs() if (kind, name) == ("publish", "/told")]


def test_a_standard_service_that_ended_with_its_node_is_gone_in_the_replay() -> None:
    async def main() -> Recording:
        journal = Journal("asking")
        async with run(Closed, Asking, observers=(journal,), sinks=()) as system:
            await system.clock.sleep(0.22)
            assert system.supervisor is not None
            await system.supervisor.terminate_child("closed")
            await system.clock.sleep(0.2)
        return journal.recording("asking")

    recording = execute(main, clock="virtual")
    first, *_, last = texts(recording)
    assert first == "answered rcl_interfaces/srv/GetParameters"
    assert last == "unavailable None"
    verdict = replay(recording)
    assert (verdict.differences, verdict.lacking) == ((), "")


def test_what_introspection_tells_of_the_calls_of_a_node_is_told_again_with_the_same_callers_and_numbers() -> None:
    recording = execute(lambda: recorded(Introspected, Closed, Busy), clock="virtual")
    numbers = [value.info.sequence_number for _, name, value in recording.outputs() if name == "/own/_service_event"]
    assert len(numbers) == 6
    assert max(numbers) > 4, "the server counts those of others, too"
    assert sum(name == "/mine/_service_event" for _, name, _ in recording.outputs()) == 6
    verdict = replay(recording)
    assert (verdict.differences, verdict.lacking) == ((), "")


def test_a_publisher_that_shows_no_sign_of_life_any_more_shows_none_in_the_replay() -> None:
    recording = execute(lambda: recorded(Watching, Beating), clock="virtual")
    assert texts(recording)[0] == "1 of 1 alive"
    assert texts(recording)[-1] == "0 of 1 alive"
    verdict = replay(recording)
    assert (verdict.differences, verdict.lacking) == ((), "")


def test_a_changed_node_sees_who_serves_and_counts_its_calls_itself() -> None:
    recording = execute(lambda: recorded(Introspected, Closed, Busy), clock="virtual")
    SEEN.clear()
    verdict = replay(recording, node=Onlooker)
    assert (verdict.failure, verdict.lacking) == ("", "")
    assert "~ service /own: served by nobody -> served by /closed" in SEEN
    assert ("/own/_service_event", "info.client_gid[0]") in {(one.name, one.field) for one in verdict.differences}


def test_a_changed_node_sees_the_others_as_far_as_its_recording_tells_of_them() -> None:
    recording = execute(lambda: recorded(Watching, Beating), clock="virtual")
    heard: list[str] = []

    class Looking(Watcher):
        @every(hz=20)
        def look(self) -> None:
            heard.append(f"{self.subscription(BEAT).status.alive} of {self.subscription(BEAT).publisher_count}")

    verdict = replay(recording, node=Looking)
    assert (verdict.failure, verdict.lacking) == ("", "")
    assert heard[0] == "1 of 1"
    assert set(heard) == {"1 of 1"}, "a recording does not tell how long they would have been alive"


def test_a_goal_that_a_changed_node_starts_beyond_the_recording_is_not_answered() -> None:
    recording = execute(lambda: recorded(Starting, Closed, Beating), clock="virtual")
    assert texts(recording) == ["[2]"]
    verdict = replay(recording, node=StartingTwice)
    last = [one for one in verdict.differences if one.name == "/told"]
    assert [(one.recorded, one.replayed.data) for one in last] == [("nothing", "/closed did not answer within 0.05 s")]
    assert verdict.failure == ""


def test_what_a_node_had_still_to_do_when_its_replay_ended_early_is_done(monkeypatch: pytest.MonkeyPatch) -> None:
    recording = execute(lambda: recorded(Early), clock="virtual")
    assert EARLY == ["called"]
    monkeypatch.setattr(Early, "word", "replayed")
    assert [one.replayed for one in replay(recording).differences] == ["replayed"]
    assert EARLY == ["called", "called"]

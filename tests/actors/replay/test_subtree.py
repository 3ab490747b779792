"""The journal of a subtree holds what crosses its border; its nodes are replayed together and alone, and make their own messages inside."""

from __future__ import annotations

import asyncio
from collections.abc import Iterable
from contextlib import suppress

import pytest

from actors import (
    CallTimeout,
    Child,
    Node,
    Service,
    ServiceFailed,
    ServiceUnavailable,
    Supervisor,
    Topic,
    background,
    execute,
    parameter,
    publishes,
    run,
)
from actors.errors import NodeRestarting, NotRunning
from actors.interfaces.std_msgs.msg import Int32, String
from actors.interfaces.std_srvs.srv import Trigger, Trigger_Request, Trigger_Response
from actors.qos import LATCHED
from actors.replay import Journal, Recording, ReplayError, replay
from actors.replay.recording import starts_of
from tests.actors.replay.story import HERO, NUMBERS, OTHERS, TOLD, Others, Visitor, lived
from tests.actors.replay.test_replay import CLOCKS, Clock

DOUBLED = Topic(Int32, "doubled")
RESULTS = Topic(Int32, "results")
PLAN = Topic(String, "plan", LATCHED)
HALF = Service(Trigger, "half")
NEVER = Service(Trigger, "never")


class Source(Node):
    """Is outside: sends numbers, and hears the results."""

    numbers = publishes(NUMBERS)

    @background
    async def sends(self) -> None:
        for number in range(1, 1000):
            await self.clock.sleep(0.01)
            self.numbers(Int32(data=number))

    @RESULTS.on()
    def result(self, message: Int32) -> None:
        pass


class Doubler(Node):
    """Doubles numbers, for the other one alone; above a limit they stay as they are."""

    doubled = publishes(DOUBLED)
    plan = publishes(PLAN)
    factor = parameter(2)
    limit = 1000

    async def on_start(self) -> None:
        self.plan(String(data="double"))

    @NUMBERS.on()
    def double(self, message: Int32) -> None:
        self.doubled(Int32(data=message.data * (self.factor if message.data < self.limit else 1)))

    @HALF.serve()
    async def half(self, request: Trigger_Request) -> Trigger_Response:
        return Trigger.Response(success=True, message="half")

    @NEVER.serve(concurrent=3)
    async def never(self, request: Trigger_Request) -> Trigger_Response:
        await asyncio.Event().wait()
        raise AssertionError


class Summer(Node):
    """Adds up what it is given, in steps of a thousand as seen from outside; asks the other one in between."""

    results = publishes(RESULTS)
    told = publishes(TOLD)

    async def on_start(self) -> None:
        self.total = 0

    @DOUBLED.on()
    def add(self, message: Int32) -> None:
        before, self.total = self.total, self.total + message.data
        if self.total // 1000 > before // 1000:
            self.results(Int32(data=self.total // 1000))

    @PLAN.on()
    def planned(self, message: String) -> None:
        self.told(String(data=f"plan {message.data}"))

    @background
    async def asks(self) -> None:
        while True:
            await self.clock.sleep(0.1)
            for service in (HALF, NEVER):
                with suppress(ServiceFailed, ServiceUnavailable, NotRunning, NodeRestarting):
                    try:
                        answer = await self.call(service, Trigger.Request(), timeout=0.02)
                        self.told(String(data=f"answer {answer.message}"))
                    except CallTimeout as error:
                        self.told(String(data=f"{error}"))


class LowLimit(Doubler):
    """Doubles only numbers below 30: the planted change of a constant."""

    limit = 30


class Twice(Doubler):
    """Sends the number 40 in two messages, of the same sum."""

    @NUMBERS.on()
    def double(self, message: Int32) -> None:
        if message.data != 40:
            return super().double(message)
        for _ in range(2):
            self.doubled(message)


TEAM = Supervisor("team", children=[Child(Doubler), Child(Summer)])
WORLD = Supervisor("world", children=[Child(Source), TEAM])


async def work(tree: Supervisor = WORLD) -> Recording:
    journal = Journal("world/team")
    async with run(tree, observers=(journal,), sinks=()) as system:
        await system.clock.sleep(0.505)
        assert system.node(Doubler).set_parameter("factor", 3).successful
        system.crash(Doubler, RuntimeError("struck by lightning"))
        await system.clock.sleep(0.5)
    return journal.recording("world/team")


@pytest.fixture(scope="module")
def recording() -> Recording:
    """The journal of the team, on the virtual clock."""
    return execute(work, clock="virtual")


def kinds(recording: Recording, *wanted: str) -> list[tuple[object, ...]]:
    return [entry for entry in recording.entries if isinstance(entry, tuple) and entry[0] in wanted]


@pytest.mark.parametrize("clock", CLOCKS)
def test_the_nodes_of_a_subtree_are_replayed_together_without_a_difference_at_its_border(clock: Clock) -> None:
    recording = execute(work, clock=clock)
    assert recording.node == "world/team"
    verdict = replay(recording)
    assert (verdict.differences, verdict.inner, verdict.lacking) == ((), (), "")
    assert verdict.equal
    assert verdict.compared > 20


def test_what_the_nodes_of_a_subtree_did_was_compared(recording: Recording) -> None:
    sent = [(kind, name) for kind, name, _ in recording.outputs()]
    told = [value.data for _, name, value in recording.outputs() if name == "/told"]
    assert sent.count(("publish", "/results")) >= 5
    assert told[0] == "plan double"
    assert told.count("plan double") == 2, "the crashed node has published it again"
    assert "answer half" in told
    assert any("did not answer /never in time" in text for text in told)
    assert len(starts_of(recording)) == 3


def test_messages_and_calls_inside_are_not_in_the_journal_as_inputs_but_made_by_the_replayed_nodes() -> None:
    recording = execute(work, clock="virtual")
    publishers = {entry[4:6] for entry in kinds(recording, "publisher")}
    assert publishers == {("/numbers", "/source")}
    inner = {(entry[1], entry[2]) for entry in kinds(recording, "inner")}
    assert inner == {("publish", "/doubled"), ("publish", "/plan"), ("call", "/half"), ("call", "/never")}
    assert kinds(recording, "request") == []
    for entry in kinds(recording, "inner"):
        recording.entries[recording.entries.index(entry)] = (*entry[:3], "something else")
    verdict = replay(recording, every=True)
    assert verdict.equal, "what passes inside is made anew"
    assert {one.name for one in verdict.inner} == {"/doubled", "/plan", "/half", "/never"}


def test_a_planted_change_of_a_constant_in_one_node_is_found_at_its_first_effect_at_the_border() -> None:
    recording = execute(work, clock="virtual")
    verdict = replay(recording, changed="doubler", node=LowLimit)
    (inside,) = (one for one in verdict.inner if one.name == "/doubled")
    assert (inside.recorded, inside.replayed, inside.time) == (60, 30, 0.3)
    first = verdict.differences[0]  # 2 * (1 + ... + 32) is the first sum above 1000
    assert (first.kind, first.name, first.number, first.time) == ("publish", "/results", 0, 0.32)
    assert (first.recorded, first.replayed) == (Int32(data=1), "nothing")
    assert not verdict.equal


def test_a_change_that_does_not_reach_the_border_is_told_of_and_counts_as_equal(recording: Recording) -> None:
    verdict = replay(recording, changed="/doubler", node=Twice)
    assert verdict.equal
    assert [one.name for one in verdict.inner] == ["/doubled"]


def test_it_has_to_be_said_which_node_of_a_subtree_is_changed(recording: Recording) -> None:
    with pytest.raises(ReplayError, match=r"has several nodes: say which one is changed; it has /doubler, /summer"):
        replay(recording, parameters={"factor": 3})
    with pytest.raises(ReplayError, match=r"world/team has no node source; it has /doubler, /summer"):
        replay(recording, changed="source", parameters={"factor": 3})
    verdict = replay(recording, changed="doubler", parameters={"factor": 3})
    assert verdict.differences[0].name == "/results"


PLACES = [
    ("hero", "others"),
    ("hero",),
    ("others",),
    ("hero", "others", "commander"),
    ("hero", "commander"),
    ("commander", "others"),
]


class Commander(Visitor):
    """Asks the hero for everything by itself."""

    told = publishes(TOLD)

    @background
    async def visits(self) -> None:
        await self.clock.sleep(0.2)
        for text in await self.visit():
            self.told(String(data=text))


async def story_of(inside: Iterable[str]) -> Recording:
    nodes = {"others": OTHERS, "hero": HERO, "commander": Child(Commander)}
    team = Supervisor("team", children=[nodes[name] for name in inside])
    tree = Supervisor("world", children=[*(node for name, node in nodes.items() if name not in inside), team])
    journal = Journal("system/world/team")
    async with run(tree, Visitor, observers=(journal,), sinks=(), seed=5) as system:
        await lived(system, 0.3)
        system.crash(Others, RuntimeError("struck as well"))
        await lived(system, 0.2)
    return journal.recording("system/world/team")


@pytest.mark.parametrize("clock", CLOCKS)
@pytest.mark.parametrize("inside", PLACES, ids="+".join)
def test_wherever_the_border_is_drawn_the_nodes_inside_do_the_same_again(inside: tuple[str, ...], clock: Clock) -> None:
    verdict = replay(execute(lambda: story_of(inside), clock=clock))
    assert (verdict.differences, verdict.inner, verdict.lacking) == ((), (), "")
    assert verdict.compared > 100

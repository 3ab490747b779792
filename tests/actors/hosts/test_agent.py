"""One session of an agent, with a tree and processes that do what the test says."""

from __future__ import annotations

import asyncio
from collections.abc import Callable
from typing import Any

from actors.errors import ProcessDied
from actors.hosts import agent as agents
from actors.hosts.agent import Agent
from actors.hosts.messages import (
    Hello,
    Launch,
    Launched,
    LeaseGrant,
    LeaseRequest,
    Leaving,
    ProcessEnded,
    ProcessEvent,
    ProcessRequest,
    Signaled,
    Watched,
)
from actors.processes.messages import CrashAsked, Line, Opaque, Ready, StopAsked
from actors.processes.pickling import pack, unpack
from tests.actors.supervision.kit import settle, virtual
from tests.facts import lacks


class Tree:
    """The other end: keeps what the agent sends."""

    def __init__(self) -> None:
        self.got: list[Any] = []
        self.unsent = 0
        self.closed = False

    def send(self, value: object) -> None:
        self.got.append(value)

    def close(self) -> None:
        self.closed = True

    def of(self, kind: type) -> list[Any]:
        return [value for value in self.got if isinstance(value, kind)]


class Process:
    """Keeps what is asked of it."""

    def __init__(self, number: int) -> None:
        self.id = 100 + number
        self.ended: asyncio.Future[Exception] = asyncio.get_running_loop().create_future()
        self.asked: list[object] = []

    def send(self, request: object) -> None:
        self.asked.append(request)

    def watch(self) -> None:
        self.asked.append("watch")

    def unwatch(self) -> None:
        self.asked.append("unwatch")

    def terminate(self) -> None:
        self.asked.append("terminate")

    def kill(self) -> None:
        self.asked.append("kill")
        if not self.ended.done():
            self.ended.set_result(ProcessDied(self.id, "killed"))


class Stage:
    """An agent with one session, whose lease is 4 s: it asks every 0.5 s, and steps down after 3 s."""

    def __init__(self) -> None:
        self.tree = Tree()
        self.processes: dict[int, Process] = {}
        self.takes: dict[int, Callable[[Any], None]] = {}
        self.refuse = False
        self.gate: asyncio.Event | None = None
        self.said: list[str] = []
        self.alarms: list[float | None] = []
        self.agent = Agent(self._launch, self.said.append, self.alarms.append)
        self.session = self.agent.session(self.tree, "robot")

    async def _launch(self, message: Launch, take: Callable[[Any], None]) -> Any:
        if self.gate is not None:
            await self.gate.wait()
        if self.refuse:
            raise OSError("no more processes")
        self.processes[message.number] = process = Process(message.number)
        self.takes[message.number] = take
        return process

    def hello(self) -> None:
        self.session.take(Hello(4.0))
        self.grant()

    def grant(self) -> None:
        self.session.take(LeaseGrant(self.tree.of(LeaseRequest)[-1].number))

    async def launch(self, number: int = 1) -> None:
        self.session.take(Launch(number, ("top", "away"), 5.0, b"order"))
        await settle()


@virtual
async def test_a_session_asks_for_its_lease_at_once_and_eight_times_while_it_lasts() -> None:
    stage = Stage()
    begun = asyncio.get_running_loop().time()
    stage.hello()
    await asyncio.sleep(2.2)

    asked = [(round(one.at - begun, 3), one.left) for one in stage.tree.of(LeaseRequest)]

    assert asked[:3] == [(0.0, 0.0), (0.0, 3.0), (0.5, 2.5)]
    assert [at for at, _ in asked[2:]] == [0.5, 1.0, 1.5, 2.0]
    assert stage.alarms[-1] == begun + 3.0


@virtual
async def test_without_a_new_lease_everything_is_killed_three_quarters_of_a_lease_after_it_was_asked_for() -> None:
    stage = Stage()
    stage.hello()
    await stage.launch()
    await asyncio.sleep(2.99)
    assert stage.processes[1].asked == []

    await asyncio.sleep(0.02)

    assert stage.processes[1].asked == ["kill"]
    assert [str(one.how) for one in stage.tree.of(ProcessEnded)] == ["process 101 has ended: killed"]
    assert stage.tree.closed
    assert stage.session.ended.done()
    assert stage.alarms[-1] is None
    assert lacks(stage.said[-1], "lease 1 robot killed") == []
    asked = len(stage.tree.got)
    stage.session.take(Launch(2, ("top", "other"), 5.0, b"order"))  # it was on its way
    await asyncio.sleep(10.0)
    assert len(stage.tree.got) == asked
    assert list(stage.processes) == [1]


@virtual
async def test_a_session_that_runs_nothing_ends_with_its_lease_without_a_word() -> None:
    stage = Stage()
    stage.hello()
    await asyncio.sleep(3.01)

    assert stage.session.ended.done()
    assert stage.said == ["a tree of robot is connected"]


@virtual
async def test_a_lease_that_is_renewed_goes_on() -> None:
    stage = Stage()
    stage.hello()
    await stage.launch()
    for _ in range(20):
        await asyncio.sleep(0.5)
        stage.grant()

    assert stage.processes[1].asked == []


@virtual
async def test_nothing_is_launched_without_a_lease() -> None:
    stage = Stage()
    await stage.launch(1)
    stage.session.take(Hello(4.0))
    await stage.launch(2)

    refused = [str(one.how) for one in stage.tree.of(ProcessEnded)]
    assert refused == ["process 0 has ended: its agent takes no more processes"] * 2
    assert stage.processes == {}


@virtual
async def test_requests_and_signals_reach_their_process_and_events_the_tree() -> None:
    stage = Stage()
    stage.hello()
    await stage.launch()
    crash = pack(CrashAsked(("top", "away"), OSError("x")))
    for message in (
        ProcessRequest(1, crash),
        Watched(1, True),
        Watched(1, False),
        Signaled(1, False),
        ProcessRequest(7, b"nobody"),
    ):
        stage.session.take(message)
    stage.takes[1](Ready())
    stage.takes[1](Opaque(b"as it was packed"))
    stage.session.take(Signaled(1, True))
    await settle()

    assert stage.processes[1].asked == [Opaque(crash), "watch", "unwatch", "terminate", "kill"]
    assert stage.tree.of(Launched) == [Launched(1, 101)]
    assert [one.event for one in stage.tree.of(ProcessEvent)] == [pack(Ready()), b"as it was packed"]


@virtual
async def test_a_process_that_cannot_be_launched_has_ended() -> None:
    stage = Stage()
    stage.refuse = True
    stage.hello()
    await stage.launch()

    assert [str(one.how) for one in stage.tree.of(ProcessEnded)] == ["no more processes"]


@virtual
async def test_when_the_tree_is_gone_processes_stop_in_order_and_are_killed_at_the_end_of_the_lease() -> None:
    stage = Stage()
    stage.hello()
    await stage.launch(1)
    await stage.launch(2)
    await asyncio.sleep(1.0)

    stage.session.lost()
    stage.session.lost()
    stage.processes[1].ended.set_result(ProcessDied(101, "exit code 0"))
    await asyncio.sleep(1.0)
    assert stage.processes[1].asked == ["unwatch", StopAsked("the tree that it is a part of is gone")]
    assert "kill" not in stage.processes[2].asked
    await asyncio.sleep(1.01)

    assert stage.processes[2].asked[-1] == "kill"
    assert stage.session.ended.done()


@virtual
async def test_a_tree_that_goes_without_having_had_anything_leaves_nothing() -> None:
    stage = Stage()
    stage.session.lost()

    assert stage.session.ended.done()
    await stage.agent.stop()


@virtual
async def test_an_agent_that_ends_says_so_and_waits_for_its_processes() -> None:
    stage = Stage()
    stage.hello()
    await stage.launch()

    stopping = asyncio.create_task(stage.agent.stop())
    await settle()
    await stage.launch(2)
    assert not stopping.done()
    stage.processes[1].ended.set_result(ProcessDied(101, "exit code 0"))
    await stopping

    assert stage.tree.of(Leaving) == [Leaving()]
    assert [one.number for one in stage.tree.of(ProcessEnded)] == [2, 1]
    stage.session.leave()
    assert stage.tree.of(Leaving) == [Leaving()]


@virtual
async def test_what_is_launched_while_the_session_ends_ends_with_it() -> None:
    for lost in (True, False):
        stage = Stage()
        stage.gate = asyncio.Event()
        stage.hello()
        await stage.launch()
        if lost:
            stage.session.lost()
        else:
            stage.agent.kill()
        stage.gate.set()
        await settle()

        assert stage.processes[1].asked == ([StopAsked("the session ends")] if lost else ["kill"])
        stage.processes[1].kill()
        await settle()
        assert stage.session.ended.done()


@virtual
async def test_log_lines_that_a_slow_network_does_not_take_are_counted_and_nothing_else_is_lost() -> None:
    stage = Stage()
    stage.hello()
    await stage.launch()
    stage.tree.unsent = agents.MOST_UNSENT + 1
    line = Opaque(pack(Line(0.0, 20, "/talker", 1, "hello", {})), line=True)

    stage.takes[1](line)
    stage.takes[1](line)
    stage.takes[1](Opaque(pack(Ready())))
    stage.tree.unsent = 0
    stage.takes[1](line)

    events = [unpack(one.event) for one in stage.tree.of(ProcessEvent)]
    assert events[0] == Ready()
    assert (events[1].event, events[1].node, events[1].fields["lines"]) == ("log lines were lost", "top/away", 2)
    assert events[2].event == "hello"
    assert len(events) == 3

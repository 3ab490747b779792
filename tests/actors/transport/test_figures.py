"""What a process tells of itself, and that it tells nothing while nobody watches."""

from __future__ import annotations

import asyncio
import builtins
import os
import resource
import sys
import time
from typing import Any

import pytest

from actors import Child, Node, QoS, Service, every
from actors.interfaces.std_msgs.msg import Int32
from actors.interfaces.std_srvs.srv import SetBool, SetBool_Request, SetBool_Response
from actors.transport.figures import FIGURES, NodeFigures, ProcessFigures
from actors.transport.keyed.protocol import Delivery
from tests.actors.transport.hosts import Hosts
from tests.actors.transport.test_bridge_topics import NUMBERS_KEY, Listener, Talker
from tests.stage import NUMBERS

pytestmark = pytest.mark.virtual

SWITCH = Service(SetBool, "switch")


async def test_nothing_is_sent_and_shown_until_somebody_watches_and_after_the_last_has_gone(hosts: Hosts) -> None:
    rig, desk = await hosts.start(Talker), await hosts.start(Node)
    await rig.advance(5.0)
    assert hosts.network.puts == 0
    assert not any("figures" in token for token in hosts.network.tokens)

    async with desk.me.subscribe(FIGURES) as told:
        await rig.quiet()
        assert hosts.network.puts == 1, "at once"
        await rig.advance(3.5)
        assert hosts.network.puts == 4, "and then every second"
        first = await anext(told)
    await rig.advance(5.0)
    assert hosts.network.puts == 4
    assert [node.name for node in first.nodes] == ["/talker", "/rig"]


async def test_a_subscription_without_an_end_is_one_of_the_greatest_depth_that_can_be_told(hosts: Hosts) -> None:
    class Greedy(Node):
        @NUMBERS.on(qos=QoS(depth=2**33))
        def take(self, message: Int32) -> None: ...

    rig, desk = await hosts.start(Greedy), await hosts.start(Node)
    probe = desk.probe(FIGURES)
    await rig.advance(2.5)
    told = [figures for figures in probe if figures.session == hosts.ends[rig].session]
    assert [figures.nodes[0].queues[0].depth for figures in told] == [2**32 - 1] * 3


async def test_a_second_watcher_changes_nothing_for_the_first(hosts: Hosts) -> None:
    rig, desk, lab = await hosts.start(Talker), await hosts.start(Node), await hosts.start(Node)
    first = desk.probe(FIGURES)
    await rig.advance(1.5)
    second = lab.probe(FIGURES)
    await rig.advance(1.0)
    of_rig = hosts.ends[rig].session
    assert [figures.session for figures in first if figures.session == of_rig] == [of_rig] * 3
    assert [figures.session for figures in second if figures.session == of_rig] == [of_rig]


async def test_the_figures_are_those_of_the_process_and_of_its_nodes(hosts: Hosts) -> None:
    rig, desk = await hosts.start(Child(Listener, name="ear", namespace="head"), Talker), await hosts.start(Node)
    probe = desk.probe(FIGURES)
    await rig.advance(0.5)
    rig.crash("ear", RuntimeError("ordered"))
    await rig.advance(2.0)

    (*_, last) = [figures for figures in probe if figures.session == hosts.ends[rig].session]
    assert (last.process, last.unreadable) == (os.getpid(), 0)
    assert 0 < last.memory < 2 * resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * 1024
    assert 0 < last.cpu <= time.process_time()
    assert last.program
    by_name = {node.name: node for node in last.nodes}
    ear = by_name["/head/ear"]
    assert (ear.state, ear.incarnation, ear.restarts, ear.waiting, ear.inbox_age) == ("running", 2, 1, 0, 0.0)
    assert by_name["/talker"].restarts == 0


async def test_a_node_of_a_process_of_its_own_is_told_of_by_that_process_only(hosts: Hosts) -> None:
    rig, desk = await hosts.start(Talker, Listener), await hosts.start(Node)
    rig.state(Listener).process = 4711  # as of a child with process=True
    probe = desk.probe(FIGURES)
    await rig.advance(0.5)
    (first, *_) = [figures for figures in probe if figures.session == hosts.ends[rig].session]
    assert [node.name for node in first.nodes] == ["/talker", "/rig"]


class Busy(Node):
    """Answers slowly, and neither listens nor ticks meanwhile."""

    @NUMBERS.on(qos=QoS(depth=2))
    def hear(self, number: Int32) -> None:
        pass

    @SWITCH.serve()
    async def switch(self, request: SetBool_Request) -> SetBool_Response:
        await self.clock.sleep(0.32)
        return SetBool.Response(success=True)

    @every(hz=10)
    def tick(self) -> None:
        pass


async def test_the_figures_of_a_node_are_those_of_its_handlers_timers_queues_and_services(hosts: Hosts) -> None:
    rig, desk = await hosts.start(Busy), await hosts.start(Node)
    probe = desk.probe(FIGURES)

    def told() -> NodeFigures:
        nodes = [node for figures in probe for node in figures.nodes if node.name == "/busy"]
        return nodes[-1]

    await rig.advance(0.85)
    asked = asyncio.ensure_future(rig.call(SWITCH, SetBool.Request()))
    await rig.quiet()
    for value in range(5):
        rig.publish(NUMBERS, Int32(data=value))
    await rig.advance(0.2)

    (queue,) = told().queues
    assert (queue.topic, queue.received, queue.dropped, queue.waiting, queue.depth) == ("/numbers", 5, 3, 2, 2)
    assert queue.handler == "Busy.hear"
    assert ("/switch", 1, ("/rig",)) in [(one.service, one.calls, one.clients) for one in told().services]
    assert [(timer.handler, timer.hz, timer.fired) for timer in told().timers] == [("tick", 10.0, 8)]

    await rig.advance(1.0)
    await asked
    timer = told().timers[0]
    assert (timer.fired, timer.missed, timer.blocked) == (17, 2, 0), (
        "the tick of 0.9 s waits, those of 1.0 and 1.1 s are lost"
    )
    assert {one.handler: round(one.longest, 2) for one in told().handlers}["Busy.switch"] == 0.32


async def test_what_could_not_be_read_is_told(hosts: Hosts) -> None:
    rig, desk = await hosts.start(Listener), await hosts.start(Node)
    probe = desk.probe(FIGURES)
    hosts.ends[desk].outlet(NUMBERS_KEY, Delivery()).put(b"", b"no attachment")
    await rig.advance(1.5)
    assert [figures.unreadable for figures in probe] == [0, 1]


async def test_a_watcher_that_is_there_first_is_told_by_those_who_come(hosts: Hosts) -> None:
    desk = await hosts.start(Node)
    probe = desk.probe(FIGURES)
    await hosts.start(Talker)
    await desk.quiet()
    assert len(probe) == 1


async def test_a_system_that_does_not_tell_its_memory_says_0(hosts: Hosts, monkeypatch: pytest.MonkeyPatch) -> None:
    real = builtins.open

    def without_proc(file: Any, *rest: Any, **more: Any) -> Any:
        if file == "/proc/self/statm":
            raise FileNotFoundError(file)
        return real(file, *rest, **more)

    rig, desk = await hosts.start(Talker), await hosts.start(Node)
    probe = desk.probe(FIGURES)
    await rig.quiet()
    monkeypatch.setattr(builtins, "open", without_proc)
    await rig.advance(1.5)
    assert [figures.memory > 0 for figures in probe] == [True, False]


async def test_the_program_is_its_module_without_arguments(hosts: Hosts, monkeypatch: pytest.MonkeyPatch) -> None:
    rig, desk = await hosts.start(Talker), await hosts.start(Node)
    monkeypatch.setattr(sys.modules["__main__"], "__spec__", None)
    monkeypatch.setattr(sys, "argv", ["/opt/arm.py", "--password", "mat"])
    probe = desk.probe(FIGURES)
    await rig.quiet()
    told: ProcessFigures = probe[0]
    assert told.program == "arm.py"

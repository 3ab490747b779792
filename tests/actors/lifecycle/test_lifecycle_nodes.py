"""Lifecycle nodes in a running system: L-01 to L-08, order by the tree, replay after a restart."""

from __future__ import annotations

import asyncio

import pytest

from actors import (
    Action,
    Child,
    Done,
    DynamicSupervisor,
    Node,
    Service,
    ServiceUnavailable,
    StartFailed,
    Steps,
    Supervisor,
    Topic,
    every,
    publishes,
    qos,
    subscribes,
)
from actors.errors import NodeRestarting, NotRunning
from actors.interfaces.example_interfaces.action import Fibonacci, Fibonacci_Feedback, Fibonacci_Goal, Fibonacci_Result
from actors.interfaces.lifecycle_msgs.msg import Transition, TransitionEvent
from actors.interfaces.lifecycle_msgs.srv import ChangeState, GetAvailableStates, GetAvailableTransitions, GetState
from actors.interfaces.std_msgs.msg import String
from actors.interfaces.std_srvs.srv import Trigger, Trigger_Request, Trigger_Response
from actors.lifecycle.machine import STATES, TRANSITIONS, HookResult, LifecycleState, TransitionRefused
from actors.lifecycle.node import LifecycleNode, bring_down, bring_up
from actors.supervision.running import RunningSupervisor
from actors.testing import Rig

OUT = Topic(String, "out")
CHANGE = Service(ChangeState, "/camera/change_state")
STATE = Service(GetState, "/camera/get_state")
AVAILABLE = Service(GetAvailableTransitions, "/camera/get_available_transitions")
EVENT = Topic(TransitionEvent, "/camera/transition_event", qos.TRANSITION_EVENT)


class Camera(LifecycleNode):
    out = publishes(OUT)
    refuses = ""
    breaks = ""

    async def on_start(self) -> None:
        self.seen: list[str] = []

    async def _run_hook(self, name: str, previous: LifecycleState) -> HookResult:
        self.seen.append(name)
        self.log.info("hook", hook=name)
        return await super()._run_hook(name, previous)

    async def on_configure(self, previous: LifecycleState) -> HookResult | None:
        if self.breaks == "configure":
            raise OSError("no such device")
        return HookResult.FAILURE if self.refuses == "configure" else None

    async def on_deactivate(self, previous: LifecycleState) -> HookResult | None:
        self.out(String(data="last words"))
        return None

    @every(hz=10)
    def frame(self) -> None:
        self.out(String(data="frame"))


class AutoCamera(Camera):
    autostart = "active"


async def change(rig: Rig, label: str) -> bool:
    return (await rig.call(CHANGE, ChangeState.Request(transition=Transition(label=label)))).success


async def test_an_inactive_node_says_nothing_and_an_active_one_does(rig: Rig) -> None:
    await rig.start(Camera)
    heard = rig.probe(OUT)
    await rig.advance(1.0)
    assert await change(rig, "configure")
    rig.node(Camera).out(String(data="too early"))
    await rig.advance(1.0)
    assert len(heard) == 0
    assert await change(rig, "activate")
    await rig.advance(1.0)
    assert len(heard) == 10
    assert await change(rig, "deactivate")
    await rig.advance(1.0)
    assert len(heard) == 11
    assert heard[-1].data == "last words"
    assert (await rig.call(STATE, GetState.Request())).current_state.label == "inactive"


async def test_an_impossible_transition_is_refused_and_changes_nothing(rig: Rig) -> None:
    await rig.start(Camera)
    assert not await change(rig, "activate")
    assert rig.node(Camera).state is LifecycleState.UNCONFIGURED
    with pytest.raises(TransitionRefused, match="unconfigured"):
        await rig.node(Camera).change_state("deactivate")
    offered = await rig.call(AVAILABLE, GetAvailableTransitions.Request())
    assert [one.transition.label for one in offered.available_transitions] == ["configure", "shutdown"]


async def test_failure_keeps_the_state_and_an_error_goes_through_on_fault(rig: Rig) -> None:
    await rig.start(Camera)
    camera = rig.node(Camera)
    camera.refuses = "configure"
    assert not await change(rig, "configure")
    assert camera.state is LifecycleState.UNCONFIGURED
    camera.refuses, camera.breaks = "", "configure"
    assert not await change(rig, "configure")
    assert camera.seen == ["on_configure", "on_configure", "on_error"]
    assert camera.state is LifecycleState.UNCONFIGURED
    assert any("no such device" in repr(line) for line in rig.logs)


async def test_transition_events_are_told(rig: Rig) -> None:
    await rig.start(Camera)
    events = rig.probe(EVENT)
    await change(rig, "configure")
    assert [(event.start_state.label, event.goal_state.label) for event in events.messages] == [
        ("unconfigured", "configuring"),
        ("configuring", "inactive"),
    ]


async def test_a_restarted_node_is_brought_to_the_state_last_asked_of_it(rig: Rig) -> None:
    await rig.start(Camera)
    await change(rig, "configure")
    await change(rig, "activate")
    rig.crash(Camera)
    await rig.settled()
    assert rig.incarnation(Camera) == 2
    assert rig.node(Camera).state is LifecycleState.ACTIVE
    assert rig.node(Camera).seen == ["on_configure", "on_activate"]
    heard = rig.probe(OUT)
    await rig.advance(0.5)
    assert len(heard) == 5


async def test_autostart_goes_to_active_before_the_next_sibling_starts(rig: Rig) -> None:
    await rig.start(Supervisor("cameras", children=[Child(AutoCamera, name="left"), Child(AutoCamera, name="right")]))
    hooks = [(line.node, line.fields["hook"]) for line in rig.logs if line.event == "hook"]
    assert hooks == [
        ("/left", "on_configure"),
        ("/left", "on_activate"),
        ("/right", "on_configure"),
        ("/right", "on_activate"),
    ]


async def test_all_are_configured_then_activated_in_order_and_brought_down_in_reverse(rig: Rig) -> None:
    system = await rig.start(Supervisor("cameras", children=[Child(Camera, name="left"), Child(Camera, name="right")]))
    await bring_up(system)
    await bring_down(system)
    hooks = [(line.node, line.fields["hook"].removeprefix("on_")) for line in rig.logs if line.event == "hook"]
    assert hooks == [
        ("/left", "configure"), ("/right", "configure"), ("/left", "activate"), ("/right", "activate"),
        ("/right", "deactivate"), ("/left", "deactivate"), ("/right", "cleanup"), ("/left", "cleanup"),
    ]  # fmt: skip


async def test_bring_up_names_the_node_that_does_not_come_up(rig: Rig) -> None:
    system = await rig.start(Supervisor("cameras", children=[Child(Camera, name="left"), Child(Camera, name="right")]))
    rig.system.nodes["cameras", "right"].node.refuses = "configure"  # type: ignore[union-attr]
    with pytest.raises(RuntimeError, match="/right: configure"):
        await bring_up(system)


async def test_the_end_of_the_node_runs_its_shutdown_hook(rig: Rig) -> None:
    await rig.start(AutoCamera)
    camera = rig.node(AutoCamera)
    await rig.system.stop()
    assert camera.seen[-1] == "on_shutdown"
    assert camera.state is LifecycleState.FINALIZED


class Busy(LifecycleNode):
    """Has an endpoint of every kind."""

    autostart = "active"
    out = publishes(OUT)
    others = subscribes(Topic(String, "others"))

    async def on_start(self) -> None:
        self.heard: list[str] = []

    @Topic(String, "words").on()
    def listen(self, message: String) -> None:
        self.heard.append(message.data)

    @Service(Trigger, "ask").serve()
    async def answer(self, request: Trigger_Request) -> Trigger_Response:
        await self.clock.sleep(5.0)
        return Trigger.Response(success=True)

    @Action(Fibonacci, "count").serve()
    async def count(self, goal: Fibonacci_Goal) -> Steps[Fibonacci_Feedback, Fibonacci_Result]:
        try:
            await self.clock.sleep(5.0)
        finally:
            self.heard.append("the goal is cleaned up")
        yield Done(Fibonacci.Result())


async def test_a_finalized_node_has_left_the_graph_but_for_its_standard_services(rig: Rig) -> None:
    await rig.start(Busy)
    heard = rig.probe(OUT)
    goal = await rig.send_goal(Action(Fibonacci, "count"), Fibonacci.Goal(order=1))
    await rig.quiet()
    shutdown = ChangeState.Request(transition=Transition(label="shutdown"))

    assert (await rig.call(Service(ChangeState, "/busy/change_state"), shutdown)).success

    assert (await goal.ended()).reason == "/busy has been shut down"
    with pytest.raises(NotRunning, match="/busy"):
        await rig.call(Service(Trigger, "ask"), Trigger.Request())
    rig.publish(Topic(String, "words"), String(data="too late"))
    busy = rig.node(Busy)
    busy.out(String(data="nobody hears this"))
    await rig.quiet()
    assert (busy.heard, len(heard)) == (["the goal is cleaned up"], 0)
    snapshot = rig.system.snapshot()
    assert {
        topic.name
        for topic in snapshot.topics
        for edge in (*topic.publishers, *topic.subscriptions)
        if edge.node == "/busy"
    } <= {"/busy/transition_event", "/parameter_events", "/rosout"}
    assert (await rig.call(Service(GetState, "/busy/get_state"), GetState.Request())).current_state.label == "finalized"
    assert not (
        await rig.call(
            Service(ChangeState, "/busy/change_state"), ChangeState.Request(transition=Transition(label="configure"))
        )
    ).success
    assert rig.incarnation(Busy) == 1


async def test_a_call_that_waits_for_a_node_that_is_shut_down_fails(rig: Rig) -> None:
    await rig.start(Busy)
    asked = asyncio.ensure_future(rig.call(Service(Trigger, "ask"), Trigger.Request(), timeout=60.0))
    await rig.advance(1.0)
    rig.publish(Topic(String, "words"), String(data="waits for the request before it"))
    busy = rig.node(Busy)
    shut = asyncio.ensure_future(busy.change_state("shutdown"))
    with pytest.raises(NotRunning, match="/busy has been shut down"):
        await asked
    assert await shut
    await rig.advance(10.0)
    assert busy.heard == []
    assert [message async for message in busy.others] == [], "a loop over a stream ends"


# -- the corners ---------------------------------------------------------------------------------------------------------


class Plain(LifecycleNode):
    """A managed node that says nothing about its states."""


async def test_a_node_without_hooks_goes_through_all_its_states(rig: Rig) -> None:
    await rig.start(Plain)
    await bring_up(rig.system)
    assert rig.node(Plain).state is LifecycleState.ACTIVE
    await bring_down(rig.system)
    assert rig.node(Plain).state is LifecycleState.UNCONFIGURED


async def test_bringing_down_goes_only_as_far_as_each_node_is_up(rig: Rig) -> None:
    await rig.start(Camera, Child(Camera, name="second"))
    await bring_up(rig.system, ["/camera"], to="inactive")
    await bring_down(rig.system)
    first, second = (rig.state(name).running for name in ("/camera", "/second"))
    assert first is not None
    assert second is not None
    assert getattr(first.node, "seen", None) == ["on_configure", "on_cleanup"]
    assert getattr(second.node, "seen", None) == []


async def test_a_shut_down_node_stays_finalized_to_its_end_and_runs_no_hook_again(rig: Rig) -> None:
    await rig.start(Camera)
    camera = rig.node(Camera)
    assert await change(rig, "shutdown")
    await rig.close()
    assert camera.state is LifecycleState.FINALIZED
    assert camera.seen == ["on_shutdown"]


async def test_a_node_that_cannot_be_brought_to_its_start_fails_to_start(rig: Rig) -> None:
    class Stubborn(AutoCamera):
        refuses = "configure"

    with pytest.raises(StartFailed, match=r"/stubborn could not be brought to active: configure did not succeed"):
        await rig.start(Stubborn)


async def test_states_and_the_whole_graph_of_transitions_are_told(rig: Rig) -> None:
    await rig.start(Camera)
    states = await rig.call(Service(GetAvailableStates, "/camera/get_available_states"), GetAvailableStates.Request())
    assert [(one.id, one.label) for one in states.available_states] == [(int(one), one.label) for one in STATES]
    graph = Service(GetAvailableTransitions, "/camera/get_transition_graph")
    told = (await rig.call(graph, GetAvailableTransitions.Request())).available_transitions
    assert [(one.start_state.label, one.transition.label, one.goal_state.label) for one in told] == [
        (edge.start.label, edge.label, edge.goal.label) for edge in TRANSITIONS
    ]


async def test_a_node_that_is_not_managed_has_no_states_to_ask_for(rig: Rig) -> None:
    await rig.start(Child(Node, name="camera"))
    with pytest.raises(ServiceUnavailable, match="/camera/get_state"):
        await rig.call(STATE, GetState.Request(), timeout=0.1)


async def test_two_who_bring_up_at_once_do_not_do_it_twice(rig: Rig) -> None:
    await rig.start(Camera)
    first, second = (asyncio.ensure_future(bring_up(rig.system, to="inactive")) for _ in range(2))
    await first
    await second
    assert rig.node(Camera).seen == ["on_configure"]


class Slow(LifecycleNode):
    """Takes a second to be configured; refuses a second time as an impossible transition would be."""

    async def on_configure(self, previous: LifecycleState) -> HookResult | None:
        await self.clock.sleep(1.0)
        return None


async def test_who_brings_up_may_be_canceled_and_the_transition_goes_on(rig: Rig) -> None:
    await rig.start(Slow)
    first, second = (asyncio.ensure_future(bring_up(rig.system, to="inactive")) for _ in range(2))
    await rig.advance(0.5)
    first.cancel()
    second.cancel()  # its own would have been refused: nobody is left to hear of it
    await rig.advance(1.0)
    assert first.cancelled()
    assert second.cancelled()
    assert rig.node(Slow).state is LifecycleState.INACTIVE


async def test_who_brings_up_a_node_that_ends_meanwhile_is_told(rig: Rig) -> None:
    class Doomed(LifecycleNode):
        @OUT.on()
        async def hear(self, message: String) -> None:
            await self.clock.sleep(0.4)

    await rig.start(Doomed)
    rig.publish(OUT, String())
    await rig.advance(0.1)
    rig.crash(Doomed)  # when the handler has ended, and before whatever is asked from now on
    task = asyncio.ensure_future(bring_up(rig.system))
    await rig.settled()
    with pytest.raises(NodeRestarting):
        await asyncio.wait_for(task, 10.0)
    assert rig.node(Doomed).state is LifecycleState.UNCONFIGURED


async def test_who_brings_up_a_node_whose_transition_never_ends_is_told_of_its_end(rig: Rig) -> None:
    class Hanging(Slow):
        async def on_configure(self, previous: LifecycleState) -> HookResult | None:
            await asyncio.get_running_loop().create_future()
            return None

    await rig.start(Child(Hanging, stop=1.0))
    task = asyncio.ensure_future(bring_up(rig.system, to="inactive"))
    await rig.advance(0.5)
    await rig.system.stop("enough")
    with pytest.raises(NotRunning, match="enough"):
        await asyncio.wait_for(task, 10.0)


async def test_a_publisher_that_is_made_on_the_way_up_waits_for_the_activation_too(rig: Rig) -> None:
    class Late(LifecycleNode):
        async def on_configure(self, previous: LifecycleState) -> HookResult | None:
            self.out = self.publisher(OUT)
            self.out(String(data="too early"))
            return None

    await rig.start(Late)
    heard = rig.probe(OUT)
    await bring_up(rig.system)
    rig.node(Late).out(String(data="in time"))
    assert [message.data for message in heard] == ["in time"]


async def test_a_node_that_will_not_rest_goes_on_as_it_was(rig: Rig) -> None:
    class Restless(AutoCamera):
        async def on_deactivate(self, previous: LifecycleState) -> HookResult | None:
            return HookResult.FAILURE

    await rig.start(Child(Restless, name="camera"))
    assert not await change(rig, "deactivate")
    assert rig.node(Restless).state is LifecycleState.ACTIVE
    heard = rig.probe(OUT)
    await rig.advance(1.0)
    assert len(heard) == 10, "and not twice as often"


async def test_a_service_of_a_lifecycle_node_may_be_awaited_before_the_node_has_been_started(rig: Rig) -> None:
    state = Service(GetState, "/late/get_state")
    late = DynamicSupervisor("lates", Child(LifecycleNode, name="late"))
    await rig.start(Supervisor("root", children=[late]))
    waiting = asyncio.ensure_future(rig.me.wait_for(state, Service(GetState, "/later/get_state"), timeout=2.0))
    gone = asyncio.ensure_future(rig.me.wait_for(Service(GetState, "/never/get_state"), timeout=0.1))
    await rig.advance(1.0)
    with pytest.raises(TimeoutError):
        await gone
    assert not waiting.done()

    root = rig.system.supervisor
    assert root is not None
    lates = root.life("lates")
    assert isinstance(lates, RunningSupervisor)
    for name in ("never", "late", "later"):
        await lates.spawn(name=name)
    await waiting

    assert (await rig.call(state, GetState.Request())).current_state.label == "unconfigured"

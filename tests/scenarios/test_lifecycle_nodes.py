"""Lifecycle nodes in a running system: L-01 to L-08, order by the tree, replay after a restart."""

from __future__ import annotations

import pytest

from actors import Child, Service, Supervisor, Topic, every, publishes, qos
from actors.interfaces.lifecycle_msgs.msg import Transition, TransitionEvent
from actors.interfaces.lifecycle_msgs.srv import ChangeState, GetAvailableTransitions, GetState
from actors.interfaces.std_msgs.msg import String
from actors.lifecycle import HookResult, LifecycleState, TransitionRefused
from actors.lifecycle_node import LifecycleNode, bring_down, bring_up
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


async def test_L_04_an_inactive_node_says_nothing_and_an_active_one_does(rig: Rig) -> None:
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


async def test_L_03_an_impossible_transition_is_refused_and_changes_nothing(rig: Rig) -> None:
    await rig.start(Camera)
    assert not await change(rig, "activate")
    assert rig.node(Camera).state is LifecycleState.UNCONFIGURED
    with pytest.raises(TransitionRefused, match="unconfigured"):
        await rig.node(Camera).change_state("deactivate")
    offered = await rig.call(AVAILABLE, GetAvailableTransitions.Request())
    assert [one.transition.label for one in offered.available_transitions] == ["configure", "shutdown"]


async def test_L_08_failure_keeps_the_state_and_an_error_goes_through_on_fault(rig: Rig) -> None:
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


async def test_L_07_all_are_configured_then_activated_in_order_and_brought_down_in_reverse(rig: Rig) -> None:
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
    rig.system.nodes["cameras", "right"].core.node.refuses = "configure"  # type: ignore[union-attr]
    with pytest.raises(RuntimeError, match="/right: configure"):
        await bring_up(system)


async def test_L_06_the_end_of_the_node_runs_its_shutdown_hook(rig: Rig) -> None:
    await rig.start(AutoCamera)
    camera = rig.node(AutoCamera)
    await rig.system.stop()
    assert camera.seen[-1] == "on_shutdown"
    assert camera.state is LifecycleState.FINALIZED

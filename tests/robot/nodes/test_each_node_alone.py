"""Each node of the robot by itself (E-11, E-12, F-03, F-04, F-05): alone, before the others, and with another in its place."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any, cast

import pytest

from actors import Child, Done, Node, Steps, Supervisor, SupervisorGaveUp, publishes
from actors.interfaces.geometry_msgs.msg import Twist
from actors.interfaces.std_srvs.srv import Trigger
from actors.testing import Rig
from robot import Robot
from robot.contracts import CMD_VEL, GAIT_STATUS, GOAL_REPORT, IMU, JOINT_STATES, SAFETY_STATE, STAND, TELEOP_CMD
from robot.geometry.planar import Pose2
from robot.run.tree_nodes import UnknownNode, changed, nodes_of, only
from tests.robot.stage import robot, twist, whole, without

NAMES = [child.name for child in nodes_of(whole())]


@pytest.mark.parametrize("name", NAMES)
async def test_each_node_runs_and_stops_without_the_others(rig: Rig, name: str) -> None:
    await rig.start(only(whole(), [name]))
    await rig.advance(1.0)
    assert [(state.identity.name, state.incarnation) for state in rig.system.nodes.values()] == [(name, 1), ("rig", 1)]


@pytest.mark.parametrize("name", NAMES)
async def test_each_node_may_be_the_first_and_works_with_those_that_come_later(rig: Rig, name: str) -> None:
    tree = whole()
    system = await rig.start(only(tree, [name]))
    await rig.advance(0.5)
    for child in nodes_of(tree):
        if child.name != name:
            await system.join(child)
    await rig.advance(0.3)
    reply = await rig.call(STAND, Trigger.Request())
    assert reply.success, reply.message
    await rig.advance(0.3)
    status, safety = rig.probe(GAIT_STATUS).last, rig.probe(SAFETY_STATE).last
    assert status is not None
    assert (status.goal in ("stand", "walk"), status.mode != "sit") == (True, True)
    assert safety is not None
    assert not safety.stopped
    assert rig.incarnation(name) == 1


def stand_in(kind: type[Node]) -> type[Node]:
    """Another class with the same contracts: it publishes nothing of its own and does nothing well, but answers everything."""
    declarations = kind.declarations
    body: dict[str, Any] = {"__module__": __name__}
    body |= {f"out_{number}": publishes(one.topic) for number, one in enumerate(declarations.publishers)}
    body |= {f"take_{number}": one.topic.on()(_ignore()) for number, one in enumerate(declarations.topics)}
    body |= {
        f"serve_{number}": one.service.serve()(_answer(one.service)) for number, one in enumerate(declarations.services)
    }
    body |= {f"work_{number}": one.action.serve()(_work(one.action)) for number, one in enumerate(declarations.actions)}
    return type(f"Other{kind.__name__}", (Node,), body)


def _ignore() -> Any:
    def ignore(self: Any, message: Any) -> None: ...

    return ignore


def _answer(service: Any) -> Any:
    async def answer(self: Any, request: Any) -> Any:
        return service.response()

    return answer


def _work(action: Any) -> Any:
    async def work(self: Any, goal: Any) -> Steps[Any, Any]:
        await self.clock.sleep(0.1)
        yield Done(action.result())

    return work


@pytest.mark.parametrize("name", NAMES)
async def test_each_node_can_be_replaced_by_another_class_with_the_same_contracts(rig: Rig, name: str) -> None:
    tree = whole()

    def other(child: Child) -> Child:
        if child.name != name:
            return child
        assert isinstance(child.factory, type)
        return Child(stand_in(child.factory), name=name, stop=child.stop)

    await rig.start(changed(tree, other))
    await rig.advance(0.3)
    assert {state.incarnation for state in rig.system.nodes.values()} == {1}
    core = rig.state(name).running
    assert core is not None
    assert type(core.node).__name__.startswith("Other")


async def test_a_sensor_driver_is_exchanged_while_the_others_run(rig: Rig) -> None:
    tree = robot()
    system = await rig.start(without(tree, "proprioception"))
    (driver,) = nodes_of(only(tree, ["proprioception"]))
    imu, joints = rig.probe(IMU), rig.probe(JOINT_STATES)
    first = await system.join(driver)
    await rig.advance(0.5)
    await system.leave(first)
    heard = len(imu)
    await rig.advance(0.05)
    assert len(imu) == heard
    await system.join(driver)
    await rig.advance(0.5)
    assert len(imu) >= heard + 99
    assert len(joints) >= heard + 99
    assert rig.incarnation("gait") == 1


async def test_another_subscriber_joins_without_a_change_to_the_others(rig: Rig) -> None:
    class Counter(Node):
        seen = 0

        @JOINT_STATES.on()
        def count(self, message: Any) -> None:
            self.seen += 1

    system = await rig.start(robot())
    await system.join(Child(Counter))
    await rig.advance(1.0)
    assert rig.node(Counter).seen == pytest.approx(200, abs=2)


def test_the_roles_of_the_tutorial_are_in_the_tree() -> None:
    roles = {
        "sensor processing": {"proprioception", "lidar", "localizer"},
        "path planning": {"navigation"},
        "motor control": {"motors", "gait"},
        "user interaction": {"robot_controller", "robot_status"},
        "reasoning": {"patrol"},
        "system monitoring": {"safety_monitor", "battery"},
    }
    for role, nodes in roles.items():
        assert nodes <= set(NAMES), role


def test_a_node_that_the_robot_does_not_have_is_named_with_the_closest_ones() -> None:
    with pytest.raises(UnknownNode, match="there is no node 'gate'; did you mean gait"):
        only(whole(), ["gate"])
    with pytest.raises(UnknownNode, match="there is no node 'xyzzy'; there are: motors, "):
        only(whole(), ["xyzzy"])
    left = only(whole(), ["/gait", "motors"])
    assert [child.name for child in nodes_of(left)] == ["motors", "gait"]
    assert [child.name for child in left.children] == ["control"]


# -- the tree -------------------------------------------------------------------------------------------------------------------


RESTARTED = {
    "motors": ["motors"],
    "proprioception": ["proprioception"],
    "gait": ["gait"],
    "battery": ["battery"],
    "safety_monitor": ["safety_monitor"],
    "robot_controller": ["robot_controller"],
    "lidar": ["lidar"],
    "scan_correction": ["scan_correction"],
    "heading": ["heading"],
    "map_server": ["map_server"],
    "localizer": ["localizer"],
    "frames": ["frames"],
    "robot_state_publisher": ["robot_state_publisher"],
    "camera": ["camera"],
    "image_compressor": ["image_compressor"],
    "detector": ["detector"],
    "calibration": ["calibration"],
    "depth_cameras": ["depth_cameras"],
    "elevation": ["elevation"],
    "navigation": ["navigation"],
    "docking": ["docking"],
    "tutorial_walks": ["tutorial_walks"],
    "arm": ["arm"],
    "object_confirmation": ["object_confirmation"],
    "fetch": ["fetch"],
    "robot_status": ["robot_status"],
    "diagnostics": ["diagnostics"],
    "markers": ["markers"],
    "patrol": ["patrol"],
}
"""The node that crashes, and the nodes that have a second life then."""


def test_the_table_of_crashes_has_every_node_of_the_robot() -> None:
    assert list(RESTARTED) == NAMES


@pytest.mark.parametrize("name", NAMES)
async def test_a_node_that_fails_is_restarted_and_the_others_live_on(rig: Rig, name: str) -> None:
    await rig.start(whole())
    await rig.advance(0.3)
    rig.crash(name)
    await rig.settled()
    await rig.advance(0.3)
    lives = {state.identity.name: state.incarnation for state in rig.system.nodes.values() if state.incarnation > 1}
    assert lives == dict.fromkeys(RESTARTED[name], 2)
    safety = rig.probe(SAFETY_STATE).last
    assert safety is not None
    assert not safety.stopped


@pytest.mark.parametrize("name", ["motors", "proprioception"])
async def test_a_walk_in_physics_goes_on_through_a_crash_below_the_gait(rig: Rig, name: str) -> None:
    walker = Robot("empty", mission=[Pose2(1.5, 0.0)], seed=1)
    await rig.start(walker.tree)
    reports = rig.probe(GOAL_REPORT)
    await rig.until(lambda: walker.body.truth().position[0] > 0.5)
    rig.crash(name)
    await rig.until(lambda: len(reports) > 0, within=10.0)
    assert [(report.outcome, rig.incarnation(name)) for report in reports] == [("succeeded", 2)]
    assert not walker.body.truth().fallen


def test_the_table_of_concerns_in_the_docs_is_the_tree() -> None:
    page = (Path(__file__).parents[3] / "docs" / "reference" / "robot.md").read_text(encoding="utf-8")
    rows = page.split("| concern |")[1].split("\n\n")[0].splitlines()[2:]
    written = [name for row in rows for name in re.findall(r"`(\w+)`", row)]
    tree: list[str] = []
    for concern in whole().children:
        assert isinstance(concern, Supervisor)
        tree += [concern.name, *(child.name for child in concern.children)]
    assert written == tree


async def test_more_failures_than_allowed_end_the_tree_and_the_robot_sits(rig: Rig) -> None:
    tree = robot()
    await rig.start(tree)
    await rig.call(STAND, Trigger.Request())
    await rig.advance(3.0)
    cmd = rig.probe(CMD_VEL)
    rig.publish(TELEOP_CMD, twist(0.3))
    await rig.quiet()
    assert cmd.last != Twist()
    with rig.expect_failure(SupervisorGaveUp):
        for _ in range(4):
            rig.crash("navigation")
            await rig.advance(0.2)
        await rig.advance(5.0)
    assert cmd.last == Twist()
    body = cast("Any", next(nodes_of(tree))).args[0]
    assert body.truth().position[2] < 0.22
    assert not body.truth().fallen

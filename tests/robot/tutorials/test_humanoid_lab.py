"""The three-node lab (Y-21): what its checklist asks for, and a thousand ways in which it may go."""

from __future__ import annotations

from itertools import permutations
from math import cos, sin

import pytest

from actors import Child, Node
from actors.interfaces.geometry_msgs.msg import Point
from actors.testing import Rig, scenario
from actors.testing.faults import Crash, Delay, Duplicate, Lose, Reorder, SlowStart
from robot.interfaces.tutorials.humanoid_control_interfaces.msg import SensorData
from robot.interfaces.tutorials.humanoid_control_interfaces.srv import PlanTrajectory
from robot.tutorials.humanoid_lab import (
    MOTOR_COMMANDS,
    PLAN_TRAJECTORY,
    SENSOR_DATA,
    MotorController,
    Planner,
    SensorSimulator,
    steered,
    tree,
)


async def test_the_sensor_moves_on_its_ellipse_without_drift(rig: Rig) -> None:
    await rig.start(SensorSimulator)
    data = rig.probe(SENSOR_DATA)
    await rig.advance(101.0)
    first, late = data[0], data[1000]
    assert (first.position_x, first.position_y, first.velocity_x, first.velocity_y) == (0.0, 1.0, 2.0, -0.0)
    assert (late.position_x, late.position_y) == pytest.approx((2.0 * sin(100.0), cos(100.0)), abs=1e-9)
    for reading in data:
        assert (reading.position_x / 2.0) ** 2 + reading.position_y**2 == pytest.approx(1.0, abs=1e-9)
    readings = list(data)
    for before, middle, after in zip(readings[:100], readings[1:101], readings[2:102], strict=True):
        assert (after.position_x - before.position_x) / 0.2 == pytest.approx(middle.velocity_x, abs=1e-2)
        assert (after.position_y - before.position_y) / 0.2 == pytest.approx(middle.velocity_y, abs=1e-2)


async def test_a_trajectory_is_a_straight_line_of_ten_waypoints_in_the_map(rig: Rig) -> None:
    await rig.start(Planner)
    goal = Point(x=2.0, y=1.0, z=0.9)
    answer = await rig.call(PLAN_TRAJECTORY, PlanTrajectory.Request(goal=goal))
    poses = answer.trajectory.poses
    assert answer.success
    assert len(poses) == 10
    assert (poses[3].pose.position.x, poses[3].pose.position.y) == pytest.approx((0.6667, 0.3333), abs=1e-4)
    assert poses[3].pose.position.z == pytest.approx(0.3)
    assert poses[-1].pose.position == goal
    assert {pose.header.frame_id for pose in poses} == {"map"}


async def test_a_line_of_one_waypoint_is_the_goal(rig: Rig) -> None:
    await rig.start(Child(Planner, parameters={"waypoints": 1}))
    goal = Point(x=2.0, y=1.0)
    answer = await rig.call(PLAN_TRAJECTORY, PlanTrajectory.Request(goal=goal))
    assert [pose.pose.position for pose in answer.trajectory.poses] == [goal]


async def test_without_a_planner_the_motor_controller_says_once_a_second_that_it_waits(rig: Rig) -> None:
    await rig.start(MotorController)
    commands = rig.probe(MOTOR_COMMANDS)
    await rig.advance(30.0)
    assert not commands
    waiting = [record for record in rig.logs if "Planner service not available, waiting..." in record.event]
    assert [record.time for record in waiting] == pytest.approx(range(3, 31))
    assert rig.incarnation(MotorController) == 1


async def test_on_request_paths_begin_where_the_robot_is_and_steer_the_motors(rig: Rig) -> None:
    await rig.start(Child(Planner, parameters={"from_here": True}), Child(MotorController, parameters={"steer": True}))
    commands = rig.probe(MOTOR_COMMANDS)
    rig.publish(SENSOR_DATA, SensorData(position_x=2.0, position_y=0.0))
    await rig.advance(2.0)
    path = (await rig.call(PLAN_TRAJECTORY, PlanTrajectory.Request(goal=Point(x=2.0, y=1.0)))).trajectory
    assert path.poses[0].pose.position == Point(x=2.0, y=0.0)
    driven = commands[0]  # the goal is to the left
    assert (driven.left_motor_velocity, driven.right_motor_velocity) == pytest.approx((0.25, 0.75))
    nowhere = (await rig.call(PLAN_TRAJECTORY, PlanTrajectory.Request(goal=Point(x=2.0)))).trajectory
    assert steered(nowhere) == (0.0, 0.0)


async def test_the_lab_runs_for_35_seconds(rig: Rig) -> None:
    await rig.start(tree())
    data, commands = rig.probe(SENSOR_DATA), rig.probe(MOTOR_COMMANDS)
    await rig.advance(35.0)
    assert abs(len(data) - 350) <= 4
    assert abs(len(commands) - 17) <= 1
    assert all((c.left_motor_velocity, c.right_motor_velocity) == (0.5, 0.5) for c in commands)
    assert rig.node(Planner).position is not None
    assert not [record for record in rig.logs if record.level >= 40]


async def test_the_graph_of_the_lab_has_its_four_edges(rig: Rig) -> None:
    system = await rig.start(tree())
    await rig.advance(5.0)

    graph = system.snapshot()

    topics = {topic.name: topic for topic in graph.topics}
    assert [edge.node for edge in topics["/sensor/data"].publishers] == ["/sensor_simulator"]
    assert [edge.node for edge in topics["/sensor/data"].subscriptions] == ["/planner"]
    assert [edge.node for edge in topics["/motor/commands"].publishers] == ["/motor_controller"]
    (service,) = (one for one in graph.services if one.name == "/plan_trajectory")
    assert (service.server, service.clients) == ("/planner", ("/motor_controller",))
    drawn = [line.strip() for line in graph.to_dot().splitlines() if " -> " in line]
    assert sorted(drawn) == [
        '"node /motor_controller" -> "service /plan_trajectory" [style=dashed];',
        '"node /motor_controller" -> "topic /motor/commands";',
        '"node /sensor_simulator" -> "topic /sensor/data";',
        '"service /plan_trajectory" -> "node /planner" [style=dashed];',
        '"topic /sensor/data" -> "node /planner";',
    ]


@pytest.mark.parametrize("order", list(permutations((SensorSimulator, Planner, MotorController))))
async def test_the_lab_works_whatever_starts_first(order: tuple[type[Node], ...], rig: Rig) -> None:
    system = await rig.start(order[0])
    commands = rig.probe(MOTOR_COMMANDS)
    for node in order[1:]:
        await rig.advance(2.5)
        await system.join(Child(node))
    await rig.advance(20.0)
    assert len(commands) >= 9
    assert [record.event for record in rig.logs if record.level >= 40] == []


async def test_plans_resume_after_the_planner_was_away_and_nobody_else_restarts(rig: Rig) -> None:
    system = await rig.start(tree())
    commands = rig.probe(MOTOR_COMMANDS)
    await rig.advance(15.0)
    assert system.supervisor is not None
    await system.supervisor.terminate_child("planner")
    before = len(commands)
    await rig.advance(5.0)
    assert len(commands) <= before + 1
    await system.supervisor.restart_child("planner")
    await rig.advance(15.0)
    assert len(commands) >= before + 7
    assert rig.incarnation(SensorSimulator) == rig.incarnation(MotorController) == 1


async def test_a_planner_that_crashes_is_back_within_three_seconds(rig: Rig) -> None:
    await rig.start(tree())
    data, commands = rig.probe(SENSOR_DATA), rig.probe(MOTOR_COMMANDS)
    await rig.advance(9.0)
    rig.crash(Planner)
    seen, driven = len(data), len(commands)
    await rig.advance(3.0)
    assert len(data) == seen + 30
    assert len(commands) > driven
    assert rig.incarnation(Planner) == 2


async def _goes_on(rig: Rig) -> None:
    """What holds however it goes in 35 s: the lab drives, and still does at the end."""
    await rig.start(tree())
    commands = rig.probe(MOTOR_COMMANDS)
    await rig.advance(30.0)
    seen = len(commands)
    assert seen >= 10
    await rig.advance(5.0)
    assert len(commands) > seen


@scenario(seeds=40, faults=[Lose(), Delay(), Duplicate(), Reorder(), Crash(), SlowStart()])
async def test_whatever_is_lost_late_or_killed_the_lab_goes_on(rig: Rig) -> None:
    await _goes_on(rig)


@pytest.mark.slow(reason="a thousand seeds")
@scenario(seeds=1000, faults=[Lose(), Delay(), Duplicate(), Reorder(), Crash(), SlowStart()])
async def test_a_thousand_seeds(rig: Rig) -> None:
    await _goes_on(rig)

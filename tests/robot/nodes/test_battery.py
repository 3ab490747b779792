"""The battery in the robot: the service's contract, the state that evolves, levels, and goals that know of energy (S-10 to S-15, Z-08, Y-46)."""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise
from math import isnan

import pytest

from actors import Child, GoalAborted, Supervisor
from actors.errors import ProcessDied
from actors.interfaces.diagnostic_msgs.msg import DiagnosticStatus
from actors.interfaces.sensor_msgs.msg import BatteryState
from actors.interfaces.std_srvs.srv import Trigger
from actors.testing import Rig
from robot.contracts import (
    BATTERY_STATE,
    BATTERY_STATUS,
    CMD_VEL,
    DIAGNOSTICS,
    MOTOR_POWER,
    NAVIGATE_TO_POSE,
    STAND,
)
from robot.geometry.messages import pose_stamped
from robot.interfaces.nav2_msgs.action import NavigateToPose
from robot.interfaces.robactor_msgs.msg import BatteryStatus, MotorPower
from robot.model.actuators import ActuatorDesign
from robot.nodes.battery import Battery
from robot.planning.energy import EnergyGuard, walking_energy
from robot.planning.errors import ErrorCode
from robot.scenes.worlds import get_world
from robot.sim.battery import Pack
from robot.sim.kinematic import KinematicBody
from robot.sim.physics import PhysicsBody
from tests.figures.battery import CONTRACT
from tests.robot.stage import ahead, battery_status, robot, robot_around, without

WALKING = 304.0
"""W of motor power at 1.0 m/s."""


async def draw(rig: Rig, watts: float, seconds: float, *, charger: bool = False) -> None:
    for _ in range(round(seconds * 10)):
        rig.publish(MOTOR_POWER, MotorPower(mean=watts, charger=charger))
        await rig.advance(0.1)


def battery(percent: float) -> Child:
    return Child(Battery, args=(Pack(percent),))


def status(rig: Rig) -> BatteryStatus:
    last = rig.probe(BATTERY_STATUS).last
    assert last is not None
    return last


@pytest.mark.parametrize(("voltage", "percent", "health"), CONTRACT)
async def test_the_service_answers_the_tutorials_formula(rig: Rig, voltage: float, percent: float, health: str) -> None:
    node = battery(50.0)
    await rig.start(node)
    pack = node.args[0]
    assert isinstance(pack, Pack)
    pack.state = replace(pack.state, voltage=voltage)
    reply = await battery_status(rig)
    assert reply.voltage == pytest.approx(voltage, abs=1e-6)
    assert reply.percentage == pytest.approx(percent, abs=1e-4)
    assert reply.estimated_runtime_minutes == pytest.approx(1.2 * percent, abs=1e-3)
    assert (reply.health_status, reply.is_charging) == (health, False)


async def test_another_robots_battery_is_not_known(rig: Rig) -> None:
    await rig.start(battery(90.0))
    assert (await battery_status(rig)).percentage > 0.0
    unknown = await battery_status(rig, "robot_99")  # answered: an error would leave a caller of ROS 2 without a word
    assert "'robot_99'" in unknown.health_status and "'robot_01'" in unknown.health_status
    assert isnan(unknown.percentage) and isnan(unknown.voltage)


async def test_it_falls_under_load_and_rises_on_the_charger(rig: Rig) -> None:
    await rig.start(battery(60.0))
    rest = (await battery_status(rig)).voltage
    await draw(rig, WALKING, 10.0)
    walking = await battery_status(rig)
    assert walking.voltage < rest
    assert not walking.is_charging
    await draw(rig, 0.0, 10.0, charger=True)
    charging = await battery_status(rig)
    assert charging.voltage > rest
    assert charging.is_charging
    state = rig.probe(BATTERY_STATE).last
    assert state is not None
    assert state.power_supply_status == BatteryState.POWER_SUPPLY_STATUS_CHARGING
    assert state.current > 0.0


async def test_the_count_the_level_and_the_run_time_are_published_together(rig: Rig) -> None:
    await rig.start(battery(90.0))
    await draw(rig, WALKING, 120.0)
    now = status(rig)
    assert (now.level, now.charging) == ("good", False)
    assert now.percent == pytest.approx(100.0 * rig.probe(BATTERY_STATE).last.percentage)  # type: ignore[union-attr]
    assert now.mean_load == pytest.approx(WALKING + 120.0, rel=0.02)
    assert 60.0 < now.runtime / 60.0 < 80.0
    assert now.energy < now.runtime * now.mean_load / 3600.0  # a critical charge comes before 10.0 V


async def test_the_levels_have_hysteresis_so_a_border_is_crossed_once(rig: Rig) -> None:
    await rig.start(battery(30.05))
    levels = rig.probe(BATTERY_STATUS)
    await draw(rig, WALKING, 6.0)
    await draw(rig, 0.0, 30.0, charger=True)
    await draw(rig, WALKING, 6.0)
    seen = [message.level for message in levels]
    assert seen[0] == "good"
    assert seen[-1] == "low"
    assert sum(before != after for before, after in pairwise(seen)) == 1


async def test_a_battery_that_was_critical_is_so_after_a_crash_of_its_node(rig: Rig) -> None:
    await rig.start(battery(9.9))
    await draw(rig, WALKING, 0.5)
    assert status(rig).level == "critical"
    rig.crash(Battery)
    await rig.settled()
    await draw(rig, 0.0, 30.0, charger=True)
    assert status(rig).percent > 10.0
    assert status(rig).level == "critical"  # until there are 3 points more


async def test_a_battery_whose_process_was_killed_goes_on_with_the_charge_that_it_had(rig: Rig) -> None:
    """In a simulated process: each life gets a pack that is made anew, as 90 % full as it was declared."""
    await rig.start(Supervisor("hosts", children=[battery(90.0).replace(process=True)]))
    told = rig.probe(BATTERY_STATUS)
    await draw(rig, 2000.0, 120.0)
    assert told.last is not None
    before = told.last.percent
    assert before < 80.0
    with rig.expect_failure(ProcessDied):
        rig.system.kill_process("battery")
        await rig.until(lambda: rig.incarnation("battery") == 2)
    told.clear()
    await draw(rig, WALKING, 2.0)
    assert told.last is not None
    assert told.last.percent == pytest.approx(before, abs=1.0)


# -- goals and energy -----------------------------------------------------------------------------------------------------------


def test_a_walk_needs_the_energy_to_the_goal_and_back_to_the_dock() -> None:
    guard = EnergyGuard(0.7)
    assert guard.objection(1000.0, 1000.0) == ""  # nobody has said anything of a battery
    guard.heard(60.0, 50.0)
    assert guard.objection(10.0, 10.0) == ""
    far = 50.0 / walking_energy(1.0, 0.7)
    assert "battery too low" in guard.objection(0.5 * far, 0.5 * far)
    assert guard.objection(far, 1.0) == ""  # the way to the dock is always open


def test_below_20_percent_only_the_way_home_is_open_until_there_are_3_points_more() -> None:
    guard = EnergyGuard(0.7)
    for percent, refused in ((20.5, False), (19.9, True), (22.0, True), (23.1, False), (20.5, False)):
        guard.heard(percent, 50.0)
        assert bool(guard.objection(3.0, 3.0)) is refused, percent
        assert guard.objection(3.0, 0.5) == ""


async def test_with_a_critical_battery_a_goal_is_refused_with_the_reason_and_the_dock_is_not(rig: Rig) -> None:
    await rig.start(robot(percent=18.0))
    await rig.call(STAND, Trigger.Request())
    await rig.advance(1.0)
    with pytest.raises(
        GoalAborted, match=r"battery critical for new goals \(18 %\): only the way to the dock is open"
    ) as refused:
        await (await rig.send_goal(NAVIGATE_TO_POSE, NavigateToPose.Goal(pose=ahead("empty", 3.0))))
    assert ErrorCode.of(refused.value.result) == ErrorCode.LOW_BATTERY
    home = pose_stamped(get_world("empty").dock, BatteryState().header.stamp)
    goal = await rig.send_goal(NAVIGATE_TO_POSE, NavigateToPose.Goal(pose=home))
    await rig.advance(0.5)
    assert not goal.done
    await goal.cancel()
    await rig.advance(0.2)


async def test_a_goal_that_runs_when_the_battery_gets_critical_ends_safely(rig: Rig) -> None:
    await rig.start(robot(percent=90.0))
    await rig.call(STAND, Trigger.Request())
    await rig.advance(2.5)
    goal = await rig.send_goal(NAVIGATE_TO_POSE, NavigateToPose.Goal(pose=ahead("empty", 5.0)))
    await rig.advance(1.5)
    cmd = rig.probe(CMD_VEL)
    rig.publish(BATTERY_STATUS, BatteryStatus(level="low", percent=19.0, energy=30.0))
    with pytest.raises(GoalAborted, match="battery critical for new goals"):
        await goal
    await rig.advance(0.1)
    assert cmd.last is not None
    assert (cmd.last.linear.x, cmd.last.angular.z) == (0.0, 0.0)


async def test_an_empty_pack_cuts_the_drives_off_and_only_a_charger_brings_them_back(rig: Rig) -> None:
    await rig.start(battery(0.02))
    await draw(rig, WALKING, 1.0)
    assert status(rig).supply == pytest.approx((9.0 - 48.4 * 0.005) / 11.1, abs=0.005)  # 424 W through 5 mOhm
    await draw(rig, WALKING, 5.0)
    assert status(rig).supply == 0.0
    await draw(rig, 0.0, 60.0)
    assert status(rig).supply == 0.0
    await draw(rig, 0.0, 2.0, charger=True)
    assert status(rig).supply > 0.8
    said = [line for line in map(str, rig.logs) if "have" in line and "current" in line]
    assert [
        "battery empty: the drives have no current" in said[0],
        "charger: the drives have current again" in said[1],
    ] == [True, True]
    assert len(said) == 2


async def test_a_battery_node_that_fails_does_not_forget_that_the_drives_are_cut_off(rig: Rig) -> None:
    await rig.start(battery(0.01))
    await draw(rig, WALKING, 5.0)
    rig.crash(Battery)
    await rig.settled()
    rig.probe(BATTERY_STATUS).clear()
    await draw(rig, 0.0, 2.0)
    assert status(rig).supply == 0.0


async def test_a_standing_robot_whose_drives_lose_their_current_sinks_and_says_so(rig: Rig) -> None:
    body = KinematicBody(get_world("empty"), seed=1)
    await rig.start(without(robot_around(body), "battery"))
    await rig.call(STAND, Trigger.Request())
    await rig.advance(3.0)
    assert body.truth().position[2] > 0.45
    rig.publish(BATTERY_STATUS, BatteryStatus(level="good", percent=50.0, supply=0.0))
    told, diagnostics = rig.probe(MOTOR_POWER), rig.probe(DIAGNOSTICS)
    await rig.advance(4.0)
    assert body.truth().position[2] < 0.2
    assert told.last is not None
    assert not told.last.supplied
    assert diagnostics.last is not None
    motors = next(one for one in diagnostics.last.status if one.name == "robot: motors")
    assert (motors.level, motors.message) == (DiagnosticStatus.ERROR, "no current: the battery is empty")


async def test_the_temperatures_of_hot_drives_are_published_and_warned_of(rig: Rig) -> None:
    body = PhysicsBody(get_world("empty"), seed=1, actuators=ActuatorDesign(derate_from=25.5, derate_to=200.0))
    await rig.start(robot_around(body))
    await rig.call(STAND, Trigger.Request())
    told, diagnostics = rig.probe(MOTOR_POWER), rig.probe(DIAGNOSTICS)
    await rig.advance(8.0)
    assert told.last is not None
    assert len(told.last.temperature) == 12
    assert max(told.last.temperature) > 25.5
    assert 0.9 < told.last.torque_left < 1.0
    assert diagnostics.last is not None
    motors = next(one for one in diagnostics.last.status if one.name == "robot: motors")
    assert motors.level == DiagnosticStatus.WARN
    assert "hot: 99% of the torque is left" in motors.message or "hot: 100% of the torque is left" in motors.message

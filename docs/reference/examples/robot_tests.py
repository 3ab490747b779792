"""Tests of the robot: a gait that dies on the way, and a walk that is pushed with a sensor that lies."""

from actors.testing import Rig
from robot import Robot
from robot.contracts import GOAL_REPORT
from robot.scenes.scene import Box, Pose2, Scene
from robot.testing import Conditions, Trial


async def test_the_death_of_its_gait_does_not_keep_it_from_its_goal(rig: Rig) -> None:
    robot = Robot("warehouse", body="physics", mission=[Pose2(3.0, 0.0)], seed=1)
    await rig.start(robot.tree)
    reports = rig.probe(GOAL_REPORT)
    await rig.until(lambda: robot.body.truth().position[0] > 1.5)
    rig.crash("gait")
    await rig.until(lambda: len(reports) == 2)
    assert [report.outcome for report in reports] == ["aborted", "succeeded"] and rig.incarnation("gait") == 2
    truth = robot.body.truth()
    assert abs(truth.position[0] - 3.0) < 0.1 and not truth.fallen


def test_it_climbs_a_step_although_it_is_pushed_and_a_foot_feels_the_floor_all_the_time() -> None:
    step = Box(2.0, 0.0, 1.0, 4.0, height=0.05)
    world = Scene("step", bounds=(-5.0, -5.0, 5.0, 5.0), obstacles=(step,), start=Pose2(0.0, 0.0), dock=Pose2(0.0, 0.0))
    trial = Trial(1, world, Conditions(friction=0.6, payload=3.0))
    trial.stand_up()
    trial.spoil("one contact stuck closed")
    trial.run(1.0, (0.5, 0.0, 0.0))
    trial.body.push((0.0, 25.0, 0.0))  # N s, to the left
    record = trial.run(3.0)
    assert not trial.fallen
    assert trial.pose()[0] > 1.5  # m: its forefeet are on the step
    assert record.height.max() > 0.47 and record.tilt.max() < 0.3  # m, rad

"""The localizer over its lives: what it knew of the place, and what the odometry did meanwhile."""

from __future__ import annotations

import pytest

from actors import Backoff, Child
from actors.interfaces.std_srvs.srv import Trigger
from actors.testing import Rig
from robot import Robot
from robot.contracts import POSE, TELEOP_CMD, WALK
from robot.geometry.messages import from_pose
from robot.run.tree_nodes import changed
from tests.robot.stage import twist, without


def slow_to_return(child: Child) -> Child:
    """The localizer is away for 1.5 s when it has failed, as with a process that has to be started."""
    return child.replace(backoff=Backoff(1.5, 1.5, jitter=0.0)) if child.name == "localizer" else child


async def test_a_robot_that_walked_on_while_its_localizer_was_away_is_known_where_it_is(rig: Rig) -> None:
    walker = Robot("empty", body="kinematic", seed=1)
    await rig.start(changed(without(walker.tree, "lidar"), slow_to_return))
    poses = rig.probe(POSE)
    assert (await rig.call(WALK, Trigger.Request())).success
    for tick in range(60):  # 6 s, of which it is away from 4.5 to 6.0
        rig.publish(TELEOP_CMD, twist(0.6))
        await rig.advance(0.1)
        if tick == 44:
            rig.crash("localizer")
    rig.publish(TELEOP_CMD, twist(0.6))
    await rig.advance(0.4)
    assert rig.incarnation("localizer") == 2
    last, (x, y, _) = poses.last, walker.body.truth().position
    assert last is not None
    assert x > 1.5
    assert (from_pose(last.pose).x, from_pose(last.pose).y) == pytest.approx((x, y), abs=0.05)

"""What the map does not know: things dropped, things that close the way, things that walk (kinematic body, virtual time)."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np
import pytest

from actors import Child, GoalAborted, Node, every
from actors.testing import Rig
from robot.contracts import HUMANOID_NAVIGATE, NAVIGATE_TO_GOAL
from robot.geometry.planar import Pose2
from robot.scenes.scene import Box, Cylinder, Scene
from robot.scenes.worlds import get_world
from robot.sim.kinematic import KinematicBody
from tests.robot.navigation.navigation_sim import body_clearance
from tests.robot.stage import Legs, drop, humanoid, navigate, speed, standing_robot, true_pose

ROOM = Scene(
    "room",
    (-6.0, -5.0, 6.0, 5.0),
    (Box(0.0, -5.05, 12.2, 0.1), Box(0.0, 5.05, 12.2, 0.1), Box(-6.05, 0.0, 0.1, 10.2), Box(6.05, 0.0, 0.1, 10.2), Box(5.0, 4.0, 1.0, 0.6)),
    Pose2(-4.0, 0.0),
    Pose2(-4.0, 0.0),
)  # fmt: skip


class Watch:
    """The smallest distance of the true body to anything, looked at as time passes."""

    def __init__(self, rig: Rig, body: KinematicBody) -> None:
        self.rig, self.body, self.clearance = rig, body, math.inf

    async def until(self, done: Callable[[], bool], within: float = 60.0) -> None:
        end = self.rig.now + within
        while not done() and self.rig.now < end:
            await self.rig.advance(0.05)
            self.clearance = min(self.clearance, body_clearance(self.body.scene, true_pose(self.body)))
        assert done()


async def test_with_avoid_obstacles_a_box_on_the_line_is_walked_round_with_room_to_spare(rig: Rig) -> None:
    body = await standing_robot(rig, ROOM)
    drop(body, Box(0.0, 0.1, 0.6, 0.6))
    watch = Watch(rig, body)
    going = await rig.send_goal(HUMANOID_NAVIGATE, humanoid(4.0, 0.0, avoid=True))
    await watch.until(lambda: going.done)
    assert (await going).success
    assert watch.clearance >= 0.2


async def test_without_it_the_robot_goes_straight_and_aborts_before_the_box(rig: Rig) -> None:
    body = await standing_robot(rig, ROOM)
    going = await rig.send_goal(HUMANOID_NAVIGATE, humanoid(-1.0, 0.0, avoid=False))
    assert (await going).success
    drop(body, Box(2.0, 0.1, 0.6, 0.6))
    watch = Watch(rig, body)
    going = await rig.send_goal(HUMANOID_NAVIGATE, humanoid(4.0, 0.0, avoid=False))
    await watch.until(lambda: going.done)
    with pytest.raises(GoalAborted, match="PathBlocked: something stands on the straight way") as aborted:
        await going
    x, y, _ = aborted.value.result.final_position
    assert abs(y) < 0.05, "it kept to the line"
    assert x > -0.5
    await rig.advance(1.0)
    assert speed(body) < 0.02
    assert rig.node(Legs).touched == set()


async def test_a_box_dropped_on_the_path_in_front_of_the_robot_is_avoided(rig: Rig) -> None:
    body = await standing_robot(rig)
    watch, box = Watch(rig, body), Box(5.0, 0.5, 0.5, 0.5)
    going = await rig.send_goal(NAVIGATE_TO_GOAL, navigate(8.8, 0.5, math.pi / 2))
    await watch.until(lambda: true_pose(body).x > 2.5)
    drop(body, box)
    await watch.until(lambda: going.done)
    assert (await going).success
    assert watch.clearance >= 0.15


async def test_a_blocked_way_aborts_by_name_and_a_retry_succeeds_once_it_is_open(rig: Rig) -> None:
    body = await standing_robot(rig, "corridor")
    going = await rig.send_goal(NAVIGATE_TO_GOAL, navigate(8.0, 0.0))
    await rig.advance(3.0)
    drop(body, Box(6.0, 0.0, 0.4, 1.6))
    watch = Watch(rig, body)
    await watch.until(lambda: going.done)
    with pytest.raises(GoalAborted, match=r"PathBlocked: the way to .* is closed .*tried: clear, back_up, turn, wait"):
        await going
    assert watch.clearance > 0.05
    body.set_obstacles(get_world("corridor").obstacles)
    again = await rig.send_goal(NAVIGATE_TO_GOAL, navigate(8.0, 0.0))
    assert (await again).success


async def crossing(rig: Rig, seed: int) -> None:
    """Something crosses the robot's line at 0.5 m/s when the robot would be there, give or take a second."""
    rng = np.random.default_rng(seed)
    body = await standing_robot(rig, ROOM)
    where, when = rng.uniform(-1.5, 2.5), rng.uniform(-1.0, 1.0)
    when += rig.now + 1.0 + (where + 4.0) / 0.7
    way, radius = rng.uniform(math.pi / 4, 3 * math.pi / 4) * rng.choice([-1.0, 1.0]), rng.uniform(0.2, 0.35)

    class Walker(Node):
        @every(hz=50)
        def step(self) -> None:
            gone = 0.5 * (self.clock.now() - when)
            x, y = where + gone * math.cos(way), gone * math.sin(way)
            body.set_obstacles((*ROOM.obstacles, *([Cylinder(x, y, radius)] if abs(y) < 4.5 else [])))

    await rig.system.join(Child(Walker))
    watch = Watch(rig, body)
    going = await rig.send_goal(NAVIGATE_TO_GOAL, navigate(4.0, 0.0))
    await watch.until(lambda: going.done)
    assert (await going).success
    assert rig.node(Legs).touched == set()
    assert watch.clearance > 0.0


@pytest.mark.parametrize("seed", range(1))
async def test_something_that_crosses_at_half_a_meter_per_second_is_never_touched(rig: Rig, seed: int) -> None:
    await crossing(rig, seed)


@pytest.mark.slow(reason="fifty walks")
@pytest.mark.parametrize("seed", range(50))
async def test_fifty_crossings_without_contact(rig: Rig, seed: int) -> None:
    await crossing(rig, seed)

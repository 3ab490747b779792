"""Slopes: slowly where the map shows one, and over its crest without a fall."""

from __future__ import annotations

import numpy as np
import pytest

from robot.geometry.planar import Pose2
from robot.hardware.sensors import Sensors
from robot.model.actuators import ActuatorDesign
from robot.navigation.navigator import Navigator
from robot.navigation.navigator_config import NavigatorConfig
from robot.planning.grid import Grid
from robot.scenes.ramps import ramps
from robot.scenes.scene import Scene
from robot.testing import Conditions, Trial

HILL = ramps(20.0, height=0.625)
"""Its slope begins at x = 3."""


def fastest(scene: Scene, x: float) -> float:
    """The highest forward command of a robot that has been on its way for two seconds, and is at x now."""
    navigator = Navigator(Grid.from_scene(scene))
    navigator.set_goal(scene.places["behind"], start=Pose2(x - 1.0, 0.0))
    commands = [navigator.step(0.05 * tick, Pose2(x - 1.0 + 0.025 * tick, 0.0)).vx for tick in range(41)]
    return max(commands[-5:])


@pytest.mark.parametrize(("x", "slow"), [(1.0, False), (2.6, True), (4.0, True)])
def test_a_slope_that_the_map_shows_is_walked_on_slowly(x: float, slow: bool) -> None:
    speed = NavigatorConfig().slope_speed
    assert (fastest(HILL, x) <= speed + 1e-9) == slow
    level = Scene("level", HILL.bounds, HILL.obstacles, HILL.start, HILL.dock, places=HILL.places)
    assert fastest(level, x) > speed


@pytest.mark.slow(reason="a walk over a hill with real sensors")
def test_over_both_crests_the_body_stays_level_to_the_side() -> None:
    """Real sensors and drives. With feet that lift while another looks for the ground it rolls by 30 degrees and falls now and then."""
    pytest.importorskip("mujoco")
    conditions = Conditions(friction=0.6, delay=0.004, actuators=ActuatorDesign(), sensors=Sensors.of("real"))
    trial = Trial(1, HILL, conditions)
    trial.stand_up()
    end, rolls = HILL.places["behind"].x - 1.0, []
    while trial.pose()[0] < end and not trial.fallen:
        _, y, yaw = trial.pose()
        record = trial.run(0.05, (0.3, 0.0, float(np.clip(-1.5 * yaw - 0.8 * y, -0.5, 0.5))))
        rolls.append(np.degrees(np.abs(record.lean[:, 0])).max())
    assert not trial.fallen
    assert max(rolls) < 18.0  # 10 to 15 with six seeds

"""What a run is asked to do, and what a robot of another size cannot."""

from __future__ import annotations

from dataclasses import replace

import pytest

from cli.command import UsageError
from robot.model.bodies import BODIES
from robot.model.robot import SPOT, RobotModel
from robot.run.mission import get_mission
from robot.scenes.worlds import get_world

WIDE = replace(SPOT, name="wide", hips=((0.5, 0.9), (0.5, -0.9), (-0.5, 0.9), (-0.5, -0.9)))


@pytest.mark.parametrize("model", BODIES.values(), ids=lambda model: model.name)
def test_each_robot_that_is_shipped_has_room_in_the_warehouse(model: RobotModel) -> None:
    assert get_mission(None, None, get_world("warehouse"), model=model) == "patrol"


def test_a_robot_that_is_too_wide_for_a_world_is_refused_in_one_line_with_what_to_do() -> None:
    with pytest.raises(
        UsageError,
        match=r"^--robot wide: with 1\.50 x 2\.19 m it cannot reach patrol_\d in the world 'warehouse' .*take another --world",
    ):
        get_mission(None, None, get_world("warehouse"), model=WIDE)
    with pytest.raises(UsageError, match="--goal 8 0"):
        get_mission((8.0, 0.0, 0.0), None, get_world("pillars"), model=WIDE)

"""The firmware of the drives: it sits the robot down 50 ms after the last targets, and obeys the newest process only."""

from __future__ import annotations

import pytest

from robot.link.firmware import Drives
from robot.scenes.worlds import get_world
from robot.sim.physics import PhysicsBody


@pytest.fixture
def body() -> PhysicsBody:
    return PhysicsBody(get_world("empty"), seed=1)


def test_before_the_first_targets_the_drives_do_nothing_of_their_own() -> None:
    drives = Drives()
    assert drives.due() is None
    assert (drives.stopping, drives.resting) == (False, True)


def test_they_act_50_ms_after_the_last_targets_and_every_5_ms_from_then_on(body: PhysicsBody) -> None:
    drives = Drives()
    assert drives.obey(10.0, 1)
    assert drives.obey(10.02, 1)
    assert drives.due() == pytest.approx(10.07)
    drives.act(10.07, body.joints(), body.imu())
    assert drives.stopping
    assert drives.due() == pytest.approx(10.075)


def test_targets_that_come_again_end_it_and_the_next_silence_begins_another(body: PhysicsBody) -> None:
    drives = Drives()
    drives.obey(10.0, 1)
    drives.act(10.05, body.joints(), body.imu())
    assert drives.obey(10.2, 1)
    assert not drives.stopping
    assert drives.due() == pytest.approx(10.25)


def test_the_robot_rests_when_the_sit_is_over(body: PhysicsBody) -> None:
    drives = Drives()
    drives.obey(0.0, 1)
    steps = 0
    while not drives.resting:
        due = drives.due()
        assert due is not None
        drives.act(due, body.joints(), body.imu())
        steps += 1
    assert 1.1 < 0.005 * steps < 1.3


def test_a_process_that_has_been_replaced_is_not_obeyed_and_does_not_count_as_a_commander() -> None:
    drives = Drives()
    assert drives.obey(1.0, 1)
    assert drives.obey(2.0, 2)
    assert not drives.obey(2.04, 1)
    assert drives.refused == 1
    assert drives.due() == pytest.approx(2.05)

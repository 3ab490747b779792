"""Sweeps of a LiDAR in a body that moves are brought to one instant and to the level."""

from __future__ import annotations

from math import radians

import numpy as np
import pytest

from robot.estimation.deskew import UNKNOWN, Deskew
from robot.geometry.planar import Pose2
from robot.geometry.vectors import Floats, rotation_of
from robot.hardware.beams import MAX_RANGE, beam_angles
from robot.scenes.scene import Box, Scene
from robot.scenes.worlds import get_world
from robot.sim.depth_rays import sight
from robot.sim.lidar_rays import cast
from robot.sim.spin import beam_directions

ROOM = get_world("warehouse")
SWEEP = 0.1
HEIGHT = 0.5


class Motion:
    """A body that goes at a constant velocity and turns and leans at constant rates, from (1, 0.5, 0.3) on."""

    def __init__(self, vx: float, vy: float, wz: float, roll: float = 0.0, pitch: float = 0.0) -> None:
        self._speed, self._turn, self._lean = (vx, vy), wz, (roll, pitch)

    def at(self, time: float) -> tuple[tuple[float, float, float], tuple[float, float, float]]:
        (vx, vy), (roll, pitch) = self._speed, self._lean
        return (1.0 + vx * time, 0.5 + vy * time, HEIGHT), (roll, pitch, 0.3 + self._turn * time)

    def sweep(self, start: float, scene: Scene = ROOM) -> Floats:
        """What the beams measure, each at its own instant."""
        rays = beam_directions(beam_angles())
        seen = []
        for index, ray in enumerate(rays):
            place, (roll, pitch, yaw) = self.at(start + index * SWEEP / len(rays))
            axes = rotation_of(_quaternion(roll, pitch, yaw))
            seen.append(sight(scene.obstacles, (), np.array(place), (axes @ ray)[None, :], MAX_RANGE)[0])
        return np.minimum(seen, MAX_RANGE)

    def told(self, until: float) -> Deskew:
        """50 poses a second, as odometry tells them."""
        deskew = Deskew()
        for step in range(round(until * 50) + 1):
            deskew.add(step / 50, *self.at(step / 50))
        return deskew

    def pose(self, time: float) -> Pose2:
        (x, y, _), (_, _, yaw) = self.at(time)
        return Pose2(x, y, yaw)


def _quaternion(roll: float, pitch: float, yaw: float) -> Floats:
    from actors.tf2 import Transform

    return np.array(Transform.from_rpy((0.0, 0.0, 0.0), roll, pitch, yaw).rotation)


def _level(pose: Pose2) -> Floats:
    """What a level LiDAR sees at one instant."""
    return cast(ROOM, pose.x, pose.y, pose.yaw, height=HEIGHT)


def _compare(seen: Floats, true: Floats) -> tuple[float, float]:
    """Median error of the beams that show something, and the share of those that are off by more than 5 cm: edges."""
    known = (seen != UNKNOWN) & (true < MAX_RANGE) & (seen < MAX_RANGE)
    errors = np.abs(seen - true)[known]
    return float(np.median(errors)), float((errors > 0.05).mean())


@pytest.mark.parametrize(
    "motion",
    [
        Motion(0.0, 0.0, 0.0),
        Motion(1.6, 0.0, 0.0),
        Motion(0.0, -0.4, 0.0),
        Motion(0.0, 0.0, 1.5),
        Motion(1.0, 0.2, -1.0, roll=radians(2.0), pitch=radians(-1.5)),
    ],
    ids=["at rest", "fast", "sideways", "turning", "all at once, leaning"],
)
def test_a_sweep_in_motion_becomes_the_scan_of_its_last_instant(motion: Motion) -> None:
    raw = motion.sweep(0.1)
    seen = motion.told(0.3).corrected(raw, 0.1, SWEEP, 0.2)
    assert seen is not None
    middle, edges = _compare(seen, _level(motion.pose(0.2)))
    assert middle < 0.002
    assert edges < 0.06


def test_what_is_corrected_was_wrong_before() -> None:
    motion = Motion(1.0, 0.0, 1.0)
    raw = motion.sweep(0.1)
    seen = motion.told(0.3).corrected(raw, 0.1, SWEEP, 0.2)
    assert seen is not None
    true = _level(motion.pose(0.2))
    assert _compare(raw, true)[0] > 0.02 > 10 * _compare(seen, true)[0]


def test_a_small_turn_of_less_than_a_beam_is_not_lost_between_the_beams() -> None:
    """A scan whose ends were put to the nearest beam would be turned by up to half a degree."""
    motion = Motion(0.0, 0.0, radians(3.0))  # 0.3 degrees in a sweep
    seen = motion.told(0.3).corrected(motion.sweep(0.1), 0.1, SWEEP, 0.2)
    assert seen is not None
    true, turned = _level(motion.pose(0.2)), _level(motion.pose(0.15))
    assert _compare(seen, true)[0] < 0.2 * _compare(seen, turned)[0]


def test_beams_that_meet_the_floor_of_a_leaning_body_say_nothing() -> None:
    lonely = Scene("lonely", (-50.0, -50.0, 50.0, 50.0), (), Pose2(0.0, 0.0), Pose2(0.0, 0.0))
    motion = Motion(0.0, 0.0, 0.0, pitch=radians(6.0))  # nose down: the floor is 4.8 m ahead
    raw = motion.sweep(0.1, lonely)
    assert raw.min() == pytest.approx(HEIGHT / np.sin(radians(6.0)), abs=1e-6)
    seen = motion.told(0.3).corrected(raw, 0.1, SWEEP, 0.2)
    assert seen is not None
    assert set(np.unique(seen)) == {UNKNOWN, MAX_RANGE}
    assert seen[180] == UNKNOWN
    assert seen[0] == MAX_RANGE


def test_the_robots_own_legs_are_not_seen_and_a_thing_beside_it_is() -> None:
    motion = Motion(0.0, 0.0, 0.0)
    raw = np.full(360, MAX_RANGE)
    raw[210] = 0.33  # a hip, 30 degrees to the left of the nose
    raw[265:275] = 0.30  # something 5 cm beside the body
    seen = motion.told(0.3).corrected(raw, 0.1, SWEEP, 0.2)
    assert seen is not None
    assert seen[210] == UNKNOWN
    assert seen[270] == pytest.approx(0.30, abs=1e-9)
    assert seen[0] == MAX_RANGE


def test_an_edge_is_not_rounded_off_between_near_and_far() -> None:
    post = Scene("post", ROOM.bounds, (Box(3.0, 0.5, 0.2, 0.2),), ROOM.start, ROOM.dock)
    motion = Motion(0.0, 0.0, 0.5)
    seen = motion.told(0.3).corrected(motion.sweep(0.1, post), 0.1, SWEEP, 0.2)
    assert seen is not None
    assert ((seen < 2.3) | (seen == MAX_RANGE)).all()
    assert (seen < 2.3).sum() >= 3


def test_ranges_that_are_no_numbers_say_nothing() -> None:
    raw = np.full(360, 3.0)
    raw[[7, 100]] = np.nan, np.inf
    seen = Motion(0.0, 0.0, 0.0).told(0.3).corrected(raw, 0.1, SWEEP, 0.2)
    assert seen is not None
    assert seen[7] == seen[100] == UNKNOWN
    assert seen[50] == pytest.approx(3.0)


def test_without_poses_from_its_beginning_a_sweep_cannot_be_corrected() -> None:
    deskew = Deskew()
    assert deskew.corrected(np.full(360, 3.0), 0.1, SWEEP, 0.2) is None
    deskew.add(0.15, (0.0, 0.0, 0.5), (0.0, 0.0, 0.0))
    deskew.add(0.25, (0.0, 0.0, 0.5), (0.0, 0.0, 0.0))
    assert deskew.newest == 0.25
    assert deskew.corrected(np.full(360, 3.0), 0.1, SWEEP, 0.2) is None
    assert deskew.corrected(np.full(360, 3.0), 0.15, SWEEP, 0.25) is not None
    deskew.clear()
    assert deskew.newest is None


def test_a_heading_that_passes_half_a_turn_is_followed_the_short_way() -> None:
    deskew = Deskew()
    for step in range(20):
        yaw = 3.1 + 0.01 * step
        deskew.add(step / 50, (0.0, 0.0, 0.5), (0.0, 0.0, yaw if yaw < np.pi else yaw - 2 * np.pi))
    seen = deskew.corrected(np.linspace(2.0, 3.0, 360), 0.05, SWEEP, 0.15)
    assert seen is not None
    assert np.abs(np.diff(seen)[5:-5]).max() < 0.02

"""Odometry's heading by scans, without a map: against drifts that are put in, in worlds with walls, with strangers in them, and without any."""

from __future__ import annotations

import math
from collections.abc import Iterator
from itertools import pairwise

import numpy as np
import pytest

from robot.estimation.faces import BESIDE, Faces
from robot.estimation.heading_pull import FASTEST, FRESH, HeadingPull
from robot.estimation.scan_heading import PATIENCE, ScanHeading
from robot.geometry.angles import wrap
from robot.geometry.planar import Pose2, compose, inverse
from robot.geometry.vectors import Floats
from robot.hardware.beams import MAX_RANGE, beam_angles
from robot.scenes.scene import Scene
from robot.scenes.worlds import get_world
from robot.sim.lidar_rays import cast

NOISE = 0.015
"""Of one range, m."""
EMPTY = np.full(360, MAX_RANGE)


def scan_at(scene: Scene, pose: Pose2, random: np.random.Generator, too_long: float = 0.0) -> Floats:
    ranges = cast(scene, pose.x, pose.y, pose.yaw)
    return np.where(ranges < MAX_RANGE, ranges + too_long + random.normal(0.0, NOISE, len(ranges)), MAX_RANGE)


def loop(laps: int = 1) -> Iterator[Pose2]:
    """A way round in the middle aisles of the warehouse, 10 cm from pose to pose, turning on the spot at its corners."""
    corners = ((0.0, 0.5), (4.6, 0.5), (8.8, 0.5), (8.8, 3.4), (0.3, 3.4), (0.3, 0.5), (0.0, 0.5))
    for _ in range(laps):
        for (ax, ay), (bx, by) in pairwise(corners):
            course, count = math.atan2(by - ay, bx - ax), round(math.hypot(bx - ax, by - ay) / 0.1)
            for step in range(count):
                yield Pose2(ax + (bx - ax) * step / count, ay + (by - ay) * step / count, course)


def drifted(way: list[Pose2], drift: float) -> list[Pose2]:
    """The way as an odometry has it whose heading turns away by `drift` rad from pose to pose."""
    told = [way[0]]
    for a, b in pairwise(way):
        step = compose(inverse(a), b)
        told.append(compose(told[-1], Pose2(step.x, step.y, step.yaw + drift)))
    return told


# -- faces ------------------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("slant", [-0.6, 0.0, 0.4])
def test_the_faces_of_a_straight_wall_lie_on_it_and_look_at_the_lidar(slant: float) -> None:
    angles, normal = beam_angles(360), np.array([-math.cos(slant), -math.sin(slant)])
    facing = np.cos(angles - slant)
    ranges = np.where(facing > 0.3, 3.0 / np.maximum(facing, 0.3), MAX_RANGE)
    faces = Faces(ranges)
    assert faces.known.sum() > 100
    assert not faces.known[facing < 0.2].any()
    assert faces.normals[faces.known] @ normal == pytest.approx(np.ones(faces.known.sum()))
    assert faces.middles[faces.known] @ -normal == pytest.approx(np.full(faces.known.sum(), 3.0))


def test_a_face_is_surer_than_one_end_of_it() -> None:
    random, angles = np.random.default_rng(5), beam_angles(360)
    exact = 4.0 / np.maximum(np.cos(angles), 0.8)
    faces = Faces(np.where(np.cos(angles) > 0.8, exact + random.normal(0.0, NOISE, 360), MAX_RANGE))
    off = faces.middles[faces.known][:, 0] - 4.0
    assert off.std() < 1.2 * NOISE / math.sqrt(2 * BESIDE + 1)


def test_a_thing_of_few_beams_and_a_cloud_of_ends_have_no_face() -> None:
    ranges = EMPTY.copy()
    ranges[100:104] = 3.0
    assert not Faces(ranges).known.any()
    assert not Faces(np.random.default_rng(6).uniform(2.8, 3.2, 360)).known.any()


# -- the heading ------------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(("drift", "too_long"), [(0.0, 0.0), (3e-4, 0.03), (-3e-4, -0.03)])
def test_a_drift_of_a_tenth_of_a_radian_is_told_to_within_two_thousandths(drift: float, too_long: float) -> None:
    """Whether or not all ranges are too long by one length, which is found out meanwhile."""
    scene, random, tracker = get_world("warehouse"), np.random.default_rng(11), ScanHeading()
    way = list(loop())
    left: list[float] = []
    for truth, told in zip(way, drifted(way, drift), strict=True):
        error = tracker.update(told, scan_at(scene, truth, random, too_long))
        if error is not None:
            left.append(wrap(error - wrap(told.yaw - truth.yaw)))
    assert len(left) > 0.95 * len(way)
    assert math.sqrt(np.mean(np.square(left))) < 2e-3
    assert max(map(abs, left)) < 5e-3
    assert tracker.bias == pytest.approx(too_long, abs=5e-3)


def test_somebody_who_walks_along_does_not_turn_it() -> None:
    scene, random, tracker = get_world("warehouse"), np.random.default_rng(12), ScanHeading()
    way = list(loop())
    left: list[float] = []
    for number, truth in enumerate(way):
        ranges = scan_at(scene, truth, random)
        beside = (200 + number // 4) % 360  # it goes round the robot, and hides 40 degrees of what is behind it
        ranges[np.arange(beside - 20, beside + 20) % 360] = np.minimum(
            ranges[np.arange(beside - 20, beside + 20) % 360], 0.9
        )
        error = tracker.update(truth, ranges)
        if error is not None:
            left.append(error)
    assert len(left) > 0.9 * len(way)
    assert math.sqrt(np.mean(np.square(left))) < 2e-3


def test_where_nothing_is_seen_nothing_is_told() -> None:
    tracker = ScanHeading()
    assert [tracker.update(Pose2(0.05 * step, 0.0), EMPTY) for step in range(30)] == [None] * 30


def test_the_first_scan_and_the_first_after_it_has_forgotten_tell_nothing() -> None:
    scene, random, tracker = get_world("warehouse"), np.random.default_rng(13), ScanHeading()
    scan = scan_at(scene, Pose2(0.0, 0.5), random)
    assert tracker.update(Pose2(0.0, 0.0), scan) is None
    assert tracker.update(Pose2(0.0, 0.0), scan) is not None
    tracker.clear()
    assert tracker.update(Pose2(5.0, 0.0, 1.0), scan) is None
    assert tracker.update(Pose2(5.0, 0.0, 1.0), scan) == pytest.approx(0.0, abs=1e-3)


def test_a_scan_of_another_place_is_refused() -> None:
    scene, random, tracker = get_world("warehouse"), np.random.default_rng(14), ScanHeading()
    for _ in range(5):
        tracker.update(Pose2(0.0, 0.0), scan_at(scene, Pose2(0.0, 0.5), random))
    assert tracker.update(Pose2(0.0, 0.0), scan_at(scene, Pose2(8.8, 3.4, 1.0), random)) is None


def test_a_robot_that_was_carried_begins_anew_after_five_seconds_with_the_error_that_it_had() -> None:
    scene, random, tracker = get_world("warehouse"), np.random.default_rng(15), ScanHeading()
    odom, before, after = Pose2(0.0, 0.0, 0.0), Pose2(0.0, 0.5), Pose2(8.8, 3.4, 1.0)
    for _ in range(5):
        tracker.update(odom, scan_at(scene, before, random))
    told = [tracker.update(odom, scan_at(scene, after, random)) for _ in range(PATIENCE + 10)]
    assert told[:PATIENCE] == [None] * PATIENCE
    assert told[PATIENCE:] == pytest.approx([0.0] * 10, abs=2e-3)


# -- what becomes of it -----------------------------------------------------------------------------------------------------


def follow(bias: float, seconds: float, *, heard: bool = True, start: float = 0.0) -> tuple[float, float, float]:
    """Error of the heading, bias left and fastest turn, of a gyro with a bias whose heading scans tell five times a second."""
    pull, dt, error, left, fastest = HeadingPull(), 0.005, start, bias, 0.0
    for step in range(round(seconds / dt)):
        if heard and step % 40 == 0:
            pull.seen(error)
        turn, learned = pull.advance(dt)
        left -= learned
        error += (left + turn) * dt
        fastest = max(fastest, abs(turn))
    return error, left, fastest


def test_a_heading_is_turned_back_and_the_bias_that_did_it_is_found() -> None:
    error, left, _ = follow(1e-3, 60.0)
    assert abs(error) < 1e-5
    assert abs(left) < 1e-5
    assert follow(1e-3, 60.0, heard=False)[0] == pytest.approx(0.06)


def test_meanwhile_the_heading_is_never_off_by_what_the_bias_makes_in_five_seconds() -> None:
    assert max(abs(follow(1e-3, seconds)[0]) for seconds in np.arange(1.0, 30.0, 1.0)) < 5e-3


def test_a_large_error_is_taken_back_no_faster_than_odometry_may_turn() -> None:
    error, _, fastest = follow(0.0, 10.0, start=0.5)
    assert fastest == FASTEST
    assert error == pytest.approx(0.5 - 10.0 * FASTEST, abs=0.05)


def test_a_word_that_is_old_turns_nothing() -> None:
    pull = HeadingPull()
    assert not pull.active
    pull.seen(0.01)
    assert pull.advance(0.005)[0] < 0.0
    pull.advance(FRESH)
    assert not pull.active
    assert pull.advance(0.005) == (0.0, 0.0)

"""The safe stop on made-up joint samples: where the feet are sent, what the legs carry, and that it ends."""

from __future__ import annotations

from collections.abc import Sequence
from math import cos, hypot, pi

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.integrate import quad

from robot.control.safe_stop import SafeStop
from robot.geometry.vectors import Floats, Vector
from robot.hardware.body import JointSample, MotorTargets
from robot.model.kinematics import feet, inverse, leg_jacobian
from robot.model.legs import LEVEL, leg_state
from robot.model.parameters import FOOT_RADIUS, GRAVITY, MASS, SIDES, SIT_HEIGHT
from robot.model.stance import NOMINAL, nominal_feet
from tests.robot.control.kit import DT, HEIGHT, MIRRORED, joints_at, pushes, standing

ALL = (True, True, True, True)
DIAGONAL = (True, False, False, True)


def walking(velocity: tuple[float, float], contact: Sequence[bool] = ALL, places: Vector | None = None) -> JointSample:
    """The joints of a level robot whose body goes at `velocity` over its feet."""
    at = nominal_feet(HEIGHT) if places is None else places
    angles = inverse(at).joints
    legs = [leg_jacobian(side, *angles[3 * leg : 3 * leg + 3]) for leg, side in enumerate(SIDES)]
    speeds = np.concatenate([np.linalg.solve(jacobian, (-velocity[0], -velocity[1], 0.0)) for jacobian in legs])
    return joints_at(at, contact, speeds)


def told(sample: JointSample, seconds: float, stop: SafeStop | None = None) -> list[MotorTargets]:
    """What the motors are told for so long while the samples stay as they are; the first one at time 0."""
    stop = stop or SafeStop()
    return [stop.step(DT, sample) for _ in range(round(seconds / DT) + 1)]


def places(targets: MotorTargets) -> Floats:
    return feet(targets.position)


def loads(sample: JointSample, targets: MotorTargets) -> Floats:
    """The forces that the torques push with, body axes, shape (4, 3)."""
    return pushes(leg_state(sample.position.tolist(), LEVEL), targets.effort)


def gone(speed: float, time: float) -> float:
    """How far a body goes on at its speed for 0.15 s and then braking at 4 m/s2, by integration."""
    kinks = [t for t in (0.15, 0.15 + speed / 4.0) if t < time]
    return quad(lambda t: max(0.0, speed - 4.0 * max(0.0, t - 0.15)), 0.0, time, points=kinks or None)[0]


def blend(time: float) -> float:
    return 0.5 * (1.0 - cos(pi * min(1.0, time)))


# -- the end ------------------------------------------------------------------------------------------------------------------


@given(
    velocity=st.tuples(st.floats(-1.6, 1.6), st.floats(-0.5, 0.5)),
    contact=st.tuples(*[st.booleans()] * 4),
)
@settings(max_examples=15)
def test_from_any_moment_it_ends_sitting_softly_on_the_nominal_stance(
    velocity: tuple[float, float], contact: tuple[bool, ...]
) -> None:
    stop = SafeStop()
    last = told(walking(velocity, contact), 1.2 + DT, stop)[-1]
    assert stop.done
    assert places(last) == pytest.approx(
        np.array([(x, y, places(last)[leg][2]) for leg, (x, y) in enumerate(NOMINAL)]), abs=1e-6
    )
    assert [places(last)[leg][2] for leg in range(4) if contact[leg]] == pytest.approx([-SIT_HEIGHT] * sum(contact))
    assert last.kp.tolist() == [60.0] * 12
    assert last.kd.tolist() == [6.0] * 12


def test_it_is_done_after_a_second_and_a_fifth_and_not_before() -> None:
    stop, sample = SafeStop(), standing()
    dones = []
    for _ in range(245):
        stop.step(DT, sample)
        dones.append(stop.done)
    assert dones.index(True) in (240, 241)
    assert all(dones[241:])


def test_a_robot_that_sits_stays_where_it_is() -> None:
    for targets in told(joints_at(nominal_feet(SIT_HEIGHT)), 1.0):
        assert places(targets) == pytest.approx(nominal_feet(SIT_HEIGHT), abs=1e-9)


# -- the way there ------------------------------------------------------------------------------------------------------------


def test_from_standing_the_body_sinks_along_a_half_cosine() -> None:
    for step, targets in enumerate(told(standing(), 1.0)):
        found = min(1.0, step * DT / 0.15)  # within this time all feet come to one height
        height = HEIGHT + found * (SIT_HEIGHT - HEIGHT) * blend(step * DT)
        assert places(targets) == pytest.approx(nominal_feet(height), abs=1e-6)


@pytest.mark.parametrize("velocity", [(0.8, 0.0), (0.0, -0.3), (0.5, 0.2), (-0.4, 0.1), (1.9, 0.0)])
def test_standing_feet_go_back_as_far_as_a_body_goes_on_that_brakes(velocity: tuple[float, float]) -> None:
    fast = hypot(*velocity)
    for step, targets in enumerate(told(walking(velocity), 0.9)):
        time = step * DT
        back = gone(fast, time) / fast
        share = blend(time)
        for place, (x, y) in zip(places(targets), NOMINAL, strict=True):
            wanted = (x - back * velocity[0] * (1.0 - share), y - back * velocity[1] * (1.0 - share))
            assert place[:2] == pytest.approx(wanted, abs=2e-3)


def test_a_speed_that_can_only_be_a_slip_is_bounded_to_two_metres_a_second() -> None:
    bounded, slipping = told(walking((2.0, 0.0)), 0.5), told(walking((8.0, 0.0)), 0.5)
    for one, other in zip(bounded, slipping, strict=True):
        assert other.position == pytest.approx(one.position, abs=1e-9)


def test_only_standing_feet_tell_the_speed() -> None:
    sample = walking((0.5, 0.0), DIAGONAL)
    raced = sample.velocity.copy()
    raced[3:9] += 5.0
    spoiled = JointSample(sample.position, raced, sample.effort, sample.contact)
    for one, other in zip(told(sample, 0.3), told(spoiled, 0.3), strict=True):
        assert other.position == pytest.approx(one.position, abs=1e-9)


def test_a_speed_that_is_known_counts_instead_of_what_sliding_feet_tell() -> None:
    sliding = walking((1.5, -1.0))
    known = places(told(sliding, 0.3, SafeStop(steps=False, speed=(0.0, 0.0)))[-1])
    still = places(told(walking((0.0, 0.0)), 0.3)[-1])
    assert known == pytest.approx(still, abs=1e-9)
    assert np.abs(places(told(sliding, 0.3, SafeStop(steps=False))[-1]) - still).max() > 0.1


def test_a_foot_in_the_air_reaches_a_last_step_ahead_at_the_height_of_the_others() -> None:
    lifted = nominal_feet(HEIGHT)
    lifted[1:3, 2] += 0.06
    targets = told(walking((0.6, 0.0), DIAGONAL, lifted), 0.15)
    share, height = blend(0.15), HEIGHT + (SIT_HEIGHT - HEIGHT) * blend(0.15)
    for leg in (1, 2):
        x, y, z = places(targets[-1])[leg]
        assert x == pytest.approx(NOMINAL[leg][0] + 0.2 * 0.6 * (1.0 - share), abs=1e-3)
        assert y == pytest.approx(NOMINAL[leg][1], abs=1e-3)
        assert z == pytest.approx(-height, abs=1e-3)


def test_one_that_finds_no_ground_goes_on_downwards_to_the_longest_leg() -> None:
    heights = np.array([places(targets)[1][2] for targets in told(standing((True, False, True, True)), 1.0)])
    sinking = -(HEIGHT + (SIT_HEIGHT - HEIGHT) * np.array([blend(step * DT) for step in range(len(heights))]))
    searched = 0.3 * np.maximum(0.0, np.arange(len(heights)) * DT - 0.15)
    assert heights.min() >= -0.58 - 1e-9
    assert (heights <= sinking + 1e-9).all()
    assert np.abs(heights[40] - max(-0.58, min(-HEIGHT, sinking[40]) - searched[40])) < 1e-6


def test_one_that_touches_late_brakes_from_where_it_touched() -> None:
    stop = SafeStop()
    told(walking((0.6, 0.0), DIAGONAL), 0.1, stop)
    landed = nominal_feet(HEIGHT)
    landed[1, 0] += 0.1
    touching = walking((0.6, 0.0), (True, True, False, True), landed)
    first = stop.step(DT, touching)
    share = blend(0.105)
    assert places(first)[1][0] == pytest.approx(landed[1, 0] * (1 - share) + NOMINAL[1][0] * share, abs=1e-6)
    for _ in range(20):
        last = stop.step(DT, touching)
    share, back = blend(0.205), gone(0.6, 0.205) - gone(0.6, 0.105)
    assert places(last)[1][0] == pytest.approx((landed[1, 0] - back) * (1 - share) + NOMINAL[1][0] * share, abs=1e-6)


# -- forces -------------------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("contact", "share"),
    [
        (ALL, 0.5),
        ((True, True, True, False), 0.5),
        (DIAGONAL, 0.5),
        ((True, False, False, False), 0.25),
        ((False,) * 4, 0.0),
    ],
)
def test_the_standing_legs_carry_half_of_the_weight_and_one_alone_a_quarter(
    contact: tuple[bool, ...], share: float
) -> None:
    sample = standing(contact)
    found = loads(sample, SafeStop().step(DT, sample))
    most, total = share * MASS * GRAVITY, found.sum(axis=0)[2]
    if sum(contact) == 1:
        assert 10.0 - 1e-9 <= total <= most, "a foot that is not below the centre of mass must not tip the body over"
    else:
        assert total == pytest.approx(most, rel=0.12 if sum(contact) == 3 else 1e-3)
    assert not any(np.abs(found[leg]).max() > 1e-6 for leg in range(4) if not contact[leg])


def test_four_feet_carry_it_without_tilting_the_body() -> None:
    sample = standing()
    forces = loads(sample, SafeStop().step(DT, sample))
    legs = leg_state(sample.position.tolist(), LEVEL)
    arms = np.array(legs.feet) - legs.centre - (0.0, 0.0, FOOT_RADIUS)
    assert np.cross(arms, forces).sum(axis=0) == pytest.approx((0.0, 0.0, 0.0), abs=0.02)


def test_the_load_is_let_go_and_the_springs_soften_over_the_last_moments() -> None:
    sample, stop = standing(), SafeStop()
    history = told(sample, 1.3, stop)
    for step, targets in enumerate(history):
        rest = min(1.0, max(0.0, (step * DT - 1.0) / 0.2))
        assert loads(sample, targets).sum(axis=0)[2] == pytest.approx((1.0 - rest) * 0.5 * MASS * GRAVITY, abs=0.3)
        assert targets.kp[0] == pytest.approx(250.0 + (60.0 - 250.0) * rest)
        assert targets.kd[0] == 6.0


def test_a_mirrored_robot_is_stopped_in_the_mirror() -> None:
    crooked = nominal_feet(HEIGHT) + np.array(
        ((0.05, 0.02, 0.0), (-0.03, 0.01, 0.03), (0.0, -0.02, 0.02), (0.02, 0.0, 0.0))
    )
    one = told(walking((0.5, 0.2), DIAGONAL, crooked), 0.6)
    image = crooked[list(MIRRORED)] * (1.0, -1.0, 1.0)
    other = told(walking((0.5, -0.2), (False, True, True, False), image), 0.6)
    for mine, theirs in zip(one[::20], other[::20], strict=True):
        for name in ("position", "effort"):
            legs = getattr(mine, name).reshape(4, 3)[list(MIRRORED)] * (-1.0, 1.0, 1.0)
            assert getattr(theirs, name) == pytest.approx(legs.ravel(), abs=1e-8)

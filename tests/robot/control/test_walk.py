"""One walk, step by step without physics: which leg does what, what the motors are told, and what contacts change about it."""

from __future__ import annotations

from dataclasses import replace
from math import cos, hypot, pi, sin

import numpy as np
import pytest

from robot.control.gaits import GAITS, Gait
from robot.control.sway import sway
from robot.control.walk_config import WalkConfig
from robot.geometry.vectors import Floats
from robot.model.kinematics import leg_jacobian
from robot.model.mass import standing_mass
from robot.model.parameters import GRAVITY, MASS, STAND_HEIGHT
from robot.model.stance import nominal_feet
from tests.robot.control.kit import DT, HEIGHT, MIRRORED, ZERO, predicted, sloping
from tests.robot.control.walks import CONFIG, Walk

TROT, CRAWL, PRONK = GAITS["trot"], GAITS["crawl"], GAITS["pronk"]


# -- standing legs ------------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("yaw", [0.0, 2.0])
@pytest.mark.parametrize("roll", [0.0, 0.1])
def test_at_rest_four_feet_carry_the_weight_without_a_moment_about_the_centre_of_mass(roll: float, yaw: float) -> None:
    walk = Walk(config=replace(CONFIG, turn_spring=ZERO), state=predicted(rpy=(roll, 0.0, yaw)))
    walk.slope = sloping(0.0, 0.0)
    walk.step()
    forces = walk.forces()
    height = -np.mean(np.array(walk.state.feet)[:, 2])
    assert forces.sum(axis=0) == pytest.approx(
        (0.0, 0.0, MASS * (GRAVITY + 60.0 * (walk.walker.height - height))), abs=0.1
    )
    assert np.cross(walk.arms(), forces).sum(axis=0) == pytest.approx(ZERO, abs=0.02)
    assert walk.walker.acceleration == pytest.approx(forces.sum(axis=0) / MASS - (0.0, 0.0, GRAVITY), abs=1e-9)


def test_a_standing_leg_is_told_forces_and_how_fast_its_foot_goes_by() -> None:
    walk = Walk(state=predicted(rpy=(0.0, 0.0, 0.5)))
    walk.told = (0.4, -0.1, 0.3)
    walk.step()
    for leg, jacobian in enumerate(walk.state.legs.jacobians):
        passing = -(np.array((0.4, -0.1, 0.0)) + np.cross((0.0, 0.0, 0.3), walk.state.legs.feet[leg]))
        speeds = np.array(walk.targets.velocity[3 * leg : 3 * leg + 3])
        found = np.array(jacobian) @ speeds
        assert found[:2] == pytest.approx(passing[:2], abs=1e-9)
        assert walk.targets.kp[3 * leg : 3 * leg + 3] == [0.0] * 3
        assert walk.targets.kd[3 * leg : 3 * leg + 3] == [1.0] * 3


def test_a_body_that_lags_is_pushed_on_in_the_direction_of_the_command() -> None:
    walk = Walk(state=predicted(rpy=(0.0, 0.0, pi / 2)))
    walk.told = (0.3, 0.0, 0.0)
    walk.step()
    forces = walk.forces()
    assert forces.sum(axis=0)[:2] == pytest.approx((0.0, MASS * 0.3 * (6.0 + 3.0 * DT)), abs=0.5)
    assert np.cross(walk.arms(), forces).sum(axis=0) == pytest.approx(ZERO, abs=0.3), "by the soles, not by the ankles"


def test_in_the_air_nothing_pushes_and_the_body_falls_freely() -> None:
    walk = Walk(PRONK)
    walk.until(0, 0.2)
    walk.step()
    assert walk.swings() == [0, 1, 2, 3]
    assert walk.walker.acceleration == (0.0, 0.0, -GRAVITY)
    assert all(walk.held(leg) for leg in range(4))


def test_a_foot_that_slips_is_asked_for_less_of_its_friction_and_trusted_again_in_time() -> None:
    walk = Walk()
    walk.told = (9.0, 0.0, 0.0)
    walk.walker.halting = True

    def steepest() -> Floats:
        forces = walk.run(DT).forces()
        return np.asarray(np.hypot(forces[:, 0], forces[:, 1]) / forces[:, 2])

    assert steepest().max() <= 0.6 + 1e-9
    walk.estimate.slipping[1] = True
    walk.run(0.1)
    assert steepest()[1] == pytest.approx(0.4 * 0.6)
    walk.estimate.slipping[1] = False
    walk.run(0.6)
    assert 0.4 * 0.6 < steepest()[1] <= 0.75 * 0.6
    walk.run(1.0)
    assert steepest()[1] > 0.45


# -- swinging legs ------------------------------------------------------------------------------------------------------------


def test_diagonal_legs_of_a_trot_swing_in_turn_and_each_period_once() -> None:
    walk, lifted = Walk(), dict.fromkeys(range(4), 0)
    was: set[int] = set()
    for _ in range(round(4 * TROT.period / DT)):
        walk.step()
        now = set(walk.swings())
        for leg in now - was:
            lifted[leg] += 1
        assert now in ({0, 3}, {1, 2}, set())
        was = now
    assert lifted == dict.fromkeys(range(4), 4)


def test_a_swing_leads_the_foot_from_where_it_lifted_over_the_clearance_to_the_place_below_the_shoulder() -> None:
    walk = Walk()
    walk.until(0, 0.0).step()
    assert walk.foot(0) == pytest.approx(nominal_feet(HEIGHT)[0], abs=2e-3)
    heights: list[float] = []
    while walk.walker.swing(0) >= 0.0:
        heights.append(float(walk.foot(0)[2]))
        last = walk.foot(0)
        walk.step()
    goal = nominal_feet(HEIGHT)[0] - (standing_mass(HEIGHT).behind, 0.0, 0.0)
    assert last == pytest.approx(goal, abs=3e-3)
    assert max(heights) == pytest.approx(-HEIGHT + TROT.clearance, abs=1e-3)
    assert heights.index(max(heights)) / len(heights) == pytest.approx(0.5, abs=0.06)


@pytest.mark.parametrize("height", [0.02, 0.06])
@pytest.mark.parametrize("behind", [0.0, 0.04, 0.08])
def test_a_walk_that_is_joined_in_mid_stride_carries_feet_on_from_where_they_are(behind: float, height: float) -> None:
    at = nominal_feet(HEIGHT)
    at[[0, 3], 0] -= behind  # the farther behind the standing feet are, the longer have the others been in the air
    at[[1, 2]] += (0.5 * behind, 0.0, height)
    state, contact = predicted(velocity=(1.0, 0.0, 0.0), feet=at), (True, False, False, True)
    walk = Walk(config=WalkConfig(), state=state)
    walk.estimate.contact, walk.estimate.velocity = contact, state.velocity
    walk.estimate.legs = state.legs
    walk.walker.join(walk.estimate, state)
    assert walk.swings() == [1, 2]
    walk.step()
    assert walk.foot(1) == pytest.approx(at[1], abs=0.012)
    assert walk.foot(2) == pytest.approx(at[2], abs=0.012)
    before = walk.foot(1)
    while walk.walker.swing(1) >= 0.0:
        assert np.abs(walk.foot(1) - before).max() < 0.06, "no foot is told to jump"
        before = walk.foot(1)
        walk.step()
    assert before[2] == pytest.approx(-HEIGHT, abs=0.02)


def test_the_joint_speeds_of_a_swing_are_the_derivative_of_its_places() -> None:
    walk = Walk(state=predicted(rpy=(0.05, -0.1, 0.7)))
    walk.until(2, 0.3)
    dt = 1e-5
    before = np.array(walk.step(dt).position[6:9])
    speeds = np.array(walk.step(dt).velocity[6:9])
    after = np.array(walk.step(dt).position[6:9])
    assert (after - before) / (2 * dt) == pytest.approx(speeds, abs=0.02)


def test_a_swing_over_a_body_that_moves_gives_the_foot_the_bodys_speed_back() -> None:
    """The foot of a body that goes forward must go back against it, and round it when it turns."""
    still, moving = Walk(), Walk(state=predicted(velocity=(0.3, 0.1, 0.0), turn=(0.2, -0.3, 0.5)))
    feet_speed: list[Floats] = []
    for walk in (still, moving):
        walk.until(0, 0.0)
        walk.step()
        jacobian = np.array(leg_jacobian(1.0, *walk.targets.position[:3]))
        assert walk.walker.swing(0) < 0.05
        feet_speed.append(jacobian @ np.array(walk.targets.velocity[:3]))
    wanted = -np.array((0.3, 0.1, 0.0)) - np.cross((0.2, -0.3, 0.5), moving.foot(0))
    assert feet_speed[1] - feet_speed[0] == pytest.approx(wanted, abs=0.08)


def test_a_mirrored_walk_is_told_the_mirrored_targets() -> None:
    left, right = Walk(PRONK), Walk(PRONK)
    left.told, right.told = (0.3, 0.2, 0.4), (0.3, -0.2, -0.4)
    for _ in range(60):
        one, other = left.step(), right.step()
        for leg, twin in enumerate(MIRRORED):
            for name in ("position", "velocity", "effort"):
                hip, shoulder, knee = getattr(one, name)[3 * leg : 3 * leg + 3]
                assert getattr(other, name)[3 * twin : 3 * twin + 3] == pytest.approx((-hip, shoulder, knee), abs=1e-8)


# -- contacts -----------------------------------------------------------------------------------------------------------------


def test_a_contact_in_the_second_half_of_a_swing_ends_it_for_this_period() -> None:
    walk = Walk().until(0, 0.6)
    walk.touch[0] = True
    walk.step()
    assert walk.walker.swing(0) < 0.0
    assert not walk.held(0)
    walk.run((1.0 - 0.6) * walk.walker.clock.swing_time)
    assert walk.walker.swing(0) < 0.0


@pytest.mark.parametrize(("progress", "meets"), [(0.02, False), (0.25, True), (0.45, True)])
def test_a_contact_early_in_a_swing_is_an_obstacle_and_before_that_the_floor(progress: float, meets: bool) -> None:
    walk, free = Walk().until(1, progress), Walk().until(1, progress)
    walk.touch[1] = True
    walk.step()
    walk.touch.clear()
    walk.run(0.03)
    free.run(0.03 + DT)
    lifted = walk.foot(1)[2] - free.foot(1)[2]
    assert walk.walker.caution == pytest.approx(0.1 - 0.015 * 7 * DT if meets else 0.0, abs=2e-4)
    assert bool(lifted > 0.02) is meets
    assert walk.walker.swing(1) == pytest.approx(free.walker.swing(1))


def test_stumbling_again_and_again_lifts_the_feet_no_higher_than_the_most_and_is_forgotten() -> None:
    walk = Walk()
    for _ in range(4):
        walk.until(0, 0.25)
        walk.touch[0] = True
        walk.step()
        walk.touch.clear()
        while walk.walker.swing(0) >= 0.0:
            walk.step()
    assert 0.15 < walk.walker.caution <= 0.16
    walk.run(2.0)
    assert walk.walker.caution < 0.13
    walk.run(10.0)
    assert walk.walker.caution == 0.0


@pytest.mark.parametrize(("rise", "most"), [(0.0, 0.16), (0.15, 0.107), (0.36, 0.032), (0.5, 0.0)])
def test_on_a_slope_feet_are_lifted_less_high_after_a_stumble(rise: float, most: float) -> None:
    walk = Walk()
    walk.walker.caution = 0.16
    walk.slope.slope_x, walk.slope.slope_y = 0.8 * rise, -0.6 * rise
    walk.step()
    assert walk.walker.caution == pytest.approx(most, abs=1e-3)


@pytest.mark.parametrize(
    ("rise", "speed", "waits"), [(0.3, 0.0, True), (0.3, 0.4, True), (0.3, 0.6, False), (0.0, 0.4, False)]
)
def test_on_a_slope_a_slow_gait_waits_for_a_foot_that_finds_no_ground_but_not_for_ever(
    rise: float, speed: float, waits: bool
) -> None:
    walk = Walk()
    walk.slope.slope_x = rise
    walk.state.velocity = (speed, 0.0, 0.0)
    walk.touch[0] = False
    walk.until(0, 0.5)
    while walk.walker.swing(0) >= 0.0:
        walk.step()
    walk.run(2 * DT)
    begun = walk.walker.clock.phase
    walk.run(0.2)
    assert (walk.walker.clock.phase == begun) == waits
    assert (walk.swings() == []) == waits
    walk.run(0.2)
    assert walk.walker.clock.phase != begun


def test_a_foot_that_finds_no_ground_is_trusted_for_a_moment_and_then_lowered_until_it_does() -> None:
    walk = Walk().until(0, 0.5)
    while walk.walker.swing(0) >= 0.0:
        walk.step()
    walk.touch[0] = False
    walk.walker.halting = True
    late: list[tuple[float, bool, float]] = []
    for _ in range(14):
        walk.step()
        late.append((walk.walker.late(0), walk.held(0), float(walk.foot(0)[2])))
    times, looks, heights = zip(*late, strict=True)
    assert np.diff(times) == pytest.approx([DT] * 13)
    assert [held for time, held in zip(times, looks, strict=True)] == [time >= 0.02 - 1e-9 for time in times]
    down = [height for held, height in zip(looks, heights, strict=True) if held]
    assert np.diff(down) == pytest.approx([-1.0 * DT] * (len(down) - 1), abs=1e-6)
    assert not walk.walker.grounded
    walk.touch[0] = True
    walk.step()
    assert (walk.walker.late(0), walk.held(0), walk.walker.grounded) == (0.0, False, True)


def test_a_foot_that_looks_for_the_ground_does_not_lift_until_it_stood() -> None:
    walk = Walk().until(0, 0.5)
    walk.touch[0] = False
    while walk.walker.swing(0) >= 0.0:
        walk.step()
    for _ in range(round(2 * TROT.period / DT)):
        walk.step()
        assert walk.walker.swing(0) < 0.0


# -- the whole walk -----------------------------------------------------------------------------------------------------------


def test_while_it_halts_no_foot_lifts_and_those_in_the_air_come_down() -> None:
    walk = Walk().until(0, 0.2)
    walk.walker.halting = True
    assert walk.walker.swinging
    walk.run(TROT.period)
    assert walk.walker.grounded
    for _ in range(round(2 * TROT.period / DT)):
        walk.step()
        assert not walk.walker.swinging


def test_only_feet_in_the_last_tenth_of_their_stance_are_leaving() -> None:
    walk, seen = Walk(), 0
    for _ in range(round(2 * TROT.period / DT)):
        walk.step()
        for leg, leaving in enumerate(walk.walker.leaving()):
            phase = walk.walker.clock.leg_phase(leg)
            assert leaving is (phase > 0.9 * TROT.duty)
            seen += leaving and phase < TROT.duty
    assert 0 < seen <= 2 * 4 * (0.1 * TROT.duty * TROT.period / DT + 2)


def test_the_height_goes_to_that_of_the_walk_at_a_bounded_rate() -> None:
    walk = Walk(config=WalkConfig())
    assert walk.walker.height == STAND_HEIGHT
    heights = [STAND_HEIGHT, *(walk.run(DT).walker.height for _ in range(200))]
    assert np.diff(heights).max() <= 0.15 * DT + 1e-12
    assert heights[40] == pytest.approx(STAND_HEIGHT + 0.15 * 40 * DT)
    assert heights[-1] == pytest.approx(0.52)


@pytest.mark.parametrize(("speed", "height"), [(0.0, 0.52), (1.0, 0.52), (1.5, 0.495), (2.0, 0.47), (3.0, 0.47)])
@pytest.mark.parametrize("commanded", [True, False])
def test_it_crouches_with_the_speed_that_it_has_or_is_asked_for(speed: float, height: float, commanded: bool) -> None:
    walk = Walk(config=WalkConfig())
    if commanded:
        walk.told = (0.6 * speed, 0.8 * speed, 0.0)
    else:
        walk.state.velocity = (-0.6 * speed, 0.8 * speed, 0.0)
    walk.walker.halting = True
    assert walk.run(1.0).walker.height == pytest.approx(height)


@pytest.mark.parametrize("crouch", [0.0, 0.05])
@pytest.mark.parametrize("height", [0.40, STAND_HEIGHT, STAND_HEIGHT + 1e-12, 0.52])
def test_a_walk_at_any_height_sets_its_feet_below_the_centre_of_mass_of_that_height(
    height: float, crouch: float
) -> None:
    """At the standing height there is no way up over which the mass could be interpolated."""
    state = predicted(feet=nominal_feet(height))
    walk = Walk(config=WalkConfig(height=height, crouch=crouch), state=state)
    walk.slope = sloping(height=-height)
    walk.run(1.0).until(0, 0.97)
    assert walk.walker.height == pytest.approx(height)
    assert nominal_feet(height)[0][0] - walk.foot(0)[0] == pytest.approx(standing_mass(height).behind, abs=6e-4)


def test_going_on_with_another_gait_lifts_the_leg_first_that_is_left_behind_most() -> None:
    behind = nominal_feet(HEIGHT) - ((0.0, 0.0, 0.0), (0.08, 0.0, 0.0), (0.0, 0.0, 0.0), (0.02, 0.0, 0.0))
    walk = Walk(TROT, state=predicted(velocity=(0.4, 0.0, 0.0), feet=behind))
    walk.walker.change(GAITS["pace"], walk.state)
    assert walk.walker.clock.gait.name == "pace"
    walk.run(0.05)
    assert set(walk.swings()) == {1, 3}


def test_the_limits_of_a_gait_grow_from_those_of_its_entry_once_its_sway_is_reached() -> None:
    assert Walk(TROT).walker.bound is None
    assert Walk(PRONK).walker.bound is PRONK.most
    walk = Walk(CRAWL)
    assert CRAWL.entry is not None and CRAWL.most is not None
    assert walk.walker.bound == CRAWL.entry.between(CRAWL.most, 0.0)
    walk.run(CONFIG.sway_time)
    assert walk.walker.bound == CRAWL.entry.between(CRAWL.most, 0.0)
    forward = [bound.forward for _ in range(12) if (bound := walk.run(0.1).walker.bound) is not None]
    assert forward == sorted(forward)
    assert forward[-1] == CRAWL.most.forward


def test_a_gait_that_sways_begins_with_all_feet_on_the_ground() -> None:
    walk = Walk(CRAWL)
    assert walk.walker.settling
    for _ in range(round(CONFIG.sway_time / DT) - 1):
        walk.step()
        assert walk.walker.settling
        assert not walk.walker.swinging
    walk.run(2 * DT)
    assert not walk.walker.settling
    assert len(set(walk.run(0.2).swings())) == 1


def test_the_drift_is_the_velocity_of_the_sway_along_the_heading() -> None:
    walk = Walk(CRAWL, state=predicted(rpy=(0.0, 0.0, 0.6)))
    walk.run(3.0)
    clock, (fore, side) = walk.walker.clock, CRAWL.sway or (0.0, 0.0)
    phase, period = clock.phase - CRAWL.sway_from, clock.period
    forward = sway(2.0 * phase, 0.5 * period, fore, 0.2, walk.walker.height)[1]
    left = sway(phase, period, side, 0.1, walk.walker.height)[1]
    assert hypot(forward, left) > 0.01
    assert walk.walker.drift == pytest.approx(
        (cos(0.6) * forward - sin(0.6) * left, sin(0.6) * forward + cos(0.6) * left), abs=1e-9
    )
    assert Walk(TROT).run(1.0).walker.drift == (0.0, 0.0)


@pytest.mark.parametrize(("gait", "roll", "upset"), [(CRAWL, 0.2, True), (CRAWL, 0.05, False), (TROT, 0.2, False)])
def test_only_a_gait_that_sways_is_upset_by_leaning(gait: Gait, roll: float, upset: bool) -> None:
    walk = Walk(gait, state=predicted(rpy=(roll, 0.0, 0.0)))
    walk.step()
    assert walk.walker.upset is upset

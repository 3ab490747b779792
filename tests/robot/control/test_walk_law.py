"""The equations of walking one by one, and against docs/concepts/control.md#walking evaluated in matrices."""

from __future__ import annotations

from dataclasses import replace
from math import atan, inf, pi

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from robot.control.walk_config import WalkConfig
from robot.control.walk_law import AT_REST, Step, Tracking, WalkState, body_wrench, foothold, has_lost_balance, track
from robot.geometry.vectors import Floats, Triple
from robot.model.mass import standing_mass
from robot.model.parameters import GRAVITY, MASS
from robot.model.stance import NOMINAL, nominal_feet
from tests.robot.control.kit import DT, HEIGHT, MIRRORED, angle, lean, moment, predicted, sloping, speed, turned_about_z

CONFIG = WalkConfig()
FEET = (0, 1, 2, 3)
UNEVEN = nominal_feet(HEIGHT) + np.array(
    ((0.05, 0.02, 0.01), (-0.03, 0.01, -0.02), (0.02, -0.02, 0.0), (0.0, 0.03, 0.03))
)


def step(velocity: tuple[float, float] = (0.0, 0.0), *, wanted: tuple[float, float] = (0.0, 0.0), turn: float = 0.0, height: float = 0.5) -> Step:  # fmt: skip
    """A level robot whose feet stand 0.5 m below its hips, looking along x, that moves at `velocity` (odom axes)."""
    return moment(predicted(velocity=(*velocity, 0.0)), wanted=wanted, turn=turn, height=height)


def wrench(now: Step, state: WalkState | None = None) -> tuple[float, ...]:
    after, tracking = track(CONFIG, state or WalkState(0.0), now)
    return body_wrench(CONFIG, after, tracking, now, FEET)


def test_a_body_that_is_as_it_should_be_feels_its_weight_carried_and_nothing_else() -> None:
    assert wrench(step()) == pytest.approx((0.0, 0.0, MASS * GRAVITY, 0.0, 0.0, 0.0), abs=1e-3)


def test_a_body_that_is_too_slow_is_pushed_on_and_never_harder_than_the_bound() -> None:
    push, _, *_ = wrench(step((0.4, 0.0), wanted=(0.5, 0.0)))
    assert push == pytest.approx(MASS * 0.1 * (CONFIG.speed_gain + 0.005 * CONFIG.speed_integral))
    assert wrench(step(wanted=(9.0, 0.0)))[0] == pytest.approx(MASS * CONFIG.most_push)


def test_a_body_that_is_too_low_is_lifted_and_one_that_is_much_too_high_is_still_carried_a_little() -> None:
    assert wrench(step(height=0.51))[2] == pytest.approx(MASS * (GRAVITY + 0.01 * CONFIG.height_spring), rel=1e-3)
    assert wrench(step(height=0.1))[2] == pytest.approx(MASS * CONFIG.least_lift * GRAVITY)


def test_a_body_that_leans_is_turned_back() -> None:
    now = step()
    now.ahead.roll = 0.05
    assert wrench(now)[3] == pytest.approx(-0.05 * CONFIG.turn_spring[0] * now.mass.inertia[0], rel=1e-2)


def test_a_lasting_error_is_learned_up_to_the_bound_and_the_feet_are_set_back_for_it() -> None:
    state, tracking = WalkState(0.0), AT_REST
    now = step(wanted=(0.5, 0.0))
    for _ in range(2000):
        state, tracking = track(CONFIG, state, now)
    assert state.integral == pytest.approx((CONFIG.most_integral, 0.0), abs=1e-6)
    assert tracking.back == pytest.approx((0.5 / GRAVITY * CONFIG.most_integral, 0.0), abs=1e-6)
    there, here = (foothold(CONFIG, each, step(), 0, 0.0, 0.25)[0] for each in (tracking, AT_REST))
    assert there - here == pytest.approx(-tracking.back[0])


def test_the_heading_that_is_held_turns_with_the_command_and_never_runs_away_from_the_body() -> None:
    state, tracking = WalkState(0.0), AT_REST
    now = step(turn=1.0)
    for _ in range(20):
        state, tracking = track(CONFIG, state, now)
    assert state.heading == pytest.approx(0.1)
    assert tracking.lean[2] == pytest.approx(0.1)
    for _ in range(400):
        state, tracking = track(CONFIG, state, now)
    assert state.heading == pytest.approx(CONFIG.heading_error)


@pytest.mark.parametrize("leg", range(4))
def test_a_robot_that_steps_in_place_lands_below_its_hips_less_what_its_mass_lies_behind(leg: int) -> None:
    now = step()
    x, y, _ = foothold(CONFIG, AT_REST, now, leg, 0.1, 0.25)
    hip_x, hip_y = NOMINAL[leg]
    assert (x, y) == pytest.approx((hip_x - now.mass.behind, hip_y), abs=1e-6)


def test_at_the_right_speed_a_foot_lands_half_a_stance_ahead_and_when_pushed_farther_still() -> None:
    at_rest = foothold(CONFIG, AT_REST, step(), 0, 0.0, 0.25)[0]
    walking = foothold(CONFIG, AT_REST, step((1.0, 0.0), wanted=(1.0, 0.0)), 0, 0.0, 0.25)[0]
    pushed = foothold(CONFIG, AT_REST, step((1.0, 0.0)), 0, 0.0, 0.25)[0]
    hurled = foothold(CONFIG, AT_REST, step((9.0, 0.0)), 0, 0.0, 0.0)[0]
    assert walking - at_rest == pytest.approx(0.125)
    assert pushed - walking == pytest.approx(CONFIG.capture)
    assert hurled - at_rest == pytest.approx(CONFIG.most_capture)


def test_balance_is_lost_by_leaning_or_by_being_far_from_the_speed() -> None:
    fine = AT_REST._replace(error=(0.2, 0.2), lean=(0.09, -0.09, 1.0))
    assert not has_lost_balance(CONFIG, fine)
    assert has_lost_balance(CONFIG, fine._replace(lean=(0.0, -0.11, 0.0)))
    assert has_lost_balance(CONFIG, fine._replace(error=(0.25, 0.25)))
    assert not has_lost_balance(replace(CONFIG, most_error=0.5), fine._replace(error=(0.25, 0.25)))


# -- the equations in matrices ------------------------------------------------------------------------------------------------

some = settings(max_examples=30)
pair = st.tuples(speed, speed)
triple = st.tuples(speed, speed, speed)
swaying = st.tuples(st.floats(-0.1, 0.1), st.floats(-0.5, 0.5), st.floats(-2.0, 2.0))


@st.composite
def moments(draw: st.DrawFn) -> tuple[WalkState, Step]:
    """Any moment of a walk over any ground."""
    yaw = draw(angle)
    state = predicted(
        rpy=(draw(lean), draw(lean), yaw),
        position=draw(triple),
        velocity=draw(triple),
        turn=draw(triple),
        feet=UNEVEN,
    )
    terrain = sloping(draw(st.floats(-0.35, 0.35)), draw(st.floats(-0.35, 0.35)))
    height, sway = draw(st.floats(0.4, 0.55)), (draw(swaying), draw(swaying))
    now = moment(state, terrain=terrain, wanted=draw(pair), turn=draw(speed), sway=sway, height=height)
    return WalkState(yaw + draw(st.floats(-0.4, 0.4)), draw(st.tuples(st.floats(-2, 2), st.floats(-2, 2)))), now


def heading_to_odom(yaw: float) -> Floats:
    return np.array(((np.cos(yaw), -np.sin(yaw)), (np.sin(yaw), np.cos(yaw))))


@some
@given(case=moments())
def test_the_errors_are_those_of_the_equations(case: tuple[WalkState, Step]) -> None:
    before, now = case
    after, found = track(CONFIG, before, now)
    turn = heading_to_odom(now.ahead.yaw)
    error = turn.T @ (np.array(now.wanted) - now.ahead.velocity[:2]) + (now.sway[0][1], now.sway[1][1])
    integral = np.clip(np.array(before.integral) + 3.0 * error * DT, -2.0, 2.0)
    heading = now.ahead.yaw + np.clip(before.heading + now.turn * DT - now.ahead.yaw, -0.3, 0.3)
    fore, left = turn.T @ (now.terrain.slope_x, now.terrain.slope_y)
    assert found.error == pytest.approx(error, abs=1e-12)
    assert after.integral == pytest.approx(integral, abs=1e-12)
    assert after.heading == pytest.approx(heading, abs=1e-12)
    assert found.ground == pytest.approx((atan(left), -atan(fore)), abs=1e-12)
    asked = (atan(left) - now.ahead.roll, -atan(fore) - now.ahead.pitch, heading - now.ahead.yaw)
    assert found.lean == pytest.approx(asked, abs=1e-12)
    assert found.back == pytest.approx(now.height / GRAVITY * turn @ integral, abs=1e-12)


@some
@given(case=moments(), standing=st.sets(st.sampled_from(FEET), min_size=1))
def test_the_wrench_is_that_of_the_equations(case: tuple[WalkState, Step], standing: set[int]) -> None:
    state, now = case
    _, tracking = track(CONFIG, state, now)
    turn, slope = heading_to_odom(now.ahead.yaw), np.array((now.terrain.slope_x, now.terrain.slope_y))
    swaying = np.array([part[2] for part in now.sway])
    push = np.clip(6.0 * np.array(tracking.error) + state.integral, -5.0, 5.0) + swaying
    feet, velocity = np.array([now.ahead.feet[leg] for leg in standing]), np.array(now.ahead.velocity)
    height = -np.mean(feet[:, 2] - feet[:, :2] @ slope)
    lift = GRAVITY + 60.0 * (now.height - height) + 12.0 * (slope @ velocity[:2] - velocity[2])
    rate = np.array((0.0, 0.0, now.turn)) - now.ahead.turn
    about = np.array(now.mass.inertia) * (np.array((180, 180, 60)) * tracking.lean + np.array((18, 18, 12)) * rate)
    wanted = [*(MASS * turn @ push), MASS * max(0.2 * GRAVITY, lift), *(turn @ about[:2]), about[2]]
    assert body_wrench(CONFIG, state, tracking, now, sorted(standing)) == pytest.approx(wanted, abs=1e-8)


@some
@given(
    case=moments(),
    leg=st.sampled_from(FEET),
    remaining=st.floats(0.0, 0.3),
    stance=st.floats(0.1, 0.5),
    learned=st.tuples(st.floats(-0.1, 0.1), st.floats(-0.1, 0.1)),
)
def test_the_foothold_is_that_of_the_equation(
    case: tuple[WalkState, Step], leg: int, remaining: float, stance: float, learned: tuple[float, float]
) -> None:
    _, now = case
    roll, pitch = 0.2, -0.3
    tracking = Tracking((0.0, 0.0), (roll, pitch), (0.0, 0.0, 0.0), learned)
    ahead, turn = now.ahead, heading_to_odom(now.ahead.yaw)
    (fore, forward, _), (side, left, _) = now.sway
    moving = np.array(ahead.velocity[:2]) - turn @ (forward, left)
    nominal = np.array(NOMINAL[leg]) * (np.cos(pitch), np.cos(roll)) - (now.mass.behind, 0.0)
    place = heading_to_odom(ahead.yaw + ahead.turn[2] * remaining) @ nominal
    carried = np.cross((0.0, 0.0, now.turn), (*place, 0.0))[:2]
    into_turn = now.height / (2 * GRAVITY) * np.cross((*moving, 0.0), (0.0, 0.0, now.turn))[:2]
    wanted = np.array(ahead.position[:2]) - turn @ (fore, side) + moving * remaining + place
    wanted = wanted + (moving + carried) * stance / 2 + np.clip(0.12 * (moving - now.wanted), -0.25, 0.25)
    wanted = wanted + into_turn - learned
    x, y, z = foothold(CONFIG, tracking, now, leg, remaining, stance)
    assert (x, y) == pytest.approx(wanted, abs=1e-9)
    assert z == pytest.approx(-HEIGHT + now.terrain.slope_x * x + now.terrain.slope_y * y)


# -- symmetry -----------------------------------------------------------------------------------------------------------------


def turned(case: tuple[WalkState, Step], by: float) -> tuple[WalkState, Step]:
    """The same moment in a world that is turned about the vertical through the origin."""
    state, now = case
    ahead = now.ahead
    slope = turned_about_z((now.terrain.slope_x, now.terrain.slope_y, 0.0), by).tolist()
    other = predicted(
        rpy=(ahead.roll, ahead.pitch, ahead.yaw + by),
        position=as_triple(turned_about_z(ahead.position, by)),
        velocity=as_triple(turned_about_z(ahead.velocity, by)),
        turn=ahead.turn,
        feet=UNEVEN,
    )
    wx, wy, _ = turned_about_z((*now.wanted, 0.0), by).tolist()
    return state._replace(heading=state.heading + by), replace(
        now, ahead=other, terrain=sloping(slope[0], slope[1]), wanted=(wx, wy)
    )


def as_triple(vector: Floats) -> Triple:
    x, y, z = vector.tolist()
    return (x, y, z)


def mirrored(case: tuple[WalkState, Step]) -> tuple[WalkState, Step]:
    """The same moment in a mirror along the heading x."""
    state, now = case
    ahead = now.ahead
    (x, y, z), (vx, vy, vz), (wx, wy, wz) = ahead.position, ahead.velocity, ahead.turn
    other = predicted(
        rpy=(-ahead.roll, ahead.pitch, -ahead.yaw),
        position=(x, -y, z),
        velocity=(vx, -vy, vz),
        turn=(-wx, wy, -wz),
        feet=UNEVEN[list(MIRRORED)] * (1.0, -1.0, 1.0),
    )
    fore, (side, left, push) = now.sway
    mirror = replace(
        now,
        ahead=other,
        terrain=sloping(now.terrain.slope_x, -now.terrain.slope_y),
        wanted=(now.wanted[0], -now.wanted[1]),
        turn=-now.turn,
        sway=(fore, (-side, -left, -push)),
    )
    return WalkState(-state.heading, (state.integral[0], -state.integral[1])), mirror


@some
@given(case=moments(), by=st.floats(-pi, pi), leg=st.sampled_from(FEET))
def test_a_world_that_is_turned_changes_nothing_but_the_axes(case: tuple[WalkState, Step], by: float, leg: int) -> None:
    other = turned(case, by)
    linear = replace(CONFIG, most_capture=inf)  # a bound of each odom axis by itself is not the same in every direction
    results: list[tuple[tuple[float, ...], Triple]] = []
    for state, now in (case, other):
        after, tracking = track(CONFIG, state, now)
        results.append(
            (body_wrench(CONFIG, after, tracking, now, FEET), foothold(linear, tracking, now, leg, 0.1, 0.25))
        )
    (plain, place), (turned_wrench, turned_place) = results
    assert turned_wrench == pytest.approx(turned_about_z(plain, by), abs=1e-7)
    assert turned_place == pytest.approx(turned_about_z(place, by), abs=1e-9)


@some
@given(case=moments(), leg=st.sampled_from(FEET))
def test_a_mirrored_robot_does_the_mirrored_thing(case: tuple[WalkState, Step], leg: int) -> None:
    state, now = case
    other, image = mirrored(case)
    after, tracking = track(CONFIG, state, now)
    after_image, tracking_image = track(CONFIG, other, image)
    assert after_image.heading == pytest.approx(-after.heading, abs=1e-9)
    fx, fy, fz, mx, my, mz = body_wrench(CONFIG, after, tracking, now, FEET)
    found = body_wrench(CONFIG, after_image, tracking_image, image, FEET)
    assert found == pytest.approx((fx, -fy, fz, -mx, my, -mz), abs=1e-7)
    x, y, z = foothold(CONFIG, tracking, now, leg, 0.1, 0.25)
    assert foothold(CONFIG, tracking_image, image, MIRRORED[leg], 0.1, 0.25) == pytest.approx((x, -y, z), abs=1e-9)


# -- limits -------------------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(("slope_x", "slope_y"), [(3.0, 0.0), (-3.0, 0.0), (0.0, 3.0), (0.0, -3.0)])
def test_the_body_follows_the_ground_no_farther_than_half_a_radian(slope_x: float, slope_y: float) -> None:
    terrain = sloping()
    terrain.slope_x, terrain.slope_y = slope_x, slope_y
    _, tracking = track(CONFIG, WalkState(0.0), moment(terrain=terrain))
    sign_x, sign_y = np.sign(slope_x), np.sign(slope_y)
    assert tracking.lean == pytest.approx((0.5 * sign_y, -0.5 * sign_x, 0.0))


def test_uphill_a_body_that_climbs_with_the_ground_is_only_carried() -> None:
    """Going up a slope of 0.2 at 1 m/s means to rise at 0.2 m/s: no damper, no spring."""
    level = predicted(velocity=(1.0, 0.0, 0.2))
    level.feet = [(x, y, -HEIGHT + 0.2 * x) for x, y, _ in level.feet]
    now = moment(level, terrain=sloping(0.2), wanted=(1.0, 0.0))
    _, tracking = track(CONFIG, WalkState(0.0), now)
    assert body_wrench(CONFIG, WalkState(0.0), tracking, now, FEET)[2] == pytest.approx(MASS * GRAVITY)


def test_the_mass_that_is_turned_is_that_of_the_height() -> None:
    low, high = (replace(step(), height=height, mass=standing_mass(height)) for height in (0.45, 0.52))
    tilted = AT_REST._replace(lean=(0.1, 0.0, 0.0))
    ratio = (
        body_wrench(CONFIG, WalkState(0.0), tilted, high, FEET)[3]
        / body_wrench(CONFIG, WalkState(0.0), tilted, low, FEET)[3]
    )
    assert ratio == pytest.approx(standing_mass(0.52).inertia[0] / standing_mass(0.45).inertia[0])
    assert ratio > 1.1


# -- the numbers --------------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("height", "crouch"), [(0.7, 0.05), (0.0, 0.0), (0.4, 0.4), (0.5, -0.01), (float("nan"), 0.05)]
)
def test_a_height_that_no_leg_reaches_is_refused(height: float, crouch: float) -> None:
    with pytest.raises(ValueError, match=r"choose 0 <= crouch < height < 0\.6575"):
        WalkConfig(height=height, crouch=crouch)


def test_speeds_of_crouching_that_do_not_grow_are_refused() -> None:
    with pytest.raises(ValueError, match="two speeds that grow, not between 1 and 1 m/s"):
        WalkConfig(crouch_speeds=(1.0, 1.0))

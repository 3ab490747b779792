"""The drives against closed forms: torque over speed, the bus's power, heat, and what a hot drive still gives."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.linalg import expm

from robot.geometry.vectors import Vector
from robot.hardware.body import MotorTargets
from robot.model.actuators import ActuatorDesign
from robot.model.kinematics import inverse
from robot.model.stance import nominal_feet
from robot.sim.actuators import Actuators
from robot.sim.physics import PhysicsBody
from tests.robot.stage import floor

PLAIN = ActuatorDesign(no_load=24.0, knee_product=2000.0, stall=2.0, bus_current=1e6)
PEAK = np.tile([45.0, 45.0, 100.0], 4)
ALL = np.ones(12)


def most(drives: Actuators, speed: float) -> Vector:
    """The largest torques when every joint turns at `speed` and all that there is is asked for."""
    return drives.bounds(PEAK, speed * ALL, 1e6 * ALL)[1]


def test_at_rest_and_up_to_half_its_no_load_speed_a_drive_gives_its_limit_and_at_that_speed_nothing() -> None:
    drives = Actuators(PLAIN)
    assert most(drives, 0.0) == pytest.approx(PEAK)
    assert most(drives, 12.0)[0] == pytest.approx(45.0)
    assert most(drives, 18.0)[0] == pytest.approx(22.5)
    assert most(drives, 24.0)[0] == 0.0
    assert most(drives, 20.0)[2] == 0.0  # the knee: 2000 W / 100 N m


def test_a_knee_that_is_weak_at_its_angle_is_as_much_faster() -> None:
    drives = Actuators(PLAIN)
    weak = np.tile([45.0, 45.0, 50.0], 4)
    assert drives.bounds(weak, 39.0 * ALL, 1e6 * ALL)[1][2] == pytest.approx(2.5)
    assert drives.bounds(weak, 40.0 * ALL, 1e6 * ALL)[1][2] == 0.0


def test_a_drive_brakes_with_its_whole_limit_at_any_speed() -> None:
    low, high = Actuators(PLAIN).bounds(PEAK, 30.0 * ALL, -1e6 * ALL)
    assert low == pytest.approx(-PEAK)
    assert high == pytest.approx(0.0)


def test_a_rotor_at_full_command_runs_up_as_the_closed_form_says() -> None:
    inertia, dt = 0.5, 1e-4
    drives, speed = Actuators(PLAIN), 0.0
    ramp = inertia * 12.0 / 45.0  # constant torque up to half the no-load speed, then it approaches that exponentially
    for _ in range(round(0.6 / dt)):
        speed += dt * float(most(drives, speed)[0]) / inertia
    tau = inertia * 24.0 / 90.0
    assert speed == pytest.approx(24.0 - 12.0 * np.exp(-(0.6 - ramp) / tau), abs=0.01)


def test_half_the_voltage_is_half_the_no_load_speed_and_half_of_the_buss_power() -> None:
    drives = Actuators(PLAIN)
    drives.supply(0.5)
    assert most(drives, 0.0)[0] == pytest.approx(45.0)
    assert most(drives, 12.0)[0] == 0.0


@given(
    torque=st.lists(st.floats(-150.0, 150.0), min_size=12, max_size=12),
    speed=st.lists(st.floats(-30.0, 30.0), min_size=12, max_size=12),
    amperes=st.floats(1.0, 100.0),
)
def test_what_the_drives_may_give_of_what_is_wanted_never_overloads_the_bus(
    torque: list[float], speed: list[float], amperes: float
) -> None:
    design = ActuatorDesign(bus_current=amperes)
    low, high = Actuators(design).bounds(PEAK, np.array(speed), np.array(torque))
    given_ = np.clip(torque, low, high)
    power = np.maximum(given_ * speed, 0.0).sum() + 0.053 * (given_**2).sum()
    assert power <= amperes * 51.8 * (1.0 + 1e-9)
    assert np.all(np.abs(given_) <= np.minimum(PEAK, np.abs(torque)) + 1e-9)


def test_an_overloaded_bus_is_used_up() -> None:
    speed = 5.0 * ALL
    low, high = Actuators(ActuatorDesign(bus_current=40.0)).bounds(PEAK, speed, PEAK)
    torque = np.clip(PEAK, low, high)
    assert torque.dot(speed) + 0.053 * torque.dot(torque) == pytest.approx(40.0 * 51.8)
    assert torque / PEAK == pytest.approx(torque[0] / 45.0)  # all by the same factor


def test_a_lasting_torque_warms_a_drive_to_what_its_two_resistances_say() -> None:
    drives = Actuators(ActuatorDesign())
    for _ in range(20_000):
        drives.warm(0.5, np.array([30.0, *[0.0] * 11]))
    assert drives.temperature[0] == pytest.approx(25.0 + 0.053 * 30.0**2 * (0.5 + 0.7), abs=0.01)
    assert drives.temperature[1:] == pytest.approx(25.0)


def test_it_warms_as_the_matrix_exponential_of_its_two_heat_equations_says() -> None:
    design, heat, seconds = ActuatorDesign(), 0.053 * 40.0**2, 60.0
    inward, outward = 1.0 / design.winding_resistance, 1.0 / design.housing_resistance
    rates = np.array([
        [-inward / design.winding_capacity, inward / design.winding_capacity],
        [inward / design.housing_capacity, -(inward + outward) / design.housing_capacity],
    ])  # fmt: skip
    source = np.array([heat / design.winding_capacity, 0.0])
    exact = np.linalg.solve(rates, (expm(rates * seconds) - np.eye(2)) @ source)
    drives = Actuators(design)
    for _ in range(round(seconds / 0.0025)):
        drives.warm(0.0025, 40.0 * ALL)
    assert drives.temperature[0] - 25.0 == pytest.approx(exact[0], rel=1e-3)


def test_a_hot_drive_gives_less_and_at_its_last_temperature_nothing() -> None:
    drives = Actuators(PLAIN)
    seen: list[tuple[float, float]] = []
    while drives.temperature[0] < 130.0:
        seen.append((float(drives.temperature[0]), float(most(drives, 0.0)[0])))
        drives.warm(0.1, 100.0 * ALL)
    assert [torque for warmth, torque in seen if warmth <= 100.0] == pytest.approx(
        [45.0] * sum(warmth <= 100.0 for warmth, _ in seen)
    )
    warmth, torque = next(row for row in seen if row[0] > 110.0)
    assert torque == pytest.approx(45.0 * (130.0 - warmth) / 30.0)
    assert most(drives, 0.0) == pytest.approx(0.0)


@pytest.mark.parametrize(
    "wrong", [{"no_load": 0.0}, {"stall": 0.9}, {"bus_current": float("nan")}, {"derate_from": 20.0}]
)
def test_figures_that_no_drive_has_are_refused(wrong: dict[str, float]) -> None:
    with pytest.raises(ValueError, match="a drive"):
        ActuatorDesign(**wrong)


# -- in the physics body ------------------------------------------------------------------------------------------------------------


def stand(body: PhysicsBody, until: float) -> None:
    pose = inverse(nominal_feet(0.45)).joints
    zero = np.zeros(12)
    while body.time < until:
        body.command(MotorTargets(pose, zero, zero, zero + 250.0, zero + 6.0))
        body.advance(body.time + 0.005)


def test_a_body_without_a_design_has_drives_that_stay_cold() -> None:
    body = PhysicsBody(floor(), seed=1)
    stand(body, 1.0)
    assert body.actuators().temperature.size == 0
    assert (body.actuators().supplied, body.actuators().left) == (True, 1.0)


def test_standing_warms_the_knees_by_the_copper_loss_of_their_torques() -> None:
    body = PhysicsBody(floor(), seed=1, noise=False, actuators=ActuatorDesign())
    heat = np.zeros(12)
    pose, zero = inverse(nominal_feet(0.45)).joints, np.zeros(12)
    while body.time < 2.0:
        body.command(MotorTargets(pose, zero, zero, zero + 250.0, zero + 6.0))
        for _ in range(2):
            body.advance(body.time + 0.0025)
            heat += 0.0025 * 0.053 * body.joints().effort ** 2
    # 2 s are short against the winding's 50 s: hardly anything has left it
    assert body.actuators().temperature - 25.0 == pytest.approx(heat / 100.0, rel=0.05, abs=0.002)
    assert float(body.actuators().temperature[2::3].min()) > 25.1


def test_a_bus_that_gives_little_lets_the_robot_stand_up_only_so_fast() -> None:
    powers = []
    for amperes in (2.0, 60.0):
        body = PhysicsBody(floor(), seed=1, noise=False, actuators=ActuatorDesign(bus_current=amperes))
        most_power = 0.0
        pose, zero = inverse(nominal_feet(0.45)).joints, np.zeros(12)
        while body.time < 0.5:
            body.command(MotorTargets(pose, zero, zero, zero + 250.0, zero + 6.0))
            body.advance(body.time + 0.005)
            torque = body.joints().effort
            most_power = max(most_power, 0.053 * float(torque.dot(torque)))
        powers.append(most_power)
    assert powers[0] <= 2.0 * 51.8 * 1.001
    assert powers[1] > 3.0 * powers[0]


def test_without_current_the_robot_sinks_in_about_a_second_and_follows_no_command_until_it_has_current_again() -> None:
    body = PhysicsBody(floor(), seed=1, actuators=ActuatorDesign())
    stand(body, 1.5)
    assert body.truth().position[2] > 0.45
    body.supply(0.0)
    stand(body, 3.5)
    assert body.truth().position[2] < 0.2
    assert not body.actuators().supplied
    assert body.truth().power == 0.0
    body.supply(1.0)
    stand(body, 3.6)
    assert body.actuators().supplied
    assert body.truth().power > 10.0


@pytest.mark.parametrize("voltage", [-0.1, float("nan"), float("inf")])
def test_a_voltage_that_cannot_be_is_refused(voltage: float) -> None:
    with pytest.raises(ValueError, match="share of at least 0"):
        PhysicsBody(floor(), seed=1).supply(voltage)

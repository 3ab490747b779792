"""The gait controller on the physics body: modes, walking, turning, stopping, odometry, and the safe stop."""

from __future__ import annotations

import math
from math import hypot

import numpy as np
import pytest

from robot.control.gait_controller import GaitController
from robot.control.safe_stop import SafeStop
from robot.sim.physics import PhysicsBody
from robot.testing import PERIOD, Conditions, Trial
from tests.robot.stage import floor


def standing(seed: int = 1, delay: float = 0.008) -> Trial:
    trial = Trial(seed, conditions=Conditions(delay=delay))
    trial.stand_up()
    return trial


def test_it_sits_at_first_and_stands_up_when_asked() -> None:
    trial = Trial(1)
    sitting = trial.run(0.3)
    assert trial.gait.mode == "sit"
    assert sitting.height[-1] == pytest.approx(0.17, abs=0.005)
    assert sitting.power[-20:].mean() < 10.0
    trial.gait.request("stand")
    modes: list[str] = []
    for _ in range(500):
        trial.step()
        modes.append(trial.gait.mode)
    assert modes[0] == "rising"
    assert modes[-1] == "stand"
    still = trial.run(0.5)
    assert still.height.mean() == pytest.approx(0.486, abs=0.003)
    assert still.height.std() < 3e-4
    assert np.degrees(still.tilt.max()) < 0.5
    assert np.abs(np.diff(still.pose[:, :2], axis=0)).sum() < 2e-3


def test_it_trots_turns_stops_and_sits() -> None:
    trial = standing()
    trial.run(1.5, (0.6, 0.0, 0.0))
    forward = trial.run(1.5, (0.6, 0.0, 0.0))
    assert forward.averaged(0.5)[:, 0].mean() == pytest.approx(0.6, abs=0.03)
    trial.run(1.0, (0.0, 0.0, 1.0))
    turning = trial.run(1.0, (0.0, 0.0, 1.0))
    assert turning.averaged(0.5)[:, 2].mean() == pytest.approx(1.0, abs=0.03)
    assert np.abs(turning.averaged(0.5)[:, :2]).max() < 0.08
    trial.gait.request("sit")
    assert trial.gait.goal == "sit"
    modes: set[str] = set()
    for _ in range(1200):
        trial.step()
        modes.add(trial.gait.mode)
    assert modes >= {"stopping", "stand", "lowering", "sit"}
    assert trial.gait.mode == "sit"
    assert trial.body.truth().position[2] < 0.19
    assert not trial.fallen


def test_a_stop_is_clean() -> None:
    trial = standing()
    trial.run(2.0, (0.8, 0.0, 0.3))
    trial.gait.request("stand")
    stopping = trial.run(1.6)
    assert trial.gait.mode == "stand"
    assert np.linalg.norm(stopping.pose[-1, :2] - stopping.pose[0, :2]) < 0.55
    at_rest = trial.run(1.0)
    assert np.abs(at_rest.velocity[-20:, :2]).max() < 0.03


def test_zero_command_steps_in_place() -> None:
    trial = standing()
    stepping = trial.run(2.0, (0.0, 0.0, 0.0))
    assert trial.gait.mode == "walk"
    assert np.linalg.norm(stepping.pose[-1, :2] - stepping.pose[0, :2]) < 0.08
    assert not trial.fallen


def test_odometry_follows_the_truth() -> None:
    trial = standing(seed=3)
    walked = trial.run(6.0, (0.8, 0.0, 0.2))
    moved, believed = (path[-1, :2] - path[0, :2] for path in (walked.pose, walked.odometry))
    assert math.dist(moved, believed) < 0.03 * walked.distance
    turned, thought = (path[-1, 2] - path[0, 2] for path in (walked.pose, walked.odometry))
    assert turned == pytest.approx(thought, abs=0.02)
    state = trial.gait.state
    assert state.velocity[0] == pytest.approx(walked.velocity[-1, 0], abs=0.1)
    assert "mode='walk'" in repr(trial.gait)


def test_it_takes_a_push() -> None:
    trial = standing()
    trial.run(1.0, (0.0, 0.0, 0.0))
    trial.body.push((0.0, 30.0, 0.0))
    trial.run(1.5, (0.0, 0.0, 0.0))
    assert not trial.fallen
    assert abs(trial.gait.state.velocity[1]) < 0.2


def test_a_robot_that_has_fallen_stops_stepping_at_once() -> None:
    trial = standing()
    trial.run(1.0, (0.5, 0.0, 0.0))
    trial.body.push((0.0, 200.0, 0.0))
    while not trial.step().fallen:
        pass
    for _ in range(20):
        trial.step()
    assert (trial.gait.mode, trial.gait.aim) == ("lowering", "sit")
    for _ in range(300):
        trial.step()
    assert trial.gait.mode == "sit"


def test_nan_commands_change_nothing() -> None:
    gait = GaitController()
    assert gait.command(0.3, 0.0, 0.0)
    assert not gait.command(math.nan, 0.0, 0.0)
    assert gait.refused == 1


def test_unknown_modes_and_gaits_are_refused_by_name() -> None:
    gait = GaitController()
    with pytest.raises(ValueError, match="no mode 'dance'"):
        gait.request("dance")  # type: ignore[arg-type]  # pyright: ignore[reportArgumentType]
    with pytest.raises(ValueError, match="no gait 'gallop'"):
        gait.select_gait("gallop")


def test_the_same_trial_twice_is_the_same_walk() -> None:
    walks = []
    for _ in range(2):
        trial = standing(seed=5)
        walks.append(trial.run(0.5, (0.5, 0.1, 0.2)).pose)
    np.testing.assert_array_equal(walks[0], walks[1])


@pytest.mark.parametrize("command", [None, (0.8, 0.0, 0.0), (0.0, 0.3, 0.0)])
def test_the_safe_stop_sits_down_on_joint_samples_alone(command: tuple[float, float, float] | None) -> None:
    trial = standing()
    if command is not None:
        trial.run(1.2, command)
    stop, body = SafeStop(), trial.body
    start = body.time
    low_at = math.inf
    for step in range(1, 301):
        body.command(stop.step(PERIOD, body.joints()))
        body.advance(start + step * PERIOD)
        if body.truth().position[2] < 0.22:
            low_at = min(low_at, step * PERIOD)
        assert not body.truth().fallen
    assert stop.done
    assert low_at <= 1.2
    assert body.truth().position[2] == pytest.approx(0.17, abs=0.01)
    assert np.abs(body.truth().velocity).max() < 0.02


@pytest.mark.parametrize("hz", [100.0, 500.0])
def test_it_walks_at_either_end_of_the_rates_it_promises(hz: float) -> None:
    body, gait = PhysicsBody(floor(), seed=3), GaitController()
    gait.request("walk")
    for step in range(round(9.0 * hz)):
        if gait.mode == "walk":
            gait.command(0.6, 0.0, 0.0)
        body.command(gait.step(1.0 / hz, body.imu(), body.joints()))
        body.advance((step + 1) / hz)
        assert not body.truth().fallen, step / hz
    true, believed = body.truth().position, gait.state.position
    assert true[0] > 2.0
    assert hypot(true[0] - believed[0], true[1] - believed[1]) < 0.05 * true[0]


def test_a_walk_that_the_drives_took_over_goes_on_as_fast_as_the_body_is() -> None:
    trial = standing()
    trial.run(2.5, (0.8, 0.0, 0.0))
    gait, body = trial.gait, trial.body
    gait.overtake()
    assert gait.overtaken
    braking = SafeStop()
    for _ in range(40):  # 0.2 s
        gait.follow(PERIOD, body.imu(), body.joints())
        body.command(braking.step(PERIOD, body.joints(), body.imu()))
        body.advance(body.time + PERIOD)
    speed = float(body.truth().velocity[0])
    assert speed < 0.6
    assert gait.state.velocity[0] == pytest.approx(speed, abs=0.1)
    gait.step(PERIOD, body.imu(), body.joints())
    assert (gait.overtaken, gait.mode) == (False, "walk")
    assert gait.velocity_command[0] == pytest.approx(speed, abs=0.1)


def test_a_walk_that_the_drives_took_over_for_long_ends_in_sitting() -> None:
    trial = standing()
    trial.run(1.0, (0.5, 0.0, 0.0))
    gait, body = trial.gait, trial.body
    gait.overtake()
    for _ in range(101):
        gait.overtake()  # every time that it is late: said twice is said once
        gait.follow(PERIOD, body.imu(), body.joints())
    assert (gait.overtaken, gait.goal, gait.mode) == (False, "sit", "lowering")


def test_a_robot_that_does_not_walk_is_not_taken_over() -> None:
    trial = standing()
    trial.gait.overtake()
    assert not trial.gait.overtaken

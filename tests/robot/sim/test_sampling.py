"""Sensor samples are taken at the body's instants, however late they are read."""

from __future__ import annotations

import numpy as np
import pytest

from robot.sim.kinematic import KinematicBody
from robot.sim.physics import PhysicsBody
from robot.sim.sampling import KEPT
from robot.sim.simulation import Simulation
from tests.robot.stage import floor


@pytest.fixture(params=[PhysicsBody, KinematicBody])
def bodies(request: pytest.FixtureRequest) -> tuple[Simulation, Simulation]:
    """Two bodies that are the same."""
    return request.param(floor(), seed=1), request.param(floor(), seed=1)


def test_a_late_reader_gets_the_samples_a_prompt_one_got(bodies: tuple[Simulation, Simulation]) -> None:
    prompt, late = bodies
    for body in bodies:
        body.sample(200.0)
    seen = []
    for k in range(1, 9):
        prompt.advance(k * 0.005)
        seen.append(prompt.next_sample())
        assert prompt.next_sample() is None
    late.advance(0.04)
    for expected in seen:
        sample = late.next_sample()
        assert expected is not None
        assert sample is not None
        assert sample.time == expected.time
        np.testing.assert_array_equal(sample.imu.gyro, expected.imu.gyro)
        np.testing.assert_array_equal(sample.imu.accel, expected.imu.accel)
        np.testing.assert_array_equal(sample.joints.position, expected.joints.position)
    assert late.next_sample() is None


def test_samples_are_due_from_the_instant_at_which_they_were_asked_for(bodies: tuple[Simulation, Simulation]) -> None:
    body, _ = bodies
    body.advance(0.0125)
    assert body.next_sample() is None
    body.sample(100.0)
    body.advance(0.04)
    times = [sample.time for sample in iter(body.next_sample, None)]
    assert times == pytest.approx([0.0225, 0.0325])


def test_asking_again_forgets_what_waits(bodies: tuple[Simulation, Simulation]) -> None:
    body, _ = bodies
    body.sample(200.0)
    body.advance(0.02)
    body.sample(200.0)
    assert body.next_sample() is None


def test_of_too_many_samples_the_newest_stay(bodies: tuple[Simulation, Simulation]) -> None:
    body, _ = bodies
    body.sample(200.0)
    body.advance(1.0)
    times = [sample.time for sample in iter(body.next_sample, None)]
    assert len(times) == KEPT
    assert times[-1] == pytest.approx(1.0)

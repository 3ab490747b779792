"""Robots of other sizes walk by the same controllers, whose numbers follow from their figures."""

from __future__ import annotations

from dataclasses import replace
from math import cos, radians

import numpy as np
import pytest

from robot.control.command import CommandLimits
from robot.control.gaits import GAITS, gaits_of
from robot.control.walk_config import WalkConfig
from robot.hardware.sensors import Sensors
from robot.model.bodies import A2, B2, GO2
from robot.model.modes import Mode
from robot.model.robot import SPOT, ModelError, RobotModel
from robot.testing.trial import Conditions, Trial

REAL = Conditions(sensors=Sensors.real(), delay=0.004)
DOG = replace(SPOT, name="long", thigh=0.25, calf=0.3, mass=24.0, stand_height=0.38, sit_height=0.14)
"""A robot that nobody sells."""


X_LEGS = replace(SPOT, name="x-legs", knee_rear_limits=(0.247, 2.793), shoulder_rear_limits=(-2.295, 0.899))
"""Knees that point at each other, as those of an ANYmal or a HyQ."""


BETWEEN = [pytest.param(model, marks=pytest.mark.slow("sizes between those of the others")) for model in (A2, DOG)]


@pytest.mark.parametrize("model", [GO2, B2, X_LEGS, *BETWEEN], ids=lambda model: model.name)
def test_it_stands_up_walks_at_froude_0_3_without_a_line_of_code_and_sits_down(model: RobotModel) -> None:
    trial = Trial(7, conditions=REAL, model=model)
    trial.stand_up()
    assert trial.gait.mode == Mode.STAND
    assert trial.run(1.0).height[-1] == pytest.approx(model.stand_height + model.foot_radius, rel=0.02)
    speed = model.froude(0.3)
    trial.run(3.0, (speed, 0.0, 0.0))
    walked = trial.run(4.0, (speed, 0.0, 0.0))
    assert not trial.fallen
    assert float(walked.velocity[:, 0].mean()) == pytest.approx(speed, rel=0.05)
    assert float(np.cos(walked.tilt).min()) > cos(radians(5.0))
    trial.run(3.0, (0.0, 0.0, 0.0))
    trial.gait.request(Mode.SIT)
    trial.run(4.0)
    assert (trial.gait.mode, trial.fallen) == (Mode.SIT, False)


def test_a_go2_is_caught_after_a_push_that_is_as_hard_for_its_mass_as_for_the_reference_body() -> None:
    trial = Trial(7, conditions=REAL, model=GO2)
    trial.stand_up()
    trial.run(2.0, (0.4, 0.0, 0.0))
    trial.body.push((0.0, 30.0 * GO2.force * GO2.speed, 0.0))
    trial.run(3.0, (0.4, 0.0, 0.0))
    assert not trial.fallen


def test_the_numbers_of_the_reference_body_are_those_that_are_written_down() -> None:
    assert WalkConfig.of(SPOT) == WalkConfig()
    assert CommandLimits().of(SPOT) == CommandLimits()
    assert gaits_of(SPOT) is GAITS


def test_a_body_of_a_quarter_of_the_size_takes_steps_twice_as_often_at_half_the_speed() -> None:
    small = replace(
        SPOT,
        thigh=SPOT.thigh / 4,
        calf=SPOT.calf / 4,
        stand_height=SPOT.stand_height / 4,
        sit_height=SPOT.sit_height / 4,
    )
    trot, config = gaits_of(small)["trot"], WalkConfig.of(small)
    assert (trot.period, trot.clearance) == pytest.approx((0.25, 0.015))
    assert CommandLimits().of(small).forward == pytest.approx(0.8)
    assert (config.height, config.capture, config.speed_gain) == pytest.approx((0.13, 0.06, 12.0))
    assert config.turn_spring == pytest.approx((720.0, 720.0, 240.0))
    assert small.froude(0.3) == pytest.approx(SPOT.froude(0.3) / 2)


@pytest.mark.parametrize(
    ("wrong", "why"),
    [
        ({"thigh": 0.0}, "thigh is 0.0"),
        ({"stand_height": 0.7}, "stands at 0.7 m"),
        ({"sit_height": 0.5}, "sits at 0.5 m"),
        ({"mass": 10.0}, "the legs weigh more"),
        ({"torque_limit": float("nan")}, "torque_limit is nan"),
    ],
)
def test_figures_that_no_robot_has_are_refused(wrong: dict[str, float], why: str) -> None:
    with pytest.raises(ModelError, match=why):
        replace(SPOT, **wrong)  # type: ignore[arg-type]

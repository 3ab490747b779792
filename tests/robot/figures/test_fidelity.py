"""What --sensors and --actuators of an evaluation mean for the robot that is measured."""

from __future__ import annotations

from argparse import ArgumentParser

import numpy as np
import pytest

from robot.hardware.sensors import Sensors
from robot.model.actuators import ActuatorDesign
from robot.testing import Conditions, Trial
from tests.figures.fidelity import IDEAL, Fidelity, add_fidelity


def asked(*words: str) -> Fidelity:
    parser = ArgumentParser()
    add_fidelity(parser)
    return Fidelity.of(parser.parse_args(words))


def test_real_is_what_one_gets_without_asking() -> None:
    assert asked() == Fidelity("real", "real")
    assert asked("--sensors", "ideal", "--actuators", "ideal") == IDEAL
    assert asked("--actuators", "ideal").conditions(0.008, friction=0.5) == Conditions(
        delay=0.008, friction=0.5, sensors=Sensors.real(), actuators=None
    )
    assert Fidelity().drives == ActuatorDesign()


def test_ideal_conditions_are_those_that_a_trial_has_anyhow() -> None:
    pytest.importorskip("mujoco")
    here, there = Trial(3, conditions=IDEAL.conditions(0.004)), Trial(3, conditions=Conditions(delay=0.004))
    for _ in range(20):
        here.step()
        there.step()
    assert (here.body.joints().position == there.body.joints().position).all()


def test_a_trial_with_real_sensors_has_encoders_whose_zeros_are_off() -> None:
    pytest.importorskip("mujoco")
    ideal, real = (Trial(3, conditions=one.conditions(0.004)) for one in (IDEAL, Fidelity("real", "ideal")))
    off = [np.abs(one.body.joints().position - one.body.truth().joints).max() for one in (ideal, real)]
    assert off[0] < 0.003
    assert off[1] > 0.004

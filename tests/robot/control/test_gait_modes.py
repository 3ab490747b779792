"""The modes of the gait controller without physics: joints that go exactly where they are told, feet that always touch."""

from __future__ import annotations

from collections.abc import Callable
from copy import deepcopy
from functools import cache, wraps

import numpy as np
import pytest

from robot.control.catch import STEADY, STOOD
from robot.control.gait_controller import GaitController
from robot.geometry.vectors import Vector
from robot.hardware.body import ImuSample, JointSample, MotorTargets
from robot.model.kinematics import feet, inverse
from robot.model.modes import Mode
from robot.model.parameters import GRAVITY, SIT_HEIGHT, STAND_HEIGHT
from robot.model.stance import nominal_feet
from tests.robot.control.kit import AT_REST, DT


class Puppet:
    """A controller and the joints that it moves: those led by position are where they are told, the others stay."""

    def __init__(self, joints: Vector | None = None) -> None:
        self.gait = GaitController()
        self.joints = inverse(nominal_feet(SIT_HEIGHT)).joints if joints is None else joints
        self.imu: ImuSample | None = AT_REST
        self.targets: MotorTargets | None = None
        self.contact = np.ones(4, dtype=np.bool_)
        self.shake = 1e-9
        self.dead: int | None = None
        """A joint whose encoder shows nothing."""

    def step(self) -> Mode:
        shown = self.joints.copy()
        if self.dead is not None:
            shown[self.dead] = np.nan
        sample = JointSample(shown, np.zeros(12), np.zeros(12), self.contact)
        # The very same object again would mean that the IMU has nothing newer to say,
        # and one that repeats itself to the last bit while it turns is frozen.
        self.shake = -self.shake
        imu = ImuSample(self.imu.gyro * (1.0 + self.shake), self.imu.accel) if self.imu is not None else None
        self.targets = self.gait.step(DT, imu, sample)
        self.joints = np.where(self.targets.kp > 0.0, self.targets.position, self.joints)
        return self.gait.mode

    def modes(self, seconds: float, last: Mode | None = None) -> list[Mode]:
        """The modes that it goes through, each once in a row; once `last` has come, for a second more and no longer."""
        seen, left = [self.gait.mode], round(seconds / DT)
        while left > 0:
            left -= 1
            mode = self.step()
            if mode is not seen[-1]:
                seen.append(mode)
                left = min(left, round(1.0 / DT)) if mode is last else left
        return seen

    def until(self, mode: Mode) -> Puppet:
        for _ in range(2000):
            if self.gait.mode is mode:
                return self
            self.step()
        raise AssertionError(f"it never came to {mode}")


def begins(way: Callable[[], Puppet]) -> Callable[[], Puppet]:
    """A puppet that comes there once; tests get copies of it."""
    there = cache(way)
    return wraps(way)(lambda: deepcopy(there()))


@begins
def sitting() -> Puppet:
    return Puppet()


@begins
def rising() -> Puppet:
    puppet = sitting()
    puppet.gait.request("stand")
    return puppet.until(Mode.RISING)


@begins
def standing_up() -> Puppet:
    return rising().until(Mode.STAND)


@begins
def walking() -> Puppet:
    puppet = standing_up()
    puppet.gait.request("walk")
    return puppet.until(Mode.WALK)


@begins
def stopping() -> Puppet:
    puppet = walking()
    puppet.gait.request("stand")
    return puppet.until(Mode.STOPPING)


@begins
def lowering() -> Puppet:
    puppet = standing_up()
    puppet.gait.request("sit")
    return puppet.until(Mode.LOWERING)


SIT, RISING, STAND, WALK, STOPPING, LOWERING = (
    Mode.SIT,
    Mode.RISING,
    Mode.STAND,
    Mode.WALK,
    Mode.STOPPING,
    Mode.LOWERING,
)


@pytest.mark.parametrize(
    ("begin", "request_", "way"),
    [
        (sitting, "sit", [SIT]),
        (sitting, "stand", [SIT, RISING, STAND]),
        (sitting, "walk", [SIT, RISING, STAND, WALK]),
        (rising, "sit", [RISING, LOWERING, SIT]),
        (rising, "stand", [RISING, STAND]),
        (rising, "walk", [RISING, STAND, WALK]),
        (standing_up, "sit", [STAND, LOWERING, SIT]),
        (standing_up, "stand", [STAND]),
        (standing_up, "walk", [STAND, WALK]),
        (walking, "sit", [WALK, STOPPING, STAND, LOWERING, SIT]),
        (walking, "stand", [WALK, STOPPING, STAND]),
        (walking, "walk", [WALK]),
        (stopping, "sit", [STOPPING, STAND, LOWERING, SIT]),
        (stopping, "stand", [STOPPING, STAND]),
        (stopping, "walk", [STOPPING, WALK]),
        (lowering, "sit", [LOWERING, SIT]),
        (lowering, "stand", [LOWERING, RISING, STAND]),
        (lowering, "walk", [LOWERING, RISING, STAND, WALK]),
    ],
)
def test_from_every_mode_every_request_leads_by_way_of_the_modes_between(
    begin: Callable[[], Puppet], request_: str, way: list[Mode]
) -> None:
    puppet = begin()
    puppet.gait.request(request_)
    assert puppet.modes(6.0, way[-1] if len(way) > 1 else None) == way
    assert puppet.gait.goal == puppet.gait.aim == request_


@pytest.mark.parametrize("begin", [rising, standing_up, walking, stopping, lowering])
def test_interrupted_in_any_mode_it_sits_down(begin: Callable[[], Puppet]) -> None:
    puppet = begin()
    puppet.gait.interrupt()
    assert puppet.modes(2.0) == [LOWERING, SIT]
    assert puppet.gait.goal == SIT
    assert puppet.gait.velocity_command == (0.0, 0.0, 0.0)


@pytest.mark.parametrize("begin", [rising, standing_up, walking, stopping, lowering])
def test_one_that_has_fallen_goes_on_with_nothing_but_sitting_down(begin: Callable[[], Puppet]) -> None:
    puppet = begin()
    puppet.imu = ImuSample(np.array((3.0, 0.0, 0.0)), np.array((0.0, 0.0, GRAVITY)))
    puppet.contact = np.zeros(4, dtype=np.bool_)  # feet that stood still would show that the gyro is wrong
    for _ in range(200):
        puppet.step()
        if puppet.gait.goal is SIT and puppet.gait.mode is LOWERING:
            break
    puppet.imu = AT_REST
    assert (puppet.gait.mode, puppet.gait.aim) == (LOWERING, SIT)


def test_without_an_imu_a_walk_ends_standing_and_goes_on_when_it_is_back() -> None:
    puppet = walking()
    puppet.imu = None
    assert puppet.modes(3.0) == [WALK, STOPPING, STAND]
    assert "imu" in puppet.gait.lost
    assert (puppet.gait.goal, puppet.gait.aim) == (WALK, STAND)
    puppet.imu = AT_REST
    assert puppet.modes(1.0) == [STAND, WALK]
    assert "imu" not in puppet.gait.lost


def test_without_an_encoder_it_sits_down_from_a_walk_and_stays() -> None:
    puppet = walking()
    puppet.dead = 4
    puppet.modes(2.0)
    assert puppet.gait.lost[0] == "joints"  # contacts that stay closed while it steps to rest are none, either
    assert puppet.gait.mode is SIT
    puppet.gait.request("stand")
    assert (puppet.gait.goal, puppet.gait.aim) == (STAND, SIT)


def test_a_stop_in_which_an_encoder_is_lost_waits_for_the_feet_to_stand_also_after_an_earlier_one() -> None:
    puppet = walking()
    puppet.dead = 4
    puppet.until(SIT)
    puppet.dead = None
    puppet.modes(1.0)
    puppet.gait.request("walk")
    puppet.until(WALK)
    puppet.gait.command(0.6, 0.0, 0.0)
    puppet.modes(1.0)
    puppet.gait.request("stand")
    puppet.modes(STEADY)
    for _ in range(40):  # one pair comes down meanwhile, and for a moment all four feet stand
        assert puppet.step() is STOPPING
        lost = deepcopy(puppet)
        lost.dead = 4
        known = [lost.gait.lost[0] for _ in iter(lost.step, LOWERING)].count("joints")
        assert known >= STOOD / DT - 1e-9


def test_it_gathers_its_legs_no_faster_than_a_joint_may_and_rises_when_they_are() -> None:
    spread = inverse(nominal_feet(SIT_HEIGHT)).joints + 0.6
    puppet = Puppet(spread)
    puppet.gait.request("stand")
    before, gathering = spread, 0
    while puppet.step() is SIT:
        assert np.abs(puppet.joints - before).max() <= 1.5 * DT + 1e-12
        before, gathering = puppet.joints, gathering + 1
    assert gathering * DT == pytest.approx(max(0.3, (0.6 - 0.35) / 1.5), abs=2 * DT)


def test_standing_the_hips_are_at_the_standing_height_and_sitting_at_that_of_sitting() -> None:
    puppet = standing_up()
    assert feet(puppet.joints)[:, 2] == pytest.approx([-STAND_HEIGHT] * 4, abs=1e-6)
    puppet.gait.request("sit")
    puppet.modes(3.0)
    assert feet(puppet.joints)[:, 2] == pytest.approx([-SIT_HEIGHT] * 4, abs=1e-6)


def test_a_velocity_is_used_in_a_walk_only_and_forgotten_when_something_else_is_asked_for() -> None:
    puppet = standing_up()
    puppet.gait.command(0.5, 0.0, 0.0)
    puppet.modes(0.5)
    assert puppet.gait.velocity_command == (0.0, 0.0, 0.0)
    puppet.gait.request("walk")
    puppet.modes(0.2)
    assert 0.0 < puppet.gait.velocity_command[0] <= 1.5 * 0.2 + 1e-9
    puppet.gait.request("stand")
    puppet.modes(0.5)
    puppet.gait.request("walk")
    puppet.modes(0.5)
    assert puppet.gait.velocity_command == (0.0, 0.0, 0.0)


def test_a_gait_that_is_chosen_at_rest_is_the_next_walks_and_one_chosen_under_way_waits_for_all_feet() -> None:
    puppet = standing_up()
    puppet.gait.select_gait("pace")
    assert puppet.gait.gait == "pace"
    puppet.gait.request("walk")
    puppet.until(Mode.WALK)
    puppet.gait.select_gait("trot")
    assert puppet.gait.gait == "pace"
    for _ in range(400):
        led = (puppet.targets.kp > 0.0).any() if puppet.targets is not None else False
        puppet.step()
        if puppet.gait.gait == "trot":
            assert not led, "no foot was in the air"
            return
    raise AssertionError("it never changed")

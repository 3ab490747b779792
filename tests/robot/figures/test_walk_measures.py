"""What `tests.figures walk` computes from what a robot does: on a robot that does as it is told, with an error that is known."""

from __future__ import annotations

from math import cos, hypot, inf, pi, sin, sqrt
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from robot.testing import PERIOD, Conditions, Record
from tests.figures import walk_gaits, walk_measures

GIVEN = Conditions(delay=0.008)


class Obedient:
    """In place of `Trial`: goes exactly as commanded, but for what the class attributes say."""

    gain, noise, watts, drift = 1.0, 0.0, 0.0, 0.0
    fastest, strongest, sways = inf, inf, 0.0
    made: list[Obedient]

    def __init__(self, seed: int, scene: Any = None, conditions: Any = None, **more: Any) -> None:
        self.seed, self.scene, self.conditions, self.more = seed, scene, conditions, more
        self.fallen, self.place, self.heading = False, np.zeros(2), 0.0
        self.body = SimpleNamespace(push=self._push)
        self.gait = SimpleNamespace(gait=more.get("gait", "trot"), select_gait=self._select)
        self._time = 0
        self.commands: list[tuple[float, ...]] = []
        self.made.append(self)

    def _push(self, impulse: tuple[float, float, float]) -> None:
        self.fallen |= hypot(*impulse) > self.strongest

    def _select(self, gait: str) -> None:
        self.gait.gait = gait

    def stand_up(self) -> None:
        self.commands.append(())

    def spoil(self, fault: str) -> None:
        self.fallen |= fault == "IMU silent"

    def pose(self) -> tuple[float, float, float]:
        return (*self.place.tolist(), self.heading)

    def believed(self) -> tuple[float, float, float]:
        """In a frame turned by 90 degrees and moved; `drift` too long by that share."""
        x, y = (1.0 + self.drift) * self.place
        return (5.0 - y, x - 3.0, self.heading + pi / 2)

    def run(self, seconds: float, command: tuple[float, float, float] = (0.0, 0.0, 0.0)) -> Record:
        self.commands.append(command)
        count = round(seconds / PERIOD)
        self.fallen |= abs(command[0]) > self.fastest
        wave = self.noise * np.sin(2 * pi * 2.0 * PERIOD * (self._time + np.arange(count)))  # two a second
        slow = self.noise * np.sign(np.sin(2 * pi * 0.5 * PERIOD * np.arange(count) + 1e-9))
        velocity = np.tile(np.array(command) * self.gain, (count, 1))
        velocity[:, 0] += wave if self.sways else slow
        pose = np.zeros((count, 3))
        for row in range(count):
            self.heading += velocity[row, 2] * PERIOD
            ahead = np.array([cos(self.heading), sin(self.heading)])
            self.place = self.place + velocity[row, 0] * PERIOD * ahead
            pose[row] = (*self.place, self.heading)
        self._time += count
        flat, lean = np.zeros(count), np.column_stack([wave, 2.0 * wave])
        return Record(velocity, pose, pose, flat, flat, np.full(count, self.watts), lean, frozenset())


@pytest.fixture
def obedient(monkeypatch: pytest.MonkeyPatch) -> type[Obedient]:
    class One(Obedient):
        made: list[Obedient] = []

    monkeypatch.setattr(walk_measures, "Trial", One)
    monkeypatch.setattr(walk_gaits, "Trial", One)
    return One


def test_a_speed_that_is_always_missed_by_a_tenth_has_that_error(obedient: type[Obedient]) -> None:
    obedient.gain = 0.9
    assert walk_measures.speed_error(1, GIVEN, (0.6, 0.0, 0.0)) == pytest.approx(0.06)
    assert walk_measures.speed_error(1, GIVEN, (0.0, 0.0, 1.0)) == pytest.approx(0.1)
    assert {one.conditions for one in obedient.made} == {Conditions(delay=0.008)}


def test_the_sway_of_a_gait_is_no_error_and_a_slow_wave_is_one(obedient: type[Obedient]) -> None:
    obedient.noise, obedient.sways = 0.2, 1.0
    assert walk_measures.speed_error(1, GIVEN, (0.6, 0.0, 0.0)) == pytest.approx(0.0, abs=1e-12)
    obedient.sways = 0.0
    # A square wave of a second each way: the window of half a second rounds its six edges off, to a third of their square.
    expected = 0.2 * sqrt(1.0 - 6 * 0.5 * (2 / 3) / 6.5)
    assert walk_measures.speed_error(1, GIVEN, (0.6, 0.0, 0.0)) == pytest.approx(expected, rel=0.01)


def test_who_falls_has_no_error_but_infinity(obedient: type[Obedient]) -> None:
    obedient.fastest = 0.5
    assert walk_measures.speed_error(1, GIVEN, (0.6, 0.0, 0.0)) == inf
    assert walk_measures.cost_of_transport(1, GIVEN, 0.6) == inf
    assert walk_measures.odometry_error(1, GIVEN, 10.0) == inf
    assert walk_gaits.speed_error(1, GIVEN, "pace", 0.8) == inf
    assert walk_gaits.sway(1, GIVEN, "pace", 0.8) == inf


@pytest.mark.parametrize(("strongest", "survived"), [(0.0, 0.0), (4.9, 4.0), (5.0, 5.0), (57.9, 57.0), (1e3, 200.0)])
def test_the_largest_push_is_the_largest_of_the_grid_that_is_survived(
    obedient: type[Obedient], strongest: float, survived: float
) -> None:
    obedient.strongest = strongest
    assert walk_measures.largest_push(1, GIVEN, (0.6, -0.8)) == survived


def test_a_push_comes_in_each_quarter_of_the_gait(obedient: type[Obedient]) -> None:
    obedient.strongest = inf
    walk_measures.largest_push(1, GIVEN, (1.0, 0.0), most=1)
    assert len(obedient.made) == 4


def test_the_top_speed_is_the_last_one_held(obedient: type[Obedient]) -> None:
    obedient.fastest = 1.7
    assert walk_measures.top_speed(1, GIVEN) == 1.7
    obedient.gain = 0.89
    assert walk_measures.top_speed(1, GIVEN, 8) == 0.0
    obedient.gain = 0.91
    assert walk_measures.top_speed(1, GIVEN, 8) == 0.8


def test_the_cost_of_transport_is_power_by_weight_and_true_speed(obedient: type[Obedient]) -> None:
    obedient.watts, obedient.gain = 200.0, 0.5
    # 200 W and the 120 W of everything else, for 32.5 kg at a true 0.5 m/s
    assert walk_measures.cost_of_transport(1, GIVEN, 1.0) == pytest.approx(320.0 / (32.5 * 9.81 * 0.5), rel=1e-3)


def test_the_odometry_error_is_that_of_the_end_in_the_frame_of_the_start(obedient: type[Obedient]) -> None:
    obedient.drift = 0.0
    assert walk_measures.odometry_error(3, GIVEN, 20.0) == pytest.approx(0.0, abs=1e-9)
    obedient.drift = 0.01
    error = walk_measures.odometry_error(3, GIVEN, 20.0)
    robot = obedient.made[-1]
    walked = sum(command[0] * 4.0 for command in robot.commands if command)
    # `distance` is the true path by half seconds: the last one of each stretch of four is not in it
    assert error == pytest.approx(100.0 * 0.01 * float(np.hypot(*robot.place)) / (walked * 3.5 / 4.0), rel=0.02)


def test_every_fall_is_counted_and_another_robot_goes_on(obedient: type[Obedient]) -> None:
    obedient.strongest = 39.0
    assert walk_measures.falls(1, GIVEN, 40.0, push=40.0) >= 3
    assert [one.seed for one in obedient.made] == [1, *(1 + 1000 * (n + 1) for n in range(len(obedient.made) - 1))]
    obedient.strongest = 41.0
    assert walk_measures.falls(1, GIVEN, 40.0, push=40.0) == 0.0


@pytest.mark.parametrize(("direction", "slope"), [("up", (1.0, 0.0)), ("down", (-1.0, 0.0)), ("across", (0.0, 1.0))])
def test_a_slope_rises_as_steep_as_it_is_told(
    obedient: type[Obedient], direction: str, slope: tuple[float, float]
) -> None:
    assert walk_measures.steepest(1, GIVEN, direction, 45) == 45.0
    assert obedient.made[-1].conditions.slope == pytest.approx(slope)
    obedient.gain = 0.5  # it gets only half as far
    assert walk_measures.steepest(1, GIVEN, direction, 45) == 0.0


def test_the_highest_step_and_boxes_of_those_that_are_walked_over(obedient: type[Obedient]) -> None:
    assert walk_measures.step_up(1, GIVEN) == 0.40
    assert max(box.height for one in obedient.made for box in one.scene.obstacles) == pytest.approx(0.40)
    obedient.made.clear()
    assert walk_measures.box_field(1, GIVEN) == 0.30
    boxes = obedient.made[-1].scene.obstacles
    assert len(boxes) == 60
    assert max(box.height for box in boxes) <= 0.30
    obedient.fastest = 0.45
    assert walk_measures.box_field(1, GIVEN) == 0.0
    assert walk_measures.step_up(1, GIVEN) == 0.40


def test_a_gait_is_measured_by_its_mean_speed_and_its_larger_sway(obedient: type[Obedient]) -> None:
    obedient.gain, obedient.noise, obedient.sways = 1.05, 0.1, 1.0
    assert walk_gaits.speed_error(1, GIVEN, "pace", 0.8) == pytest.approx(5.0)
    # pitch is a wave of twice the amplitude 0.1 rad: its standard deviation is that by the root of two
    assert walk_gaits.sway(1, GIVEN, "pace", 0.8) == pytest.approx(np.degrees(0.2 / sqrt(2.0)))
    assert obedient.made[-1].more["gait"] == "pace"


def test_switches_go_from_each_gait_to_each_other(obedient: type[Obedient]) -> None:
    assert walk_gaits.switch_falls(1, GIVEN) == 0.0
    pairs = {(one.more["gait"], one.gait.gait) for one in obedient.made}
    assert len(pairs) == len(obedient.made) == 20
    obedient.fastest = 0.4
    assert walk_gaits.switch_falls(1, GIVEN) == 20.0


def test_a_slippery_floor_counts_falls_and_speeds_that_are_missed(obedient: type[Obedient]) -> None:
    assert walk_gaits.slippery_falls(1, GIVEN, 0.2, 0.6) == 0.0
    assert obedient.made[-1].conditions == Conditions(delay=0.008, friction=0.2)
    obedient.gain = 0.8
    assert walk_gaits.slippery_falls(1, GIVEN, 0.2, 0.6) == 1.0


def test_one_of_eleven_faults_fells_it(obedient: type[Obedient]) -> None:
    assert walk_gaits.fault_falls(1, GIVEN) == 1.0
    assert len(obedient.made) == 11


def test_the_legs_agree_with_themselves() -> None:
    assert walk_measures.point_error(3) < 1e-12
    assert walk_measures.inverse_error(3) < 1e-12
    assert walk_measures.jacobian_error(3) < 1e-8

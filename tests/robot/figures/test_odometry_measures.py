"""What `tests.figures odometry` computes from an estimate and the truth, against rotations that scipy makes."""

from __future__ import annotations

from math import degrees, inf, pi
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from robot.testing import Conditions
from tests.figures import odometry_measures
from tests.figures.odometry_measures import _errors, _level, _up, walk


def quaternion(rotation: Any) -> np.ndarray:
    """w, x, y, z."""
    return np.roll(rotation.as_quat(), 1)


@pytest.mark.parametrize("seed", range(5))
def test_up_is_the_worlds_vertical_in_body_axes(seed: int) -> None:
    turned = Rotation.random(random_state=seed)
    assert _up(quaternion(turned)) == pytest.approx(turned.inv().apply([0.0, 0.0, 1.0]))


@pytest.mark.parametrize("yaw", [-3.0, 0.0, 0.7, 2.0])
def test_a_velocity_is_seen_in_the_heading_of_the_body(yaw: float) -> None:
    velocity = np.array([0.8, -0.3, 0.1])
    assert _level(velocity, yaw) == pytest.approx(Rotation.from_euler("z", -yaw).apply(velocity)[:2])


def state(rotation: Any, velocity: tuple[float, float, float], height: float) -> SimpleNamespace:
    yaw = float(rotation.as_euler("zyx")[0])
    return SimpleNamespace(
        quaternion=quaternion(rotation), velocity=np.array(velocity), position=np.array([0.0, 0.0, height]), yaw=yaw
    )


class Wrong:
    """In place of `Trial`: an estimate that leans by 2 degrees, is 3 cm too high and 0.1 m/s too fast, and turns away by 0.001 rad/s."""

    falls_after = inf

    def __init__(self, seed: int, **more: Any) -> None:
        self._steps, self.fallen = 0, False
        self.gait = SimpleNamespace(request=lambda mode: None, command=lambda *command: None)
        self.body = SimpleNamespace(truth=self._truth)
        self._look()

    def _truth(self) -> SimpleNamespace:
        return state(Rotation.from_euler("z", self._heading), (0.0, 0.0, 0.0), 0.45)

    def _look(self) -> None:
        self._heading = pi - 0.02 + 1e-5 * self._steps  # it passes through pi meanwhile
        leaning = Rotation.from_euler("zyx", [self.believed()[2], np.radians(2.0), 0.0])
        self.gait.state = state(leaning, (0.06, 0.08, 0.0), 0.48)

    def stand_up(self) -> None: ...

    def step(self) -> None:
        self._steps += 1
        self.fallen = self._steps >= self.falls_after
        self._look()

    def pose(self) -> tuple[float, float, float]:
        return 0.0, 0.0, float(np.arctan2(np.sin(self._heading), np.cos(self._heading)))

    def believed(self) -> tuple[float, float, float]:
        yaw = self._heading + 0.001 * 0.005 * self._steps
        return 0.0, 0.0, float(np.arctan2(np.sin(yaw), np.cos(yaw)))


def test_the_errors_of_a_step_are_speed_lean_and_height() -> None:
    ahead, left, tilt, height = _errors(Wrong(1))  # type: ignore[arg-type]
    assert (ahead, left, height) == pytest.approx((0.06, 0.08, 0.03))
    assert degrees(tilt) == pytest.approx(2.0)


def test_a_minute_gives_root_mean_squares_and_a_drift_per_minute(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(odometry_measures, "Trial", Wrong)
    monkeypatch.setattr(odometry_measures, "WALK_SECONDS", 6.0)
    walk.cache_clear()
    found = walk(1, Conditions(delay=0.004))
    walk.cache_clear()
    assert (found.speed, found.tilt, found.height) == pytest.approx((0.1, 2.0, 0.03))
    assert found.yaw_drift == pytest.approx(degrees(0.06))


def test_who_falls_knows_nothing(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(odometry_measures, "Trial", type("Falling", (Wrong,), {"falls_after": 3}))
    walk.cache_clear()
    found = walk(1, Conditions(delay=0.004))
    walk.cache_clear()
    assert (found.speed, found.tilt, found.height, found.yaw_drift) == (inf, inf, inf, inf)

"""A walk without physics, to be told what its feet feel and to be read."""

from __future__ import annotations

import numpy as np

from robot.control.drive import Targets
from robot.control.gaits import GAITS, Gait
from robot.control.walk import WalkController
from robot.control.walk_config import WalkConfig
from robot.estimation.leg_odometry import Estimator
from robot.estimation.predict import PredictedState
from robot.geometry.vectors import Floats, Triple
from robot.model.kinematics import feet
from robot.model.parameters import FOOT_RADIUS
from tests.robot.control.kit import DT, HEIGHT, ZERO, estimated, predicted, pushes, sloping

CONFIG = WalkConfig(height=HEIGHT, crouch=0.0)
"""Of a walk whose feet are always as far below the hips as those of `predicted`."""


class Walk:
    """A walk of a body that stays where it is put; feet report contact as they should if not told otherwise."""

    def __init__(
        self, gait: Gait = GAITS["trot"], config: WalkConfig | None = CONFIG, state: PredictedState | None = None
    ) -> None:
        self.state = state or predicted()
        self.walker = WalkController(gait, self.state, config)
        self.estimate: Estimator = estimated()
        self.told: Triple = ZERO
        self.touch: dict[int, bool] = {}
        """Feet whose contact is not what it should be."""
        self.slope = sloping()
        self.targets = Targets()

    def step(self, dt: float = DT) -> Targets:
        self.estimate.contact = tuple(self.touch.get(leg, self.walker.swing(leg) < 0.0) for leg in range(4))
        self.targets = self.walker.step(dt, self.estimate, self.state, self.slope, self.told)
        return self.targets

    def run(self, seconds: float) -> Walk:
        for _ in range(round(seconds / DT)):
            self.step()
        return self

    def until(self, leg: int, progress: float) -> Walk:
        """Until a leg is in the air and at least so far through its swing."""
        for _ in range(2000):
            if self.walker.swing(leg) >= progress:
                return self
            self.step()
        raise AssertionError(f"leg {leg} never came to {progress} of a swing")

    def swings(self) -> list[int]:
        return [leg for leg in range(4) if self.walker.swing(leg) >= 0.0]

    def forces(self) -> Floats:
        """What the motors' torques push with, odom axes, shape (4, 3)."""
        return pushes(self.state.legs, self.targets.effort) @ np.array(self.state.rotation).T

    def arms(self) -> Floats:
        """The soles from the centre of mass, odom axes, shape (4, 3)."""
        centre = np.array(self.state.rotation) @ self.state.legs.centre
        return np.asarray(np.array(self.state.feet) - centre - (0.0, 0.0, FOOT_RADIUS))

    def foot(self, leg: int) -> Floats:
        """Where the leg's joint angles put its foot, body axes."""
        return np.asarray(feet(self.targets.position)[leg])

    def held(self, leg: int) -> bool:
        """Whether a leg is led by position: it swings, or looks for the ground."""
        return self.targets.kp[3 * leg] > 0.0

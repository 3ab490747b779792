"""What the tests of control share: robots in a stated pose, values for hypothesis, and the fields of distances around a robot."""

from __future__ import annotations

from collections.abc import Sequence
from math import inf

import numpy as np
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from robot.control.walk_law import Step
from robot.estimation.leg_odometry import Estimator
from robot.estimation.predict import PredictedState
from robot.estimation.terrain import TerrainPlane
from robot.geometry.planar import Pose2
from robot.geometry.vectors import Floats, Rows, Triple, Vector, to_ground
from robot.hardware.body import ImuSample, JointSample
from robot.model.footprint import Footprint
from robot.model.kinematics import inverse
from robot.model.legs import LegState, leg_state
from robot.model.mass import standing_mass
from robot.model.parameters import GRAVITY
from robot.model.stance import nominal_feet
from robot.navigation.local_costmap import LocalCostmap
from robot.navigation.local_field import LocalField
from robot.planning.grid import Grid
from robot.planning.path import Path
from robot.scenes.scene import Obstacle
from tests.robot.stage import floor

HEIGHT = 0.5
DT = 0.005
ZERO = (0.0, 0.0, 0.0)
NO_SWAY = (ZERO, ZERO)
AT_REST = ImuSample(np.zeros(3), np.array((0.0, 0.0, GRAVITY)))
MIRRORED = (1, 0, 3, 2)
"""Each leg's counterpart on the other side, fl, fr, rl, rr."""

angle = st.floats(-3.1, 3.1)
lean = st.floats(-0.2, 0.2)
speed = st.floats(-1.5, 1.5)


def joints_at(feet: Vector, contact: Sequence[bool] = (True,) * 4, speeds: Vector | None = None) -> JointSample:
    """The joints of a robot whose feet are at these places of the body frame, shape (4, 3)."""
    moving = np.zeros(12) if speeds is None else speeds
    return JointSample(inverse(feet).joints, moving, np.zeros(12), np.array(contact))


def standing(contact: Sequence[bool] = (True,) * 4, height: float = HEIGHT) -> JointSample:
    """The joints of a robot at rest with its feet straight below its shoulders."""
    return joints_at(nominal_feet(height), contact)


def estimated(contact: Sequence[bool] = (True,) * 4, height: float = HEIGHT) -> Estimator:
    """What is known of such a robot after one sample: level, at the origin of odom, looking along x."""
    estimate = Estimator()
    estimate.update(DT, AT_REST, standing(contact, height))
    return estimate


def rows(matrix: Floats) -> Rows:
    """A matrix as plain floats."""
    (a, b, c), (d, e, f), (g, h, i) = matrix.tolist()
    return ((a, b, c), (d, e, f), (g, h, i))


def predicted(
    *,
    rpy: Triple = ZERO,
    position: Triple = (0.0, 0.0, 0.0),
    velocity: Triple = ZERO,
    turn: Triple = ZERO,
    lead: float = 0.0,
    feet: Vector | None = None,
) -> PredictedState:
    """A robot with its feet (body axes; by default 0.5 m below its shoulders) in this attitude (roll, pitch, yaw), moving so."""
    joints = standing() if feet is None else joints_at(feet)
    state = PredictedState(estimated(), joints, lead, ZERO)
    roll, pitch, yaw = rpy
    state.rotation = rows(Rotation.from_euler("ZYX", (yaw, pitch, roll)).as_matrix())
    state.roll, state.pitch, state.yaw = rpy
    state.position, state.velocity, state.turn = position, velocity, turn
    state.legs = leg_state(state.angles, state.rotation[2])
    state.feet = [to_ground(state.rotation, foot) for foot in state.legs.feet]
    return state


def sloping(slope_x: float = 0.0, slope_y: float = 0.0, height: float = -HEIGHT) -> TerrainPlane:
    """Ground that rises by so much per metre along odom x and y and is `height` high at the origin."""
    terrain = TerrainPlane()
    feet = [(x, y, height + slope_x * x + slope_y * y) for x in (0.3, -0.3) for y in (0.2, -0.2)]
    terrain.update(inf, feet)
    return terrain


def moment(
    state: PredictedState | None = None,
    *,
    terrain: TerrainPlane | None = None,
    wanted: tuple[float, float] = (0.0, 0.0),
    turn: float = 0.0,
    sway: tuple[Triple, Triple] = NO_SWAY,
    height: float = HEIGHT,
    dt: float = DT,
) -> Step:
    """One control step of a walk, of a robot that stands at rest on level ground if not said otherwise."""
    return Step(dt, state or predicted(), terrain or sloping(), wanted, turn, sway, height, standing_mass(height))


def pushes(legs: LegState, effort: Sequence[float] | Vector) -> Floats:
    """What the feet push with beyond carrying the legs, by J' f = weight - torque; body axes, shape (4, 3)."""
    beyond = np.reshape(legs.weight, (4, 3)) - np.reshape(effort, (4, 3))
    return np.array([np.linalg.solve(np.array(j).T, row) for j, row in zip(legs.jacobians, beyond, strict=True)])


def turned_about_z(vector: Sequence[float], yaw: float) -> Vector:
    """Vectors of three, one or more after another, in a world that is turned by `yaw`."""
    return Rotation.from_euler("z", yaw).apply(np.reshape(vector, (-1, 3))).ravel()


def field(*obstacles: Obstacle, at: Pose2 | None = None, footprint: Footprint | None = None) -> LocalField:
    """The distances around a robot at the origin (or elsewhere) among these things."""
    return LocalCostmap(Grid.from_scene(floor(*obstacles, half=10.0)), footprint or Footprint()).local_field(
        at or Pose2(0.0, 0.0)
    )


def line(*points: tuple[float, float]) -> Path:
    """A path through these points."""
    return Path(np.array(points, dtype=np.float64))

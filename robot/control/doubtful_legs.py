"""Legs whose joints are not all known: where they should be by now, and how one that stands is held there."""

from __future__ import annotations

from collections.abc import Collection

from robot.control.drive import Targets
from robot.control.walk_config import SWING_DAMPER, SWING_SPRING
from robot.estimation.leg_odometry import Estimator
from robot.geometry.vectors import Triple, Vector, to_body, to_ground
from robot.hardware.body import MotorTargets
from robot.model.kinematics import feet, leg_inverse


class DoubtfulLegs:
    """The feet of a walk some of whose joints are not known. Call `joints`, then `hold`, once per control step.

    Invariant: the place of a foot is where its leg led it last, or where it has been felt on the ground since. A leg that pushes while its foot has
    not been felt yet, as at the end of a swing, is so never taken to be where it stood a stride ago.
    """

    def __init__(self) -> None:
        self._places: dict[int, Triple] = {}
        """Of each foot since there is a doubt, odom, m."""

    def joints(self, told: MotorTargets, estimate: Estimator, walking: bool) -> Vector:
        """Where the joints should be by now, shape (12,), rad: where they were told to be, or of a leg that pushes, where its foot is."""
        joints = told.position.copy()
        if not walking:
            return joints
        led = feet(told.position, estimate.legs.model).tolist()
        px, py, pz = estimate.position
        for leg in range(4):
            if told.kp[3 * leg] > 0.0:
                x, y, z = to_ground(estimate.rotation, led[leg])
                self._places[leg] = (px + x, py + y, pz + z)
                continue
            if estimate.contact[leg] or leg not in self._places:
                self._places[leg] = estimate.foot(leg)
            joints[3 * leg : 3 * leg + 3] = self._reach(estimate, leg)
        return joints

    def hold(self, targets: Targets, estimate: Estimator, doubtful: Collection[int]) -> None:
        """Let the drives hold the legs of these joints where their feet are, if they only push and their feet are not on the ground.

        A leg that pushes by joints that are not known swings freely without the ground, faster than the foot could be put down again.
        """
        if not doubtful:
            self._places.clear()
        for leg in {joint // 3 for joint in doubtful} & self._places.keys():
            joints = slice(3 * leg, 3 * leg + 3)
            if targets.kp[3 * leg] == 0.0 and not estimate.contact[leg]:
                targets.position[joints] = self._reach(estimate, leg)
                model = estimate.legs.model
                targets.kp[joints] = (SWING_SPRING * model.spring,) * 3
                targets.kd[joints] = (SWING_DAMPER * model.damper,) * 3

    def _reach(self, estimate: Estimator, leg: int) -> Triple:
        """The joints of a leg whose foot is at its place, rad."""
        (px, py, pz), (x, y, z) = estimate.position, self._places[leg]
        fx, fy, fz = to_body(estimate.rotation, (x - px, y - py, z - pz))
        model = estimate.legs.model
        hip_x, hip_y = model.hips[leg]
        hip, shoulder, knee, *_ = leg_inverse(model.sides[leg], fx - hip_x, fy - hip_y, fz, model, model.bends[leg])
        return (hip, shoulder, knee)

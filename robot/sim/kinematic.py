"""A body without forces, in numpy only: it follows commands exactly, its feet stick to the floor, and it cannot fall.

For tests, for machines without a physics engine, and for questions that are not about walking. Nothing that it
shows may be reported as walking performance. It passes through obstacles and reports which ones its outline
touches.

It is commanded in one of two ways. `KinematicBody.drive` takes a body velocity, height and mode, and does the
legs itself. `KinematicBody.command` takes motor targets like any body; without forces only joints with a position
gain can be followed, and the body goes where their standing feet push it. Either way standing feet roll on their balls as real ones do,
so that an estimator finds what it expects.
"""

from __future__ import annotations

import logging
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from math import cos, exp, isfinite, sin

import numpy as np

from robot.control.command import CommandLimits, CommandShaper
from robot.control.drive import joint_speeds
from robot.geometry.planar import ZERO_TWIST, Pose2, Twist2, placed, seen_from, turned, turned_back
from robot.geometry.vectors import Floats, Triple, Vector
from robot.hardware.body import JOINT_NAMES, LEGS, Capabilities, ImuSample, JointSample, MotorTargets
from robot.hardware.sensors import Sensors
from robot.model.kinematics import feet, inverse, leg_forward, leg_inverse, leg_jacobian, within_limits
from robot.model.legs import leg_state, torques
from robot.model.modes import GOALS, Mode
from robot.model.parameters import GRAVITY
from robot.model.power import typical_motor_power
from robot.model.robot import SPOT, RobotModel
from robot.model.stance import nominal_feet
from robot.scenes.scene import Obstacle, Scene
from robot.sim.base_body import LOST_COMMAND_TICKS, TICK, BaseBody
from robot.sim.depth_rays import sight
from robot.sim.following import chase, pushed_body
from robot.sim.kinematic_arm import KinematicArm
from robot.sim.lidar_rays import cast
from robot.sim.simulation import Truth
from robot.sim.stepping import Footwork
from robot.sim.touch import Outline

LONGEST = 10
"""Ticks of the longest step: the 200 Hz of the sensors."""
LAG = 0.15
"""The body follows its slewed command like a first-order system with this time constant, s."""
CLIMB, SINK = 0.25, 0.40
"""Fastest rise and descent of the reference body, m/s: standing up takes about 1.5 s, sitting down about one."""
WALKING_HEIGHT = 0.30
"""Below this height of the reference body, m, there is no room to step: the body stands up first."""
FASTEST_JOINT = 12.0
"""Of the reference body, rad/s."""
LEVEL: Triple = (0.0, 0.0, 1.0)
SPELL = 1.0
"""Steps that are not achievable and less than this apart, s, are logged as one."""
STILL = 0.03
"""A body slower than this, m/s and rad/s, may plant its feet."""

_log = logging.getLogger(__name__)


@dataclass(frozen=True, slots=True)
class NotAchievable:
    """A step that a real leg could not have made."""

    time: float
    """Simulated seconds."""
    reason: str
    count: int
    """How many steps were not achievable so far, this one included."""


class KinematicBody(BaseBody):
    """One robot in one scene, without dynamics; implements `Simulation`, and `drive` besides.

    Same seed, same calls: same run, bit for bit. Instants are whole ticks of 0.5 ms. `sensors` says how wrong the sensors are, `noise=False`
    gives exact ones. With `arm` it carries one, exact too. The body stays level. Joint efforts are what standing still would take: each
    standing foot carries its share of the weight.

    A step that no leg could make (a foot point out of reach or of joint limits, a joint beyond 12 rad/s) is made
    all the same, logged once per spell, and kept in `not_achievable`.
    """

    def __init__(
        self,
        scene: Scene,
        *,
        seed: int,
        noise: bool = True,
        arm: bool = False,
        sensors: Sensors | None = None,
        model: RobotModel = SPOT,
    ) -> None:
        super().__init__(scene, seed=seed, noise=noise, sensors=sensors, model=model)
        self._outline = Outline(scene, model)
        self._footwork, self._shaper = Footwork(model), CommandShaper(CommandLimits.usual(model))
        self._fastest = FASTEST_JOINT / model.speed
        self._targets: MotorTargets | None = None
        self._arm = KinematicArm(scene, lambda: self.time, self._where) if arm else None
        self.not_achievable: NotAchievable | None = None
        """The latest step that a real leg could not have made; `None` if there was none."""
        self.place(scene.start)

    def __repr__(self) -> str:
        x, y, yaw = self._pose.x, self._pose.y, self._pose.yaw
        return f"KinematicBody(scene={self._scene.name!r}, time={self.time:.4f}, x={x:.2f}, y={y:.2f}, yaw={yaw:.2f})"

    @property
    def backend(self) -> str:
        return "kinematic"

    @property
    def capabilities(self) -> Capabilities:
        """It does its legs by itself."""
        return Capabilities(steps=True)

    @property
    def arm(self) -> KinematicArm | None:
        return self._arm

    def drive(self, vx: float, vy: float, wz: float, height: float, mode: str) -> None:
        """Walk at (vx, vy) m/s forward and left, turning wz rad/s, with the hips `height` m above the foot centres.

        Velocities are clipped and slewed like those of the gait controller and count only in mode ``walk``. In
        ``stand`` and ``sit`` the body first walks to a halt and plants its feet, then takes the height. A body
        lower than 0.3 m rises before it walks. Velocities that are not numbers leave the last ones in force. Valid
        for 0.1 s.

        Raises `ValueError` for an unknown mode or a height that is not a number.
        """
        if mode not in GOALS or not isfinite(height):
            raise ValueError(
                f"A kinematic body cannot take mode {mode!r} at height {height!r} m: "
                "give 'sit', 'stand' or 'walk' and a height in metres, such as 0.45."
            )
        if not self._supplied:
            return
        if self._targets is not None:
            self._replant()
        self._shaper.ask(vx, vy, wz)
        self._asked_height, self._mode = height, Mode(mode)
        self._commanded, self._powered = self._ticks, True

    def command(self, targets: MotorTargets) -> None:
        """Follow motor targets as far as they give positions: joints without position gain keep their angle.

        Feet within 4 mm of the lowest one stand, and the body moves as the least squares of their motion
        demand. If no joint has a position gain the body stands still.
        """
        if not self._supplied:
            return
        if self._targets is None:
            self._shaper.halt()
        self._targets = targets
        self._commanded, self._powered = self._ticks, True

    def _exact_imu(self) -> ImuSample:
        """From the differentiated pose."""
        ax, ay, az = self._acceleration
        gyro = np.array([0.0, 0.0, self._twist.wz])
        return ImuSample(gyro, np.array([*turned_back(self._pose.yaw, ax, ay), az + GRAVITY]))

    def _exact_joints(self) -> JointSample:
        return JointSample(self._joints.copy(), self._speeds.copy(), self._static_torque(), np.array(self._contact))

    def _exact_ranges(self, beams: int, max_range: float) -> Vector:
        return cast(
            self._scene,
            self._pose.x,
            self._pose.y,
            self._pose.yaw,
            beams=beams,
            max_range=max_range,
            height=self._height + self._figures.foot_radius,
        )

    def _exact_rays(self, directions: Floats, max_range: float) -> Vector:
        """To obstacles and floor; its own legs are not seen."""
        c, s = cos(self._pose.yaw), sin(self._pose.yaw)
        turn = np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])
        eye = np.array([self._pose.x, self._pose.y, self._height + self._figures.foot_radius])
        scene = self._scene
        rays = np.asarray(directions @ turn.T, dtype=np.float64)
        return np.minimum(sight(scene.obstacles, scene.pits, eye, rays, max_range), max_range)

    def truth(self) -> Truth:
        """The true state of this instant."""
        position, quaternion = self._where()
        return Truth(
            position=position,
            quaternion=quaternion,
            velocity=np.array(self._velocity),
            angular_velocity=np.array([0.0, 0.0, self._twist.wz]),
            joints=self._joints.copy(),
            fallen=False,
            lying=False,
            touching=self._outline.touching(self._pose.x, self._pose.y, self._pose.yaw),
            power=self.power,
        )

    @property
    def power(self) -> float:
        """Typical motor power, W: walking by speed, standing by height, nothing when it lies or no one commands."""
        if not self._powered:
            return 0.0
        if self._stepping:
            return typical_motor_power(
                self._twist.vx, self._twist.vy, self._twist.wz, walking=True, model=self._figures
            )
        low, high = self._figures.sit_height, self._figures.stand_height
        standing = typical_motor_power(0.0, 0.0, 0.0, walking=False, model=self._figures)
        return standing * min(1.0, max(0.0, (self._height - low) / (high - low)))

    def push(self, impulse: tuple[float, float, float], duration: float = 0.1) -> None:
        """Shove the body sideways for `duration` seconds (the vertical part is ignored); a new push replaces an old
        one.

        The body slides off by impulse / mass and the lag brings it back to its command; it steps after the shove if
        it can.
        """
        duration, mass = max(duration, TICK), self._figures.mass
        self._shove = (impulse[0] / (mass * duration), impulse[1] / (mass * duration), duration)

    def place(self, pose: Pose2) -> None:
        """Put the robot down in its sitting pose at rest; what it was told before is forgotten."""
        self._pose, self._twist = pose, ZERO_TWIST
        self._height, self._velocity, self._acceleration = self._figures.sit_height, (0.0, 0.0, 0.0), (0.0, 0.0, 0.0)
        self._shove = (0.0, 0.0, 0.0)
        self._joints, self._speeds = (
            inverse(nominal_feet(self._figures.sit_height, self._figures), self._figures).joints,
            np.zeros(12),
        )
        self._forget_samples()
        self._stepping = False
        self._shaper.halt()
        self._replant()
        self._release()
        self._commanded = self._ticks
        if self._arm is not None:
            self._arm.reset()

    def set_obstacles(self, obstacles: Iterable[Obstacle]) -> None:
        """Replace what stands on the floor, from this instant on: LiDAR, camera and `Truth.touching` show the new obstacles.

        `scene` is a new value with these obstacles; start, dock, places and things stay. A map made of the scene before does not change.
        """
        self._scene = replace(self._scene, obstacles=tuple(obstacles))
        self._outline = Outline(self._scene, self._figures)

    def close(self) -> None:
        """Nothing is held that Python would not free."""

    def _integrate(self, until: float) -> None:
        end = int(until / TICK + 1e-6)
        while self._ticks < end:
            lost = self._commanded + LOST_COMMAND_TICKS
            if self._ticks >= lost:
                self._release()
                lost = end
            ahead = min(end, lost) - self._ticks
            ticks = -(-ahead // -(-ahead // LONGEST))
            self._step(ticks * TICK)
            self._ticks += ticks
            if self._arm is not None:
                self._arm.step(ticks * TICK)

    def _where(self) -> tuple[Vector, Vector]:
        """Position and attitude of the body."""
        x, y, yaw = self._pose.x, self._pose.y, self._pose.yaw
        return np.array([x, y, self._height + self._figures.foot_radius]), np.array(
            [cos(yaw / 2), 0.0, 0.0, sin(yaw / 2)]
        )

    def _release(self) -> None:
        """No one commands: stop, lie down, draw nothing."""
        if self._targets is not None:
            self._replant()
        self._shaper.ask(0.0, 0.0, 0.0)
        self._asked_height, self._mode, self._powered = self._figures.sit_height, Mode.SIT, False

    def _replant(self) -> None:
        """All feet on the floor below where they are, and the legs are ours again."""
        self._targets = None
        self._footwork.plant([self._to_world(x, y) for x, y, _ in feet(self._joints, self._figures).tolist()])
        self._contact = self._footwork.contact

    def _step(self, dt: float) -> None:
        before = self._velocity
        targets = self._targets
        height = self._step_body(dt) if targets is None else self._step_joints(dt, targets)
        climb, self._height = (height - self._height) / dt, height
        self._velocity = (*turned(self._pose.yaw, self._twist.vx, self._twist.vy), climb)
        bx, by, bz = before
        wx, wy, wz = self._velocity
        self._acceleration = ((wx - bx) / dt, (wy - by) / dt, (wz - bz) / dt)
        if targets is None:
            self._pose_legs()

    def _step_joints(self, dt: float, targets: MotorTargets) -> float:
        """Joints chase their targets and push the body; returns the new height."""
        wanted = chase(self._joints, targets)
        self._speeds = np.clip(wanted, -self._fastest, self._fastest)
        self._judge(wanted, reachable=(True,) * 4)
        self._joints = self._joints + self._speeds * dt
        pushed = pushed_body(self._joints, self._speeds, self._figures)
        self._contact = pushed.contact
        self._stepping = not all(pushed.contact)
        self._glide(dt, pushed.twist)
        return pushed.height

    def _step_body(self, dt: float) -> float:
        """The body follows its command and the feet keep up; returns the new height."""
        high_enough = self._height >= WALKING_HEIGHT * self._figures.length
        walking = self._mode == Mode.WALK and high_enough
        self._glide(dt, Twist2(*self._shaper.advance(dt, walking)))
        twist = self._twist.vx, self._twist.vy, self._twist.wz
        moving = max(abs(speed) for speed in (*twist, *self._shaper.velocity)) > STILL
        self._stepping = walking or (moving and high_enough)
        self._footwork.advance(dt, self._pose, self._twist, stepping=self._stepping)
        self._contact = self._footwork.contact
        if self._mode != Mode.WALK and (moving or not self._footwork.standing):
            return self._height
        speed = self._figures.speed
        rise = (self._asked_height - self._height) * (1.0 - exp(-dt / LAG))
        return self._height + max(-SINK * speed * dt, min(CLIMB * speed * dt, rise))

    def _glide(self, dt: float, aim: Twist2) -> None:
        """First-order lag towards the twist `aim`, shoves included; the pose moves with the mean of both twists."""
        share = 1.0 - exp(-dt / LAG)
        old = self._twist
        vx, vy = old.vx + share * (aim.vx - old.vx), old.vy + share * (aim.vy - old.vy)
        wz = old.wz + share * (aim.wz - old.wz)
        ax, ay, left = self._shove
        if left > 0.0:
            (ahead, aside), lasts = turned_back(self._pose.yaw, ax, ay), min(dt, left)
            vx, vy = vx + ahead * lasts, vy + aside * lasts
            self._shove = (ax, ay, left - dt)
        self._twist = Twist2(vx, vy, wz)
        mx, my, mw = (old.vx + vx) / 2 * dt, (old.vy + vy) / 2 * dt, (old.wz + wz) / 2 * dt
        between = Pose2(self._pose.x, self._pose.y, self._pose.yaw + mw / 2)
        self._pose = Pose2(*placed(between, mx, my), self._pose.yaw + mw)

    def _pose_legs(self) -> None:
        """Joint angles that put the feet where they are, and the joint speeds of that motion."""
        joints: list[float] = []
        speeds: list[float] = []
        reachable: list[bool] = []
        model = self._figures
        for leg, ((hip_x, hip_y), side) in enumerate(zip(model.hips, model.sides, strict=True)):
            x, y, z = self._to_body(self._footwork.feet[leg])
            q1, q2, q3, within = leg_inverse(side, x - hip_x, y - hip_y, z, model, model.bends[leg])
            if not within:
                nearest = leg_forward(side, q1, q2, q3, model)
                x, y = hip_x + nearest[0], hip_y + nearest[1]
                if self._contact[leg]:
                    self._footwork.slip(leg, *self._to_world(x, y))
            joints += (q1, q2, q3)
            reachable.append(within)
            speeds += self._leg_speeds(leg, x, y, (q1, q2, q3))
        self._joints, self._speeds = np.array(joints), np.array(speeds)
        self._judge(self._speeds, reachable)

    def _leg_speeds(self, leg: int, x: float, y: float, angles: Triple) -> Triple:
        """Joint speeds that give one foot its velocity; a standing foot's is that of a ball rolling on its contact point."""
        q1, q2, q3 = angles
        radius = self._figures.foot_radius
        jacobian = leg_jacobian(self._figures.sides[leg], q1, q2, q3, self._figures)
        vx, vy, wz = self._twist.vx, self._twist.vy, self._twist.wz
        away = (wz * y - vx, -wz * x - vy, -self._velocity[2])
        if not self._contact[leg]:
            fx, fy, fz = self._footwork.velocity[leg]
            c, s = cos(self._pose.yaw), sin(self._pose.yaw)
            return joint_speeds(jacobian, away[0] + c * fx + s * fy, away[1] + c * fy - s * fx, away[2] + fz)
        # the centre moves with w_calf x (0, 0, r), w_calf = (q1d, (q2d + q3d) cos q1, ..): linear in the joint speeds as well
        (zero, xb, xc), (ya, yb, yc), below = jacobian
        lever = radius * cos(angles[0])
        hip, shoulder, knee = joint_speeds(((zero, xb - lever, xc - lever), (ya + radius, yb, yc), below), *away)
        self._footwork.roll(leg, self._pose.yaw, lever * (shoulder + knee), -radius * hip)
        return (hip, shoulder, knee)

    def _judge(self, speeds: Vector, reachable: Sequence[bool]) -> None:
        """Keep, and log once in a spell, a step that no leg could make."""
        reason = None
        fastest = int(np.argmax(np.abs(speeds)))
        if not all(reachable):
            reason = f"foot {LEGS[reachable.index(False)]} is out of its leg's reach"
        elif not within_limits(self._joints.tolist(), margin=-1e-9, model=self._figures):
            reason = "a joint is beyond its limits"
        elif abs(speeds[fastest]) > self._fastest:
            reason = f"joint {JOINT_NAMES[fastest]} would have to turn at {abs(speeds[fastest]):.1f} rad/s"
        if reason is not None:
            last = self.not_achievable
            if last is None or self.time - last.time > SPELL:
                _log.warning("Step not achievable at %.3f s: %s.", self.time, reason)
            self.not_achievable = NotAchievable(self.time, reason, last.count + 1 if last else 1)

    def _static_torque(self) -> Vector:
        """Torques that hold the robot still: its weight in equal shares on the standing feet, and the links' own."""
        now = leg_state(self._joints.tolist(), LEVEL, self._figures)
        share = self._figures.mass * GRAVITY / max(1, sum(self._contact))
        effort = np.array(now.weight)
        for leg, stands in enumerate(self._contact):
            if stands:
                effort[3 * leg : 3 * leg + 3] += torques(now.jacobians[leg], 0.0, 0.0, share)
        return effort

    def _to_world(self, x: float, y: float) -> tuple[float, float]:
        return placed(self._pose, x, y)

    def _to_body(self, point: Triple) -> Triple:
        x, y, z = point
        return (*seen_from(self._pose, x, y), z - self._height - self._figures.foot_radius)

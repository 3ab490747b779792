"""The gait controller: sits, stands and walks. IMU and joint samples in, motor targets out; no clock, no messages, no threads."""

from __future__ import annotations

from dataclasses import dataclass, field
from math import inf, isfinite
from typing import TypeAlias

import numpy as np

from robot.control.catch import SLOW, STEADY, Settling
from robot.control.command import CommandLimits, CommandShaper
from robot.control.doubtful_legs import DoubtfulLegs
from robot.control.gait_change import GaitChange
from robot.control.gait_state import GaitState
from robot.control.gaits import gaits_of
from robot.control.safe_stop import BRAKE, SafeStop
from robot.control.senses import Senses
from robot.control.sitting import Sitting
from robot.control.stand import StandController
from robot.control.trim import Trim
from robot.control.walk import WalkController
from robot.estimation.leg_odometry import Estimator
from robot.estimation.predict import PredictedState
from robot.estimation.terrain import TerrainPlane
from robot.estimation.virtual_imu import virtual_imu
from robot.geometry.planar import turned_back
from robot.geometry.vectors import Triple, Vector
from robot.hardware.body import JOINT_NAMES, ImuSample, JointSample, MotorTargets
from robot.model.actuators import MOTOR_DELAY
from robot.model.modes import GOALS, Mode
from robot.model.robot import SPOT, RobotModel

RISE_TIME = 2.0
"""Seconds from sitting to standing and back."""
SETTLE_TIME = 0.5
"""Seconds from planting the feet after a walk to the standing height."""
LONGEST_OVERTAKEN = 0.5
"""Seconds after which a walk that the drives have taken over is not gone on with; chosen: they then begin to sit down."""
UPRIGHT = 0.5
"""Cosine of the body's tilt below which it has fallen: no step helps any more, and legs that go on stepping do harm."""
_ZERO = (0.0, 0.0, 0.0)
REST_COMMAND = 1e-6
"""A command below this in every part (m/s, rad/s) asks for rest: its ramp has come to an end."""
REST_SPEED = 0.08
"""A body slower than this (m/s) can come to rest on the feet that stand; chosen."""
TWIST = 0.04
"""The feet may be so far from a stance that is straight under the body, m: standing on them then strains no joint; chosen."""
STOP_TIME = 2.5
"""Seconds after which a walk that will not come to rest is ended all the same."""
BLIND_STOP_TIME = 0.2
"""The same without an IMU: every step is one in the dark."""
DIZZY_STOP_TIME = 1.7
"""The same with a gyro that is wrong about the tilt, s: the feet of a pair do not show how the body turns about the line between them."""


@dataclass(slots=True)
class _Planted:
    """All feet stand: it rises, stands, or lowers itself."""

    stand: StandController
    mode: Mode


@dataclass(slots=True)
class _Stop:
    """A walk comes to rest."""

    seconds: float = 0.0
    """For so long already."""
    settling: Settling = field(default_factory=Settling)
    """Whether it may end in sitting down."""


@dataclass(slots=True)
class _Walking:
    walker: WalkController
    stop: _Stop | None = None


_Doing: TypeAlias = Sitting | _Planted | _Walking | SafeStop
"""What the legs do: always one of these."""


class GaitController:
    """Turns samples into motor targets so that the robot sits, stands or walks as asked.

    Call `step` at a fixed rate, 200 Hz by design (100 to 500 Hz work). `motor_delay` (s) is how late the drives act on targets,
    as far as it is known: the controller acts on the state it predicts for that moment. `own_feet` is false for a body that steps by itself.
    `model` is the robot whose legs they are; `limits` bound its speeds, by default those of the reference body at the same Froude numbers.
    """

    def __init__(
        self,
        *,
        gait: str = "trot",
        motor_delay: float = MOTOR_DELAY,
        limits: CommandLimits | None = None,
        own_feet: bool = True,
        model: RobotModel = SPOT,
    ) -> None:
        self._model = model
        self._gaits = GaitChange(gait, model)
        self._delay = motor_delay
        self._commands = CommandShaper(limits or CommandLimits.usual(model))
        self._estimate = Estimator(model)
        self._terrain = TerrainPlane()
        self._goal: Mode = Mode.SIT
        self._doing: _Doing = Sitting(model)
        self._told: MotorTargets | None = None
        self.slips = 0
        """How often it has sat down because its feet slid."""
        self._senses = Senses(own_feet, model)
        self._doubtful = DoubtfulLegs()
        self._trim = Trim(model)
        self._overtaken_for = 0.0
        self.overtaken = False
        """Whether the drives have acted by themselves, and the walk has not rejoined its stride since."""

    def __repr__(self) -> str:
        x, y, _ = self._estimate.position
        return (
            f"GaitController(mode={self.mode.value!r}, gait={self._gaits.wanted.name!r}, position=({x:.2f}, {y:.2f}))"
        )

    @property
    def mode(self) -> Mode:
        """`sit`, `stand` or `walk`, or on the way: `rising`, `lowering`, `stopping`."""
        match self._doing:
            case Sitting():
                return Mode.SIT
            case _Planted(mode=mode):
                return mode
            case _Walking(stop=None):
                return Mode.WALK
            case _Walking():
                return Mode.STOPPING
            case SafeStop():
                return Mode.LOWERING

    @property
    def _walker(self) -> WalkController | None:
        return self._doing.walker if isinstance(self._doing, _Walking) else None

    @property
    def goal(self) -> Mode:
        """The mode asked for last."""
        return self._goal

    @property
    def aim(self) -> Mode:
        """The mode it goes to: the one asked for, as far as the sensors allow."""
        if self._senses.joints_lost:
            return Mode.SIT
        return Mode.STAND if self._goal == Mode.WALK and not self._senses.steady else self._goal

    @property
    def fallen(self) -> bool:
        """Whether it lies on its side or back, as far as it knows: no legs lift it from there."""
        return self._estimate.attitude.levelled and self._estimate.rotation[2][2] < UPRIGHT

    @property
    def lost(self) -> tuple[str, ...]:
        """The sensors that cannot be relied on: `imu`, `gyro`, `joints`, `contact fl` and so on."""
        return self._senses.lost

    @property
    def doubtful_joints(self) -> tuple[str, ...]:
        """The joints whose encoders are not believed now: they do not come, cannot be, or stick."""
        return tuple(JOINT_NAMES[joint] for joint in sorted(self._senses.doubtful_joints))

    @property
    def gait(self) -> str:
        """The gait it walks with; while it does not walk, the one it would."""
        walker = self._walker
        return (walker.clock.gait if walker is not None else self._gaits.wanted).name

    @property
    def refused(self) -> int:
        """Commands dropped because they were not numbers."""
        return self._commands.refused

    @property
    def trim(self) -> Triple:
        """What is learned of a load: lift (m/s2), turning about roll and pitch (rad/s2)."""
        return self._trim.value

    @property
    def velocity_command(self) -> tuple[float, float, float]:
        """The velocity in force: clipped and slewed (m/s, m/s, rad/s)."""
        return self._commands.velocity

    @property
    def state(self) -> GaitState:
        """The state after the latest step."""
        estimate = self._estimate
        vx, vy, vz = estimate.velocity
        return GaitState(
            mode=self.mode,
            position=np.array(estimate.position),
            quaternion=np.array(estimate.attitude.quaternion),
            velocity=np.array((*turned_back(estimate.attitude.yaw, vx, vy), vz)),
            angular_velocity=np.array(estimate.attitude.turn),
            contact=estimate.contact,
            gyro_bias=np.array(estimate.attitude.bias.value),
            slope=(self._terrain.slope_x, self._terrain.slope_y),
        )

    def command(self, vx: float, vy: float, wz: float) -> bool:
        """Ask for a velocity (m/s forward and left, rad/s counter-clockwise), used while walking.

        Clipped to the limits and slewed. False, without effect, if a part is NaN or infinite.
        """
        return self._commands.ask(vx, vy, wz)

    def correct_heading(self, error: float) -> None:
        """Turn odometry slowly: its heading is too large by `error`, rad, as other senses show. What is no number is dropped."""
        if isfinite(error):
            self._estimate.attitude.pull.seen(error)

    def request(self, mode: str) -> None:
        """Ask for `sit`, `stand` or `walk`; the controller goes there by way of the modes between. Raises ValueError for others."""
        goal = next((known for known in GOALS if known == mode), None)
        if goal is None:
            raise ValueError(f"The gait controller has no mode {mode!r}: ask for 'sit', 'stand' or 'walk'.")
        self._goal = goal
        if goal is not Mode.WALK:
            self._commands.ask(0.0, 0.0, 0.0)

    def select_gait(self, gait: str) -> None:
        """Walk with another gait. Raises ValueError for an unknown name.

        A walk under way first slows down to what the new gait is good for, and changes in a moment when all feet stand.
        """
        self._gaits.select(gait)

    def interrupt(self) -> None:
        """There were no joint samples for a while: nothing is known of the legs. Sit down from wherever they are."""
        self._crouch()

    def overtake(self) -> None:
        """The drives have acted by themselves since the last targets: the next `step` goes on with a walk from where the legs are then."""
        if not self.overtaken:
            self.overtaken, self._overtaken_for = self._walker is not None, 0.0

    def follow(self, dt: float, imu: ImuSample | None, joints: JointSample) -> None:
        """Take in a sample of a time at which the drives acted by themselves. After half a second they have brought the robot to rest: it sits."""
        joints = self._senses.joints(dt, joints, lambda: None)
        imu = self._senses.imu(dt, imu)
        if imu is not None:
            self._estimate.update(dt, imu, joints)
        self._overtaken_for += dt
        if self._overtaken_for > LONGEST_OVERTAKEN:
            self.interrupt()

    def step(
        self, dt: float, imu: ImuSample | None, joints: JointSample, contacts_silent: bool = False
    ) -> MotorTargets:
        """One control step, `dt` seconds after the last, from samples of this instant; `imu` None: it gave none.

        Samples that cannot be believed are replaced. Without an IMU the robot stands until it is back, with a wrong gyro until it has sat; without
        an encoder, when it has fallen, and on ice it sits down.
        """
        estimate = self._estimate
        joints = self._check(dt, joints, contacts_silent)
        imu = self._senses.imu(dt, imu)
        blind = imu is None
        doubtful = self._senses.gyro_doubtful
        if imu is None or any(doubtful):
            slope = (self._terrain.slope_x, self._terrain.slope_y)
            felt = virtual_imu(estimate.legs, joints, estimate.rotation, slope)
            imu = felt if imu is None else ImuSample(np.where(doubtful, felt.gyro, imu.gyro), imu.accel)
        walker = self._walker
        if isinstance(self._doing, _Planted | _Walking) and self.fallen:
            self._crouch(steps=False)
        elif walker is not None and walker.slippery and self._senses.feels_ground:
            self.slips += 1
            vx, vy, _ = self.state.velocity.tolist()
            self._crouch(steps=False, speed=(vx, vy))
        targets = self._act(dt, imu, joints, blind)
        self._told = targets
        self._senses.told(targets, stepping=self.mode is Mode.WALK)
        return targets

    def _expected(self) -> Vector | None:
        """Where the joints should be by now, shape (12,), rad."""
        if self._told is None:
            return None
        return self._doubtful.joints(self._told, self._estimate, self._walker is not None)

    def _check(self, dt: float, joints: JointSample, contacts_silent: bool) -> JointSample:
        """The joint sample with what cannot be believed replaced; without an encoder the safe stop takes over."""
        joints = self._senses.joints(dt, joints, self._expected)
        if self._senses.joints_lost:
            if isinstance(self._doing, _Planted):
                self._crouch(steps=False)
            elif isinstance(self._doing, _Walking):
                self._commands.ask(0.0, 0.0, 0.0)
        return self._senses.contacts(dt, joints, self._estimate, self._walker, contacts_silent)

    def _crouch(self, *, steps: bool = True, speed: tuple[float, float] | None = None) -> None:
        """Give up whatever goes on, and sit down by the safe stop, after steps that bring a walk to rest if `steps`. `speed`: as `SafeStop` has it."""
        self._goal = Mode.SIT
        self.overtaken = False
        self._commands.halt()
        self._doing = SafeStop(self._model, steps=steps, speed=speed)

    def _act(self, dt: float, imu: ImuSample, joints: JointSample, blind: bool) -> MotorTargets:
        estimate, doing, walker = self._estimate, self._doing, self._walker
        still = isinstance(doing, Sitting) or (
            isinstance(doing, _Planted) and doing.mode == Mode.STAND and doing.stand.arrived
        )
        estimate.update(dt, imu, joints, walker.leaving() if walker else (False,) * 4, still, blind)
        self._senses.turn(dt, estimate, self.mode)
        if walker is not None and not self._senses.gyro_doubtful[0]:
            self._terrain.update(dt, estimate.contacts)
        acceleration = walker.acceleration if walker else _ZERO
        ahead = PredictedState(estimate, joints, self._delay + 0.5 * dt, acceleration)
        if self.overtaken and isinstance(doing, _Walking):
            self._rejoin(doing, ahead)
        self._change(dt, ahead, joints)
        walker = self._walker
        bounds = self._gaits.bounds(walker) if walker is not None else ()
        # A walk that a failed sensor ends: slowed at once, feet in the air would land too far ahead; slowly, it goes on with a wrong gyro for too long.
        least = BRAKE if self._senses.joints_lost or not self._senses.steady else 0.0
        command = self._commands.advance(dt, self.mode == Mode.WALK, *bounds, least_slew=least)
        match self._doing:
            case _Walking(walker=walker):
                walker.wary = self._senses.gyro_doubtful[0]
                walking = walker.step(dt, estimate, ahead, self._terrain, command)
                self._doubtful.hold(walking, estimate, self._senses.doubtful_joints)
                return walking.freeze()
            case _Planted(stand=stand):
                return stand.step(dt, ahead).freeze()
            case SafeStop() as safe:
                return safe.step(dt, joints, imu if self._senses.steady else None)
            case Sitting() as sitting:
                self._trim.reset()
                return sitting.step(dt, joints, estimate.legs.weight).freeze()

    def _rejoin(self, walking: _Walking, ahead: PredictedState) -> None:
        """Go on with a walk from where the legs are, as fast as the body is."""
        self.overtaken = False
        if walking.stop is not None:
            walking.stop.settling = Settling()
        walking.walker = WalkController(gaits_of(self._model)["trot"], ahead, trim=self._trim)
        walking.walker.join(self._estimate, ahead)
        vx, vy, _ = ahead.velocity
        self._commands.resume(*turned_back(ahead.yaw, vx, vy), ahead.turn[2])

    def _change(self, dt: float, ahead: PredictedState, joints: JointSample) -> None:
        """Take the next step towards the mode asked for, if this one is finished."""
        match self._doing:
            case SafeStop() as safe:
                if safe.done:
                    self._doing = Sitting(self._model)
            case Sitting() as sitting:
                if self.aim != Mode.SIT and sitting.may_rise(joints):
                    self._plant(Mode.RISING, ahead, self._model.stand_height, weight=0.0)
            case _Planted() as planted:
                self._stand_on(planted, ahead)
            case _Walking() as walking:
                self._walk_on(dt, ahead, walking)

    def _stand_on(self, planted: _Planted, ahead: PredictedState) -> None:
        """Rise, lower, or begin to walk."""
        goal, stand = self.aim, planted.stand
        if goal == Mode.SIT and planted.mode != Mode.LOWERING:
            planted.mode = Mode.LOWERING
            stand.go(self._model.sit_height, RISE_TIME)
        elif goal != Mode.SIT and planted.mode == Mode.LOWERING:
            planted.mode = Mode.RISING
            stand.go(self._model.stand_height, RISE_TIME)
        elif planted.mode == Mode.STAND:
            if goal == Mode.WALK:
                self._gaits.begin()
                self._doing = _Walking(WalkController(self._gaits.wanted, ahead, trim=self._trim))
                self._terrain.update(inf, self._estimate.contacts)
        elif stand.arrived and planted.mode == Mode.RISING:
            planted.mode = Mode.STAND
        elif stand.arrived:
            self._doing = Sitting(self._model)

    def _walk_on(self, dt: float, ahead: PredictedState, walking: _Walking) -> None:
        """Keep walking, change the gait, or come to rest and plant the feet."""
        walker = walking.walker
        if self.aim == Mode.WALK:
            walking.stop, walker.halting = None, False
            self._gaits.step(dt, walker, ahead, self._commands.velocity)
            return
        stop = walking.stop = walking.stop or _Stop()
        stop.seconds += dt
        if self._senses.joints_lost:
            slow = stop.seconds > STEADY and walker.speed(ahead) < SLOW
            if stop.settling.step(dt, walker, slow, self._estimate.contact) or stop.seconds > STOP_TIME:
                self._crouch(steps=False)
            return
        if walker.halting:
            if not walker.swinging:
                self._commands.halt()
                self._plant(Mode.STAND, ahead, self._model.stand_height, weight=1.0)
        elif max(abs(part) for part in self._commands.velocity) < REST_COMMAND:
            speed = walker.speed(ahead)
            feet = np.array(ahead.legs.feet)[:, :2] - np.array(self._model.nominal)
            untwisted = np.abs(feet - feet.mean(axis=0)).max() < TWIST
            walker.halting = (speed < REST_SPEED and bool(untwisted)) or stop.seconds > self._patience()

    def _patience(self) -> float:
        """Seconds after which a walk that will not come to rest is ended all the same."""
        if self._senses.imu_lost:
            return BLIND_STOP_TIME
        return DIZZY_STOP_TIME if self._senses.gyro_doubtful[0] else STOP_TIME

    def _plant(self, mode: Mode, ahead: PredictedState, height: float, weight: float) -> None:
        planted = _Planted(StandController(ahead, weight, self._trim), mode)
        planted.stand.go(height, RISE_TIME if mode == Mode.RISING else SETTLE_TIME)
        self._doing = planted

"""The gait node: one step of the gait controller for each joint state, from sensor samples to motor targets."""

from __future__ import annotations

import math
from typing import Final

import numpy as np

from actors import Node, every, parameter, publishes
from actors.interfaces.geometry_msgs.msg import (
    Point,
    Pose,
    PoseWithCovariance,
    Quaternion,
    Twist,
    TwistWithCovariance,
    Vector3,
)
from actors.interfaces.nav_msgs.msg import Odometry
from actors.interfaces.sensor_msgs.msg import Imu, JointState
from actors.interfaces.std_msgs.msg import Float64, Header
from actors.interfaces.std_srvs.srv import Trigger, Trigger_Request, Trigger_Response
from robot.contracts import (
    BATTERY_STATUS,
    BODY_DRIVE,
    CMD_VEL,
    CONTACTS,
    GAIT_STATUS,
    HEADING_ERROR,
    IMU,
    JOINT_STATES,
    MOTOR_TARGETS,
    ODOMETRY,
    SAFETY_STATE,
    SIT,
    STAND,
    WALK,
)
from robot.control.gait_controller import GaitController
from robot.control.stop_causes import how_to_go_on
from robot.hardware.body import ImuSample, JointSample, MotorTargets
from robot.hardware.overdue import SPAN
from robot.interfaces.robactor_msgs.msg import BatteryStatus, BodyDrive, FootContacts, GaitStatus, SafetyState
from robot.interfaces.robactor_msgs.msg import MotorTargets as MotorTargetsMessage
from robot.model.actuators import MOTOR_DELAY, SILENCE
from robot.model.charge import ChargeLevel
from robot.model.modes import ON_ITS_FEET, Mode
from robot.model.parameters import JOINT_LIMITS
from robot.model.robot import SPOT, RobotModel

FRESH = 0.02
"""A sample that is older, s, is not what the legs do now."""
SHORTEST = 0.001
"""Of a control step, s, also when the clock was set back."""
TROUBLES: Final = {
    "imu": ("IMU is silent or cannot be believed", "standing without it"),
    "gyro": (
        "the gyro shows another turn than the standing feet do",
        "coming to rest; sit down to try it again",
    ),
    "joints": ("a joint encoder is silent or cannot be believed, or sticks", "sitting down"),
}
"""Sensors without which the robot does not walk: what is wrong, and what the gait does about it."""
BEGUN: Final = {
    Mode.STAND: "Robot is standing up",
    Mode.SIT: "Robot is sitting down",
    Mode.WALK: "Robot begins to walk",
}
DONE: Final = {Mode.STAND: "Robot is now standing", Mode.SIT: "Robot is now sitting", Mode.WALK: "Robot is now walking"}
"""The answer to a request for a mode: that it is on the way, or there."""
FALLEN, TURN_IT = "lies on its side or back", "turn it onto its belly, then ask again"


class Gait(Node):
    """Sits, stands and walks. Takes imu/data, foot_contacts, joint_states, odom/heading_error, cmd_vel, battery_status, safety/state; serves
    spot/sit, spot/stand, spot/walk.

    A service answers at once, with success where the robot is in that mode or has begun to go there; gait_status says when it has arrived. During
    an emergency stop, with a critical battery, without its sensors and on its back the robot does not rise: the answer says why, and how to go on.

    Publishes motor_targets (200 Hz), or body_drive for a robot that walks by itself, odom (50 Hz) and gait_status. Parameters: commands, motor_delay, gait,
    command_timeout, sensor_timeout.
    """

    targets = publishes(MOTOR_TARGETS)
    drive = publishes(BODY_DRIVE)
    odometry = publishes(ODOMETRY)
    status = publishes(GAIT_STATUS)
    commands = parameter(
        "motor_targets",
        choices=("motor_targets", "body_drive"),
        read_only=True,
        description="What the robot takes: targets of its motors, or a velocity, if it walks by itself.",
    )
    motor_delay = parameter(
        MOTOR_DELAY,
        unit="s",
        ge=0.0,
        le=0.02,
        read_only=True,
        description="How late the drives act, as far as is known.",
    )
    gait = parameter(
        "trot",
        choices=("trot", "crawl", "pace", "bound", "pronk"),
        description="May be set at any time; a walk under way slows down as far as the new gait needs and changes when all feet stand.",
    )
    command_timeout = parameter(
        0.5, unit="s", ge=0.05, le=5.0, description="After so long without a command on cmd_vel it steps in place."
    )
    sensor_timeout = parameter(
        0.1, unit="s", ge=0.05, le=1.0, description="Encoders or contacts that are silent for longer are lost."
    )

    def __init__(self, model: RobotModel = SPOT) -> None:
        self._model = model

    async def on_start(self) -> None:
        self._asked_gait = self.gait
        self._controller = GaitController(
            gait=self._asked_gait,
            motor_delay=self.motor_delay,
            own_feet=self.commands == "motor_targets",
            model=self._model,
        )
        self._imu: ImuSample | None = None
        self._joints_heard = self._contacts_heard = self._commanded = self._sent = -1.0
        self._contact = np.ones(4, dtype=np.bool_)
        self._stepped: float | None = None
        self._steps = 0
        self._mode = self._used_gait = ""
        self._critical = False
        self._lost: tuple[str, ...] = ()
        self._stopped = ""
        self._slips = 0
        self._ignored = False

    # -- sensors ------------------------------------------------------------------------------------------------------------

    @IMU.on()
    def imu(self, message: Imu) -> None:
        w, a = message.angular_velocity, message.linear_acceleration
        self._imu = ImuSample(np.array((w.x, w.y, w.z)), np.array((a.x, a.y, a.z)))

    @CONTACTS.on()
    def contacts(self, message: FootContacts) -> None:
        self._contact = message.contact
        self._contacts_heard = self.clock.now()

    @HEADING_ERROR.on()
    def heading_error(self, message: Float64) -> None:
        if math.isfinite(message.data):
            self._controller.correct_heading(message.data)

    @JOINT_STATES.on()
    def joints(self, message: JointState) -> None:
        """One control step, from the samples of this instant."""
        if not len(message.position) == len(message.velocity) == len(message.effort) == len(JOINT_LIMITS):
            return  # nobody's joints, or another robot's: our own, if they are silent, are missed
        now = self._joints_heard = self.clock.now()
        controller = self._controller
        sampled = message.header.stamp.sec + 1e-9 * message.header.stamp.nanosec
        gap = 0.005 if self._stepped is None else sampled - self._stepped
        self._stepped = sampled
        if gap > self.sensor_timeout:  # by the samples' own time: a loop that was held up has not lost any
            self.log.warning("joint encoders are back: sitting down", seconds=round(gap, 2))
            controller.interrupt()
        dt = min(max(gap, SHORTEST), SPAN)
        if self.gait != self._asked_gait:
            self._asked_gait = self.gait
            controller.select_gait(self._asked_gait)
        if self._commanded >= 0.0 and now - self._commanded > self.command_timeout:
            self._commanded = -1.0
            controller.command(0.0, 0.0, 0.0)
        sample = JointSample(message.position, message.velocity, message.effort, self._contact)
        if now - self._sent > SILENCE:
            controller.overtake()
        if controller.overtaken and self.clock.wall() - sampled > FRESH:
            controller.follow(dt, self._imu, sample)
        else:
            self._send(controller.step(dt, self._imu, sample, now - self._contacts_heard > self.sensor_timeout))
            self._sent = now
        if controller.lost != self._lost:
            self._warn(controller.lost)
        if controller.slips != self._slips:
            self._slips = controller.slips
            self.log.error(
                "the feet slide on a slippery floor: sitting down; lead the robot to better ground, then ask it to walk again"
            )
        self._steps += 1
        if self._steps % 4 == 0:
            self.odometry(self._odometry(message.header))
        if controller.mode != self._mode or controller.gait != self._used_gait:
            self._report()

    # -- commands -----------------------------------------------------------------------------------------------------------

    @CMD_VEL.on()
    def command(self, message: Twist) -> None:
        if self._controller.goal != Mode.WALK:
            if not self._ignored:
                self.log.warning("Not in walk mode, ignoring cmd_vel")
            self._ignored = True
            return
        self._ignored = False
        if self._controller.command(message.linear.x, message.linear.y, message.angular.z):
            self._commanded = self.clock.now()
        else:
            self.log.warning("velocity command is not a number: dropped", refused=self._controller.refused)

    @STAND.serve()
    async def stand(self, request: Trigger_Request) -> Trigger_Response:
        return self._ask(Mode.STAND)

    @SIT.serve()
    async def sit(self, request: Trigger_Request) -> Trigger_Response:
        return self._ask(Mode.SIT)

    @WALK.serve()
    async def walk(self, request: Trigger_Request) -> Trigger_Response:
        return self._ask(Mode.WALK)

    @SAFETY_STATE.on()
    def safety(self, message: SafetyState) -> None:
        """A robot that rises when it is stopped goes down again; one that is stopped does not rise."""
        stopped = "; ".join(message.reasons) if message.stopped else ""
        if stopped and not self._stopped and self._controller.mode == Mode.RISING:
            self.log.warning("stopped while rising: sitting down", why=stopped)
            self._controller.request(Mode.SIT)
        self._stopped = stopped

    @BATTERY_STATUS.on()
    def battery(self, message: BatteryStatus) -> None:
        """A critical battery sits the robot down, unless it is on the charger; it walks again when the level is a better one."""
        critical = message.level == ChargeLevel.CRITICAL
        if critical and not message.charging and not self._critical:
            self._critical = True
            self.log.error("battery critical: sitting down", percent=round(message.percent, 1), gauge="coulomb count")
            self._controller.request(Mode.SIT)
        elif not critical:
            self._critical = False

    # -- reports ------------------------------------------------------------------------------------------------------------

    @every(hz=10)
    def report(self) -> None:
        if self._encoders_silent():
            self.log.error(
                "joint encoders are silent: no motor targets", seconds=round(self.clock.now() - self._joints_heard, 2)
            )
        self._report()

    def _encoders_silent(self) -> bool:
        return self._joints_heard >= 0.0 and self.clock.now() - self._joints_heard > self.sensor_timeout

    def _ask(self, mode: Mode) -> Trigger_Response:
        objection = self._objection(mode)
        if objection:
            return Trigger.Response(success=False, message=objection)
        self._controller.request(mode)
        if self._controller.fallen:
            return Trigger.Response(success=False, message=f"the robot {FALLEN}, with its legs gathered: {TURN_IT}")
        there = self._controller.mode == mode
        return Trigger.Response(success=True, message=(DONE if there else BEGUN)[mode])

    def _objection(self, mode: Mode) -> str:
        """Why the robot cannot go to this mode now, and what to do about it; nothing if it can."""
        if mode == Mode.SIT:
            return ""
        controller = self._controller
        if self._critical:
            return f"battery critical: refusing to {mode}"
        if self._stopped and (mode == Mode.WALK or controller.mode not in ON_ITS_FEET):
            return f"emergency stop ({self._stopped}): refusing to {mode}; {how_to_go_on(f'ask to {mode} again')}"
        if controller.fallen:
            return f"the robot {FALLEN}: refusing to {mode}; {TURN_IT}"
        if "joints" in self._lost or self._encoders_silent():
            return f"{TROUBLES['joints'][0]}: refusing to {mode}; it can when they are back"
        if mode == Mode.WALK and "imu" in self._lost:
            return "no IMU: refusing to walk"
        if mode == Mode.WALK and "gyro" in self._lost:
            return "the gyro is wrong: refusing to walk; sit down to try it again"
        return ""

    def _warn(self, lost: tuple[str, ...]) -> None:
        """Log which sensors were lost, what the gait does about it, and which have come back."""
        for sensor in lost:
            if sensor not in self._lost:
                trouble, remedy = TROUBLES.get(
                    sensor, (f"{sensor} is silent or cannot be believed", "walking by schedule")
                )
                if sensor == "joints":
                    encoders = ", ".join(self._controller.doubtful_joints)
                    self.log.warning(f"{trouble}: {remedy}", sensor=sensor, encoders=encoders)
                else:
                    self.log.warning(f"{trouble}: {remedy}", sensor=sensor)
        for sensor in self._lost:
            if sensor not in lost:
                self.log.info(f"{'IMU' if sensor == 'imu' else sensor} is back", sensor=sensor)
        self._lost = lost

    def _send(self, targets: MotorTargets) -> None:
        stamp = self.clock.stamp()
        if self.commands == "motor_targets":
            self.targets(
                MotorTargetsMessage(
                    stamp=stamp,
                    fence=self.fencing_token,
                    position=targets.position,
                    velocity=targets.velocity,
                    effort=targets.effort,
                    kp=targets.kp,
                    kd=targets.kd,
                )
            )
            return
        goal = self._controller.aim
        vx, vy, wz = self._controller.velocity_command if goal == Mode.WALK else (0.0, 0.0, 0.0)
        self.drive(
            BodyDrive(
                stamp=stamp,
                fence=self.fencing_token,
                vx=vx,
                vy=vy,
                wz=wz,
                height=self._model.sit_height if goal == Mode.SIT else self._model.stand_height,
                mode=goal.value,
            )
        )

    def _odometry(self, header: Header) -> Odometry:
        state = self._controller.state
        x, y, z = state.position.tolist()
        qw, qx, qy, qz = state.quaternion.tolist()
        vx, vy, vz = state.velocity.tolist()
        wx, wy, wz = state.angular_velocity.tolist()
        return Odometry(
            header=Header(stamp=header.stamp, frame_id="odom"),
            child_frame_id="base_link",
            pose=PoseWithCovariance(
                pose=Pose(position=Point(x=x, y=y, z=z), orientation=Quaternion(x=qx, y=qy, z=qz, w=qw))
            ),
            twist=TwistWithCovariance(twist=Twist(linear=Vector3(x=vx, y=vy, z=vz), angular=Vector3(x=wx, y=wy, z=wz))),
        )

    def _report(self) -> None:
        self._mode, self._used_gait = self._controller.mode, self._controller.gait
        self.status(
            GaitStatus(
                stamp=self.clock.stamp(),
                mode=self._controller.mode.value,
                goal=self._controller.goal.value,
                height=float(self._controller.state.position[2]),
                sensors_ok=TROUBLES.keys().isdisjoint(self._lost) and not self._encoders_silent(),
                gait=self._used_gait,
            )
        )

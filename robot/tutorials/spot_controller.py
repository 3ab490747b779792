"""A quadruped's joints as the tutorials move them: sit, stand with balance, and a trot of sines. No physics, no feet on a floor.

The robot that really walks is `robot.nodes.gait`. Here the commanded angles are published as if they were measured, as the tutorial does.
"""

from __future__ import annotations

from math import asin, atan2, cos, hypot, inf, isfinite, pi, sin

from actors import Node, Service, Supervisor, Topic, every, publishes, qos
from actors.interfaces.geometry_msgs.msg import Quaternion, Twist, Vector3
from actors.interfaces.sensor_msgs.msg import Imu, JointState
from actors.interfaces.std_msgs.msg import Header
from actors.interfaces.std_srvs.srv import Trigger, Trigger_Request, Trigger_Response
from robot.hardware.body import JOINT_NAMES, LEGS
from robot.tutorials.program import main, system

JOINT_STATES = Topic(JointState, "/joint_states", 10)
CMD_VEL = Topic(Twist, "/cmd_vel", 10)
IMU = Topic(Imu, "/imu/data", qos.SENSOR_DATA)
"""Best effort, as its publisher: a reliable subscriber would never get it."""
STAND = Service(Trigger, "/spot/stand")
SIT = Service(Trigger, "/spot/sit")
WALK = Service(Trigger, "/spot/walk")

RATE = 100
"""Hz."""
SITTING: tuple[float, ...] = (0.0, -1.2, 2.4) * 4
NEUTRAL: tuple[float, ...] = (0.0,) * 12
FASTEST = 4.0
"""No joint moves faster, rad/s: a change of mode is a motion, not a jump."""
SILENCE = 0.5
"""Seconds after which the last velocity is forgotten, and the IMU counts as lost."""

AMPLITUDE, FREQUENCY = 0.3, 2.0
"""Of the trot: rad and Hz."""
SWAY = 0.05
"""Of the hips, rad."""
LEAN, FARTHEST_LEAN = 0.5, 0.3
"""Radians of joint for each radian of tilt, and at most."""

DIAGONAL = {"fl": 1.0, "fr": -1.0, "rl": -1.0, "rr": 1.0}
"""FL with RR, and half a period later FR with RL."""


def trot(t: float, vx: float = 0.0, vy: float = 0.0, wz: float = 0.0) -> tuple[float, ...]:
    """The 12 angles (rad) `t` seconds after the first step, for velocities in m/s and rad/s; without any it steps in place.

    Each leg is lifted by shoulder and knee together and swings a quarter of a period later, the farther the faster it shall go; turning
    left, the legs on the right swing farther. No angle exceeds the amplitude.
    """
    angle = 2.0 * pi * FREQUENCY * t
    lift, swing = sin(angle), cos(angle)
    angles: list[float] = []
    for leg in LEGS:
        sign, turn = DIAGONAL[leg], wz if leg.endswith("r") else -wz
        stride = max(-1.0, min(1.0, vx + turn))
        angles += (
            sign * (SWAY * lift + SWAY * max(-1.0, min(1.0, vy)) * swing),
            sign * AMPLITUDE / 2 * (stride * swing - lift),
            sign * AMPLITUDE * lift,
        )
    return tuple(angles)


def balance(roll: float, pitch: float) -> tuple[float, ...]:
    """The 12 angles (rad) of a stand on ground that tilts the body by `roll` and `pitch` rad: hips against the one, shoulders the other."""
    hip, shoulder = (max(-FARTHEST_LEAN, min(FARTHEST_LEAN, -LEAN * tilt)) for tilt in (roll, pitch))
    return (hip, shoulder, 0.0) * 4


def tilt_of(reading: Imu) -> tuple[float, float]:
    """Roll and pitch, rad: from the orientation, or from gravity if the sensor says that it measures none (covariance -1)."""
    if reading.orientation_covariance[0] == -1.0:
        force = reading.linear_acceleration
        return atan2(force.y, force.z), atan2(-force.x, hypot(force.y, force.z))
    q: Quaternion = reading.orientation
    roll = atan2(2.0 * (q.w * q.x + q.y * q.z), 1.0 - 2.0 * (q.x * q.x + q.y * q.y))
    return roll, asin(max(-1.0, min(1.0, 2.0 * (q.w * q.y - q.z * q.x))))


class SpotController(Node):
    """Commands 12 joints: /joint_states at 100 Hz. Takes /cmd_vel and /imu/data; serves /spot/stand, /spot/sit and /spot/walk.

    It sits at first. Velocities count while it walks, for half a second each; leaving the walk forgets them. Standing without an IMU it
    takes the neutral pose, and says so.
    """

    joints = publishes(JOINT_STATES)

    async def on_start(self) -> None:
        self.mode = "sit"
        self.angles = SITTING
        self.velocity = Vector3()  # x and y in m/s, z in rad/s
        self._since = self.clock.now()
        self._commanded = self._felt = -inf
        self._tilt = (0.0, 0.0)
        self._blind = False
        self._steps = 0
        self.log.info("Spot Controller initialized")

    @every(hz=RATE)
    def control(self) -> None:
        target, most = self._target(), FASTEST / RATE
        self.angles = tuple(a + max(-most, min(most, b - a)) for a, b in zip(self.angles, target, strict=True))
        header = Header(stamp=self.clock.stamp(), frame_id="base_link")
        self.joints(JointState(header=header, name=JOINT_NAMES, position=self.angles))

    def _target(self) -> tuple[float, ...]:
        if self.mode == "sit":
            return SITTING
        if self.mode == "stand":
            self._look_for_imu()
            return NEUTRAL if self._blind or self._felt == -inf else balance(*self._tilt)
        if self.clock.now() - self._commanded > SILENCE:
            self.velocity = Vector3()
        self._steps += 1
        return trot(self._steps / RATE, self.velocity.x, self.velocity.y, self.velocity.z)

    def _look_for_imu(self) -> None:
        lost = self.clock.now() - max(self._felt, self._since) > SILENCE
        if lost and not self._blind:
            self.log.warning("No IMU data, standing in the neutral pose")
        self._blind = lost

    @IMU.on()
    def feel(self, reading: Imu) -> None:
        roll, pitch = tilt_of(reading)
        if isfinite(roll) and isfinite(pitch):
            self._tilt, self._felt = (roll, pitch), self.clock.now()

    @CMD_VEL.on()
    def command(self, message: Twist) -> None:
        if self.mode != "walk":
            self.log.warning("Not in walk mode, ignoring cmd_vel")
            return
        wanted = Vector3(x=message.linear.x, y=message.linear.y, z=message.angular.z)
        if not all(map(isfinite, (wanted.x, wanted.y, wanted.z))):
            self.log.warning("cmd_vel is not a number, ignoring it")
            return
        self.velocity, self._commanded = wanted, self.clock.now()

    @STAND.serve()
    async def stand(self, request: Trigger_Request) -> Trigger_Response:
        self.log.info("🟢 Standing up")
        return self._change("stand", "Robot is now standing")

    @SIT.serve()
    async def sit(self, request: Trigger_Request) -> Trigger_Response:
        self.log.info("🔵 Sitting down")
        return self._change("sit", "Robot is now sitting")

    @WALK.serve()
    async def walk(self, request: Trigger_Request) -> Trigger_Response:
        return self._change("walk", "Robot is now walking")

    def _change(self, mode: str, text: str) -> Trigger_Response:
        if mode != self.mode:
            self.mode, self.velocity, self._steps = mode, Vector3(), 0
            self._since = self.clock.now()
        return Trigger.Response(success=True, message=text)


def tree() -> Supervisor:
    """A quadruped's joints: call /spot/stand, /spot/walk and /spot/sit."""
    return system("spot_controller", SpotController)


if __name__ == "__main__":
    main(tree)

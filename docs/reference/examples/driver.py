"""A driver: an imaginary robot, its battery, and a test with the simulation behind the same wire."""

import socket
import struct
from collections import deque

import numpy as np

from actors import Child, Node, every
from actors.interfaces.geometry_msgs.msg import Twist, Vector3
from actors.interfaces.std_srvs.srv import Trigger
from actors.testing import Rig
from robot.contracts import STAND, TELEOP_CMD, WALK
from robot.hardware.battery import PackState, SupplyStatus
from robot.hardware.body import BodySilent, Hardware, ImuSample, JointSample, MotorTargets, Sample
from robot.hardware.devices import BatteryDevice, Equipment
from robot.model.battery import PackDesign
from robot.scenes.worlds import get_world
from robot.sim.physics import PhysicsBody
from robot.tree import tree_of

# -- the driver

STATE = struct.Struct("<44f")  # 12 angles, 12 speeds, 12 torques, gyro, accelerometer, volts, charge 0..1
FEET = struct.Struct("<4B")  # each foot's contact
COMMAND = struct.Struct("<60f")  # 12 each of angle, speed, torque, kp, kd
ORDER = np.array((3, 4, 5, 0, 1, 2, 9, 10, 11, 6, 7, 8))  # fr, fl, rr, rl into fl, fr, rl, rr, and back
SIGN = np.array((1, 1, 1, -1, 1, 1, 1, 1, 1, -1, 1, 1))
SILENT = 0.1  # seconds without a packet after which the robot counts as lost


class Padpaw(Hardware):
    """The legs of a Padpaw behind a connected datagram socket. Raises `BodySilent` when it does not answer within a second."""

    def __init__(self, link: socket.socket) -> None:
        self._link, self._time = link, 0.0
        self._waiting: deque[Sample] = deque(maxlen=40)
        link.settimeout(1.0)
        try:
            self._take(link.recv(1024))
        except TimeoutError:
            raise BodySilent("the Padpaw has sent nothing for a second: is it switched on?") from None
        link.setblocking(False)

    @property
    def time(self) -> float:
        return self._time

    def advance(self, until: float) -> None:
        self._time = until
        while True:
            try:
                self._take(self._link.recv(1024))
            except BlockingIOError:
                return

    def command(self, targets: MotorTargets) -> None:
        signed = ((SIGN * part)[ORDER] for part in (targets.position, targets.velocity, targets.effort))
        self._link.send(COMMAND.pack(*np.concatenate((*signed, targets.kp[ORDER], targets.kd[ORDER]))))

    def sample(self, hz: float) -> None:
        self._waiting.clear()  # it samples at its own 200 Hz

    def next_sample(self) -> Sample | None:
        return self._waiting.popleft() if self._waiting else None

    def imu(self) -> ImuSample:
        return self._heard().imu

    def joints(self) -> JointSample:
        return self._heard().joints

    def _heard(self) -> Sample:
        if self._time - self._newest.time > SILENT:
            raise BodySilent(f"the Padpaw has not been heard for {SILENT} s")
        return self._newest

    def _take(self, packet: bytes) -> None:
        if len(packet) != STATE.size + FEET.size:
            return
        values = np.array(STATE.unpack_from(packet))
        if not np.isfinite(values).all():
            return
        angles, speeds, torques = (SIGN * part[ORDER] for part in values[:36].reshape(3, 12))
        contact = np.array(FEET.unpack_from(packet, STATE.size), dtype=np.bool_)[[1, 0, 3, 2]]
        self.volts, self.charge = float(values[42]), float(values[43])
        imu, joints = ImuSample(values[36:39], values[39:42]), JointSample(angles, speeds, torques, contact)
        self._newest = Sample(self._time, imu, joints)
        self._waiting.append(self._newest)

class PadpawBattery(BatteryDevice):
    """The gauge of the same robot."""

    design = PackDesign(series_cells=7, energy_wh=180.0)

    def __init__(self, robot: Padpaw) -> None:
        self._robot = robot

    @property
    def state(self) -> PackState:
        charge, whole = self._robot.charge, self.design.design_capacity
        return PackState(
            voltage=self._robot.volts, current=0.0, charge=charge * whole, capacity=whole, temperature=25.0, soc=charge,
            status=SupplyStatus.DISCHARGING, supplied=True, cells=7,
        )  # fmt: skip

    def step(self, dt: float, power_w: float, charging: bool = False) -> PackState:
        return self.state

# -- the robot

def padpaw(link: socket.socket):
    """The whole robot: run it with `async with run(padpaw(link))`."""
    robot = Padpaw(link)
    return tree_of(Equipment(robot, PadpawBattery(robot)))

# -- test it before it moves

def state(body: PhysicsBody) -> bytes:
    """What a Padpaw would send."""
    joints, imu = body.joints(), body.imu()
    legs = ((SIGN * part)[ORDER] for part in (joints.position, joints.velocity, joints.effort))
    numbers = np.concatenate((*legs, imu.gyro, imu.accel, (25.9, 0.9)))
    return STATE.pack(*numbers) + FEET.pack(*joints.contact[[1, 0, 3, 2]].tolist())


class Bench(Node):
    """A simulated body that answers on the Padpaw's wire."""

    def __init__(self, link: socket.socket, body: PhysicsBody) -> None:
        self._link, self._body = link, body
        link.setblocking(False)

    @every(hz=200)
    def step(self) -> None:
        self._body.advance(self.clock.now())
        try:
            while True:
                parts = np.array(COMMAND.unpack(self._link.recv(1024))).reshape(5, 12)[:, ORDER]
                self._body.command(MotorTargets(*(SIGN * parts[:3]), parts[3], parts[4]))
        except BlockingIOError:
            self._link.send(state(self._body))


async def test_a_padpaw_stands_up_and_walks(rig: Rig) -> None:
    ours, theirs = socket.socketpair(socket.AF_UNIX, socket.SOCK_DGRAM)
    with ours, theirs:
        body = PhysicsBody(get_world("empty"), seed=1)
        theirs.send(state(body))
        await rig.start(Child(Bench, args=(theirs, body)), padpaw(ours))
        await rig.call(STAND, Trigger.Request())
        await rig.advance(4.0)
        assert body.truth().position[2] > 0.4
        await rig.call(WALK, Trigger.Request())
        for _ in range(40):
            rig.publish(TELEOP_CMD, Twist(linear=Vector3(x=0.4)))
            await rig.advance(0.1)
        assert body.truth().position[0] > 1.0
        assert not body.truth().fallen
        await rig.stop()

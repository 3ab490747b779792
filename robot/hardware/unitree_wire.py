"""What a Unitree Go2 takes and tells, in our order and units: `LowCmd` with its check sum, `LowState` as a `Sample`.

Its motors and feet are counted fr, fl, rr, rl; zeros and signs of its joints are ours, as is the law of its drives (`MotorTargets`).
"""

from __future__ import annotations

import struct
import zlib
from typing import Final

import numpy as np
from numpy.typing import NDArray

from robot.geometry.vectors import Vector
from robot.hardware.body import ImuSample, JointSample, MotorTargets, Sample
from robot.interfaces.unitree.unitree_go.msg import LowCmd, LowState, MotorCmd
from robot.model.bodies import GO2
from robot.model.legs import LEVEL, leg_state
from robot.model.robot import RobotModel

JOINTS: Final = np.array((3, 4, 5, 0, 1, 2, 9, 10, 11, 6, 7, 8))
"""Where each of our joints is among its motors; the other way round it is the same."""
FEET: Final = np.array((1, 0, 3, 2))
DAMPER: Final = 3.0
"""Of the drives when nothing else is wanted, N m s/rad: the robot sinks slowly."""
CONTACT_FORCE: Final = 25.0
"""What a foot's sensor must read above its zero for it to stand, in the sensor's own units; below half of it, it does not."""
CONTACT_LOAD: Final = 34.0
"""The same in newton, of a robot whose feet have no sensors; measured: a swinging leg's inertia looks like 33 N, a robot that stands has 37 N a foot."""
SINGULAR: Final = 1e-5
"""m2."""
DRIFT: Final = 0.5
"""How fast the zero of a foot in the air may rise, in these units a second."""
_ON: Final = 1
_NO_POSITION, _NO_SPEED = 2.146e9, 16000.0
"""Numbers that a drive takes for none."""
_SPARE: Final = MotorCmd(mode=_ON, q=_NO_POSITION, dq=_NO_SPEED)
_EMPTY: Final = LowCmd(head=(0xFE, 0xEF), level_flag=0xFF, motor_cmd=(_SPARE,) * 20)
_RECORD: Final = struct.Struct("<4B4IH2x" + "B3x5f3I" * 20 + "59Bx2I")
"""The command as a structure of C, on which the check sum is defined."""
_MIRRORED: Final = bytes(int(f"{byte:08b}"[::-1], 2) for byte in range(256))


def crc_of(command: LowCmd) -> int:
    """The check sum of everything before it: CRC-32 with polynomial 04C11DB7 and start FFFFFFFF, each word's highest bit first, no inversion."""
    values: list[float] = [*command.head, command.level_flag, command.frame_reserve, *command.sn, *command.version]
    values.append(command.bandwidth)
    for motor in command.motor_cmd:
        values += (motor.mode, motor.q, motor.dq, motor.tau, motor.kp, motor.kd, *motor.reserve)
    values += (command.bms_cmd.off, *command.bms_cmd.reserve, *command.wireless_remote, *command.led, *command.fan)
    record = _RECORD.pack(*values, command.gpio, command.reserve, 0)
    words = np.frombuffer(record[:-4], "<u4").astype(">u4").tobytes()
    mirrored = zlib.crc32(words.translate(_MIRRORED)) ^ 0xFFFFFFFF  # zlib's takes the lowest bit first
    return int.from_bytes(mirrored.to_bytes(4, "little").translate(_MIRRORED), "big")


def command_of(targets: MotorTargets, model: RobotModel) -> LowCmd:
    """The command for these targets, positions and torques cut off at what the joints can take."""
    low, high = np.array(model.joint_limits).T
    position = np.clip(targets.position, low, high)
    strongest = np.tile((model.torque_limit, model.torque_limit, max(torque for _, torque in model.knee_torque)), 4)
    effort = np.clip(targets.effort, -strongest, strongest)
    parts = np.stack((position, targets.velocity, effort, targets.kp, targets.kd))[:, JOINTS]
    return _sealed([MotorCmd(mode=_ON, q=q, dq=dq, tau=tau, kp=kp, kd=kd) for q, dq, tau, kp, kd in parts.T.tolist()])


def damping() -> LowCmd:
    """The command with which all joints only brake."""
    return _sealed([MotorCmd(mode=_ON, q=_NO_POSITION, dq=0.0, kd=DAMPER)] * 12)


def _sealed(motors: list[MotorCmd]) -> LowCmd:
    command = _EMPTY.replace(motor_cmd=(*motors, *_EMPTY.motor_cmd[12:]))
    return command.replace(crc=crc_of(command))


def sample_of(state: LowState, time: float, feet: FootContacts) -> Sample | None:
    """What it measured; `None` if there are numbers in it that are none."""
    motors = np.array([(one.q, one.dq, one.tau_est) for one in state.motor_state[:12]])[JOINTS].T
    gyro, accel = (
        np.array(one, dtype=np.float64) for one in (state.imu_state.gyroscope, state.imu_state.accelerometer)
    )
    if not (np.isfinite(motors).all() and np.isfinite(gyro).all() and np.isfinite(accel).all()):
        return None
    force = np.array(state.foot_force, dtype=np.float64)[FEET] if feet.sensed else _loads(motors[0], motors[2])
    contact = feet.contact(force, time)
    return Sample(time, ImuSample(gyro, accel), JointSample(motors[0], motors[1], motors[2], contact))


def _loads(angles: Vector, torques: Vector) -> Vector:
    """How much each foot carries by its motors' torques, N, as if legs had no inertia; shape (4,)."""
    legs = leg_state(angles.tolist(), LEVEL, GO2)
    turning = np.array(legs.jacobians)
    pushing = turning @ (np.array(legs.weight) - torques).reshape(4, 3, 1)
    square = turning @ turning.transpose(0, 2, 1) + SINGULAR * np.eye(3)  # of a stretched leg nothing is known along it
    forces: Vector = np.asarray(np.linalg.solve(square, pushing)[:, 2, 0], dtype=np.float64)
    return forces


class FootContacts:
    """Contacts by the force sensors of the feet, whose zeros differ and drift: each is the lowest that was read of late.

    Of a robot whose sensors read nothing, as a simulator's, by the torques of its motors: those are in newton, with no zero to find.
    """

    def __init__(self, *, sensed: bool = True) -> None:
        self.sensed = sensed
        self._enough, self._stays = (CONTACT_FORCE, 0.5) if sensed else (CONTACT_LOAD, 0.9)
        self._zero: Vector | None = None if sensed else np.zeros(4)
        self._standing = np.zeros(4, dtype=np.bool_)
        self._time = 0.0

    def contact(self, force: Vector, time: float) -> NDArray[np.bool_]:
        """Which feet stand; `force` is what the sensors read, or the loads in newton, shape (4,)."""
        if self._zero is None:
            self._zero, self._time = force, time
        if self.sensed:
            rise = np.where(self._standing, 0.0, DRIFT * max(0.0, time - self._time))
            self._zero, self._time = np.minimum(self._zero + rise, force), time
        self._standing = force - self._zero > np.where(self._standing, self._stays, 1.0) * self._enough
        return self._standing

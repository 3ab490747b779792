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
from robot.model.robot import RobotModel

JOINTS: Final = np.array((3, 4, 5, 0, 1, 2, 9, 10, 11, 6, 7, 8))
"""Where each of our joints is among its motors; the other way round it is the same."""
FEET: Final = np.array((1, 0, 3, 2))
DAMPER: Final = 3.0
"""Of the drives when nothing else is wanted, N m s/rad: the robot sinks slowly."""
CONTACT_FORCE: Final = 25.0
"""What a foot's sensor must read above its zero for it to stand, in the sensor's own units; below half of it, it does not."""
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
    contact = feet.contact(np.array(state.foot_force, dtype=np.float64)[FEET], time)
    return Sample(time, ImuSample(gyro, accel), JointSample(motors[0], motors[1], motors[2], contact))


class FootContacts:
    """Contacts by the force sensors of the feet, whose zeros differ and drift: each is the lowest that was read of late."""

    def __init__(self) -> None:
        self._zero: Vector | None = None
        self._standing = np.zeros(4, dtype=np.bool_)
        self._time = 0.0

    def contact(self, force: Vector, time: float) -> NDArray[np.bool_]:
        """Which feet stand; `force` is what the sensors read, shape (4,)."""
        if self._zero is None:
            self._zero, self._time = force, time
        rise = np.where(self._standing, 0.0, DRIFT * max(0.0, time - self._time))
        self._zero, self._time = np.minimum(self._zero + rise, force), time
        self._standing = force - self._zero > np.where(self._standing, 0.5, 1.0) * CONTACT_FORCE
        return self._standing

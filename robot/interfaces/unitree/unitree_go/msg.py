"""unitree_go/msg. Generated from its definitions in share; do not edit."""

from typing import Annotated

from actors.interfaces.message import Message
from actors.interfaces.types import (
    Exactly,
    Many,
    default,
    float32,
    float32_array,
    int8,
    int8_array,
    int16_array,
    int32,
    uint8,
    uint8_array,
    uint16,
    uint16_array,
    uint32,
    uint32_array,
)

__all__ = [
    "BmsCmd",
    "BmsState",
    "IMUState",
    "LowCmd",
    "LowState",
    "MotorCmd",
    "MotorState",
]


class BmsCmd(Message, frozen=True, kw_only=True):
    """unitree_go/msg/BmsCmd"""

    off: uint8 = 0
    reserve: Annotated[uint8_array, Exactly(3)] = default()


class BmsState(Message, frozen=True, kw_only=True):
    """unitree_go/msg/BmsState"""

    version_high: uint8 = 0
    version_low: uint8 = 0
    status: uint8 = 0
    soc: uint8 = 0
    current: int32 = 0
    cycle: uint16 = 0
    bq_ntc: Annotated[int8_array, Exactly(2)] = default()
    mcu_ntc: Annotated[int8_array, Exactly(2)] = default()
    cell_vol: Annotated[uint16_array, Exactly(15)] = default()


class IMUState(Message, frozen=True, kw_only=True):
    """unitree_go/msg/IMUState"""

    quaternion: Annotated[float32_array, Exactly(4)] = default()
    gyroscope: Annotated[float32_array, Exactly(3)] = default()
    accelerometer: Annotated[float32_array, Exactly(3)] = default()
    rpy: Annotated[float32_array, Exactly(3)] = default()
    temperature: int8 = 0


class MotorCmd(Message, frozen=True, kw_only=True):
    """unitree_go/msg/MotorCmd"""

    mode: uint8 = 0
    q: float32 = 0.0
    dq: float32 = 0.0
    tau: float32 = 0.0
    kp: float32 = 0.0
    kd: float32 = 0.0
    reserve: Annotated[uint32_array, Exactly(3)] = default()


class LowCmd(Message, frozen=True, kw_only=True):
    """unitree_go/msg/LowCmd"""

    head: Annotated[uint8_array, Exactly(2)] = default()
    level_flag: uint8 = 0
    frame_reserve: uint8 = 0
    sn: Annotated[uint32_array, Exactly(2)] = default()
    version: Annotated[uint32_array, Exactly(2)] = default()
    bandwidth: uint16 = 0
    motor_cmd: Annotated[Many[MotorCmd], Exactly(20)] = default()
    bms_cmd: BmsCmd = default()
    wireless_remote: Annotated[uint8_array, Exactly(40)] = default()
    led: Annotated[uint8_array, Exactly(12)] = default()
    fan: Annotated[uint8_array, Exactly(2)] = default()
    gpio: uint8 = 0
    reserve: uint32 = 0
    crc: uint32 = 0


class MotorState(Message, frozen=True, kw_only=True):
    """unitree_go/msg/MotorState"""

    mode: uint8 = 0
    q: float32 = 0.0
    dq: float32 = 0.0
    ddq: float32 = 0.0
    tau_est: float32 = 0.0
    q_raw: float32 = 0.0
    dq_raw: float32 = 0.0
    ddq_raw: float32 = 0.0
    temperature: int8 = 0
    lost: uint32 = 0
    reserve: Annotated[uint32_array, Exactly(2)] = default()


class LowState(Message, frozen=True, kw_only=True):
    """unitree_go/msg/LowState"""

    head: Annotated[uint8_array, Exactly(2)] = default()
    level_flag: uint8 = 0
    frame_reserve: uint8 = 0
    sn: Annotated[uint32_array, Exactly(2)] = default()
    version: Annotated[uint32_array, Exactly(2)] = default()
    bandwidth: uint16 = 0
    imu_state: IMUState = default()
    motor_state: Annotated[Many[MotorState], Exactly(20)] = default()
    bms_state: BmsState = default()
    foot_force: Annotated[int16_array, Exactly(4)] = default()
    foot_force_est: Annotated[int16_array, Exactly(4)] = default()
    tick: uint32 = 0
    wireless_remote: Annotated[uint8_array, Exactly(40)] = default()
    bit_flag: uint8 = 0
    adc_reel: float32 = 0.0
    temperature_ntc1: int8 = 0
    temperature_ntc2: int8 = 0
    power_v: float32 = 0.0
    power_a: float32 = 0.0
    fan_frequency: Annotated[uint16_array, Exactly(4)] = default()
    reserve: uint32 = 0
    crc: uint32 = 0

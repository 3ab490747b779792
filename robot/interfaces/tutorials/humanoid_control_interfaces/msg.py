"""humanoid_control_interfaces/msg. Generated from its definitions in share; do not edit."""

from actors.interfaces.message import Message
from actors.interfaces.std_msgs.msg import Header
from actors.interfaces.types import default, float64

__all__ = [
    "MotorCommand",
    "SensorData",
]


class MotorCommand(Message, frozen=True, kw_only=True):
    """humanoid_control_interfaces/msg/MotorCommand

    Velocities of the two motors.
    """

    header: Header = default()
    left_motor_velocity: float64 = 0.0
    right_motor_velocity: float64 = 0.0


class SensorData(Message, frozen=True, kw_only=True):
    """humanoid_control_interfaces/msg/SensorData

    Not the same type as my_robot_interfaces/msg/SensorData.
    """

    header: Header = default()
    position_x: float64 = 0.0
    position_y: float64 = 0.0
    velocity_x: float64 = 0.0
    velocity_y: float64 = 0.0

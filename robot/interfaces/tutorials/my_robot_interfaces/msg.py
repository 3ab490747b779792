"""my_robot_interfaces/msg. Generated from its definitions in share; do not edit."""

from actors.interfaces.message import Message
from actors.interfaces.std_msgs.msg import Header
from actors.interfaces.types import default, float32, string

__all__ = [
    "SensorData",
]


class SensorData(Message, frozen=True, kw_only=True):
    """my_robot_interfaces/msg/SensorData

    Not the same type as humanoid_control_interfaces/msg/SensorData.
    """

    header: Header = default()
    temperature: float32 = 0.0
    humidity: float32 = 0.0
    battery_voltage: float32 = 0.0
    emergency_stop: bool = False
    status_message: string = ""

"""The nodes that come with the framework, such as `RobotStatePublisher` and `StaticTransformPublisher`."""

from __future__ import annotations

from actors.nodes.buffer_server import BufferServer
from actors.nodes.clock_publisher import ClockPublisher
from actors.nodes.parameter_server import SERVER, ParameterServer, get_global, set_global
from actors.nodes.robot_state_publisher import JOINT_STATES, ROBOT_DESCRIPTION, RobotStatePublisher
from actors.nodes.static_transform_publisher import StaticTransformPublisher
from actors.runtime.sim_time import CLOCK

__all__ = [
    "CLOCK",
    "JOINT_STATES",
    "ROBOT_DESCRIPTION",
    "SERVER",
    "BufferServer",
    "ClockPublisher",
    "ParameterServer",
    "RobotStatePublisher",
    "StaticTransformPublisher",
    "get_global",
    "set_global",
]

"""The nodes that come with the framework: `ClockPublisher` and `ParameterServer`."""

from __future__ import annotations

from actors.nodes.clock_publisher import (
    ClockPublisher,
)
from actors.nodes.parameter_server import (
    SERVER,
    ParameterServer,
    get_global,
    set_global,
)
from actors.runtime.sim_time import CLOCK

__all__ = [
    "CLOCK",
    "SERVER",
    "ClockPublisher",
    "ParameterServer",
    "get_global",
    "set_global",
]

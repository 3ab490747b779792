"""`ClockPublisher`: publishes the system's time on `/clock`, for nodes with `use_sim_time`."""

from __future__ import annotations

import math

from actors.interfaces.rosgraph_msgs.msg import Clock
from actors.runtime.declarations import background, publishes
from actors.runtime.incarnation import incarnation_of
from actors.runtime.node import Node
from actors.runtime.sim_time import CLOCK


class ClockPublisher(Node):
    """Publishes the system's time of day on `/clock`: `wall()`, the time of stamps; on the virtual clock, the time of the run.

    It publishes `hz` times a second from its start on, by default 40 times, as `ros2 bag play --clock` does. If the event loop is late,
    missed messages are skipped. It never follows the time that it publishes, even if `use_sim_time` is true.
    """

    node_name = "clock_publisher"
    time = publishes(CLOCK)

    def __init__(self, hz: float = 40.0) -> None:
        if not 0.0 < hz <= 1e6:
            raise ValueError(f"ClockPublisher(hz={hz}): the rate must be above 0 and at most 1e6 per second")
        self.hz = hz

    @background
    async def run(self) -> None:
        clock = incarnation_of(self).runtime.clock
        start, k = clock.now(), 0
        while True:
            self.time(Clock(clock=clock.stamp()))
            k = max(k, math.floor((clock.now() - start) * self.hz)) + 1
            await clock.sleep_until(start + k / self.hz)

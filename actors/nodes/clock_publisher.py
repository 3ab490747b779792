"""`ClockPublisher`: publishes `/clock`, so that nodes with `use_sim_time`, here or elsewhere, live on this system's time."""

from __future__ import annotations

import math

from actors.interfaces.rosgraph_msgs.msg import Clock
from actors.node.declarations import background, publishes
from actors.node.node import Node
from actors.runtime.incarnation import incarnation_of
from actors.runtime.sim_time import CLOCK

__all__ = ["ClockPublisher"]


class ClockPublisher(Node):
    """Publishes the system's time of day (`wall()`, what stamps show; on the virtual clock the run's time) on `/clock`.

    `hz` times a second, from its start on; 40 as `ros2 bag play --clock` does. If the loop is late it skips what it has missed. It never
    lives on the time that it publishes, whatever `use_sim_time` says.
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

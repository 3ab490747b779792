"""A simulator of temperatures and a processor that raises alerts; and, as an exercise, a service that tells the average of the last few."""

from __future__ import annotations

from collections import deque
from itertools import islice

from actors import ExitReason, Node, Service, Supervisor, Topic, every, publishes
from actors.interfaces.std_msgs.msg import Float32, String
from robot.interfaces.tutorials.proposed_interfaces.srv import (
    GetAverageTemperature,
    GetAverageTemperature_Request,
    GetAverageTemperature_Response,
)
from robot.tutorials.program import main, system, was_interrupted

TEMPERATURE = Topic(Float32, "temperature", 10)
ROBOT_STATUS = Topic(String, "robot_status", 10)
ALERT = Topic(String, "temperature_alert", 10)
AVERAGE = Service(GetAverageTemperature, "get_average_temperature")

STATUSES = ("idle", "moving", "waiting", "processing")
HOT = 28.0
"""Degrees Celsius; more than that is an alert."""
KEPT = 1000
"""Temperatures that the processor remembers."""


class SensorSimulator(Node):
    """Makes up temperature (20 to 30 degrees) and robot_status, both at 2 Hz."""

    temperature = publishes(TEMPERATURE)
    status = publishes(ROBOT_STATUS)

    async def on_start(self) -> None:
        self.log.info("Sensor simulator started")

    @every(period=0.5)
    def publish(self) -> None:
        temperature, status = 20.0 + 10.0 * self.rng.random(), self.rng.choice(STATUSES)
        self.temperature(Float32(data=temperature))
        self.status(String(data=status))
        self.log.info(f"Temperature: {temperature:.2f}°C, Status: {status}")

    async def on_stop(self, reason: ExitReason) -> None:
        if was_interrupted(reason):
            self.log.info("Shutting down sensor simulator")


class DataProcessor(Node):
    """Takes temperature and robot_status, publishes temperature_alert above 28 degrees; serves get_average_temperature."""

    alert = publishes(ALERT)

    async def on_start(self) -> None:
        self.seen = deque[float](maxlen=KEPT)
        self.log.info("Data processor initialized")

    @TEMPERATURE.on()
    def judge(self, message: Float32) -> None:
        self.seen.append(message.data)
        if message.data > HOT:
            text = f"WARNING: High temperature detected: {message.data:.2f}°C"
            self.alert(String(data=text))
            self.log.warning(text)
        else:
            self.log.info(f"Normal temperature: {message.data:.2f}°C")

    @ROBOT_STATUS.on()
    def status(self, message: String) -> None:
        self.log.info(f"Robot status: {message.data}")

    async def on_stop(self, reason: ExitReason) -> None:
        if was_interrupted(reason):
            self.log.info("Shutting down data processor")

    @AVERAGE.serve()
    async def average(self, request: GetAverageTemperature_Request) -> GetAverageTemperature_Response:
        """Of the last `count` temperatures, or of all there are."""
        if request.count <= 0:
            return _refused(f"count must be 1 or more, not {request.count}")
        if not self.seen:
            return _refused("no temperature has been received yet")
        last = list(islice(reversed(self.seen), request.count))
        return GetAverageTemperature.Response(
            success=True,
            average=sum(last) / len(last),
            samples=len(last),
            message=f"Average of the last {len(last)} temperatures, {request.count} were asked for",
        )


def _refused(why: str) -> GetAverageTemperature_Response:
    return GetAverageTemperature.Response(success=False, message=why)


def tree() -> Supervisor:
    """A simulator of temperatures, and a processor that raises alerts."""
    return system("communication_demo", SensorSimulator, DataProcessor)


if __name__ == "__main__":
    main(tree)

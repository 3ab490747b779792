"""Sensor telemetry: one message type of our own with six fields, published twice a second.

A topic is the right form here: a stream for any number of readers, none of whom has to answer.
"""

from __future__ import annotations

from actors import Node, Supervisor, Topic, every, publishes
from actors.interfaces.std_msgs.msg import Header
from robot.interfaces.tutorials.my_robot_interfaces.msg import SensorData
from robot.tutorials.program import main, system

SENSOR_DATA = Topic(SensorData, "/sensor_data", 10)


class SensorDataPublisher(Node):
    """Makes up readings: /sensor_data at 2 Hz, with 25 +- 3 degrees, 60 +- 10 percent, 12.1 to 12.6 V."""

    data = publishes(SENSOR_DATA)

    async def on_start(self) -> None:
        self.log.info("Sensor data publisher started (2 Hz)")

    @every(period=0.5)
    def publish(self) -> None:
        random = self.rng.uniform  # the node's own numbers: the same run for the same seed
        self.data(
            SensorData(
                header=Header(stamp=self.clock.stamp(), frame_id="base_link"),
                temperature=random(22.0, 28.0),
                humidity=random(50.0, 70.0),
                battery_voltage=random(12.1, 12.6),
                emergency_stop=False,
                status_message="nominal",
            )
        )


def tree() -> Supervisor:
    """A sensor that publishes telemetry twice a second."""
    return system("sensor_data", SensorDataPublisher)


if __name__ == "__main__":
    main(tree)

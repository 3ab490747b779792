"""Text on topics: a sensor that publishes readings in words, and a motor that hears its commands."""

from __future__ import annotations

from actors import Node, Supervisor, Topic, every, publishes
from actors.interfaces.std_msgs.msg import String
from robot.tutorials.program import main, system

SENSOR_DATA = Topic(String, "sensor_data", 10)
MOTOR_COMMANDS = Topic(String, "motor_commands", 10)


class SensorPublisher(Node):
    """Publishes "Sensor reading n" on sensor_data at 2 Hz, n from 0."""

    data = publishes(SENSOR_DATA)

    async def on_start(self) -> None:
        self.count = 0

    @every(period=0.5)
    def publish(self) -> None:
        text = f"Sensor reading {self.count}"
        self.data(String(data=text))
        self.log.info(f'Publishing: "{text}"')
        self.count += 1


class MotorSubscriber(Node):
    """Says what it hears on motor_commands."""

    @MOTOR_COMMANDS.on()
    def listen(self, message: String) -> None:
        self.log.info(f'Received: "{message.data}"')


def tree() -> Supervisor:
    """A sensor that publishes text, and a motor that listens for commands."""
    return system("text_topics", SensorPublisher, MotorSubscriber)


if __name__ == "__main__":
    main(tree)

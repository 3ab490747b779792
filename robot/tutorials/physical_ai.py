"""A first node with a topic each way, a service and a timer; and its twin, whose idea of `sensor_input` is another.

The two run side by side, but the twin's `sensor_input` is a String where the node's is a Float32. A node that publishes numbers there is told that
the twin cannot hear them, and so is the twin; it never gets one.
"""

from __future__ import annotations

from actors import ExitReason, Node, Service, Supervisor, Topic, every, publishes
from actors.interfaces.std_msgs.msg import Float32, String
from actors.interfaces.std_srvs.srv import SetBool, SetBool_Request, SetBool_Response
from robot.tutorials.program import main, system, was_interrupted

ROBOT_STATUS = Topic(String, "robot_status", 10)
SENSOR_INPUT = Topic(Float32, "sensor_input", 10)
SENSOR_TEXT = Topic(String, "sensor_input", 10)
"""What the twin takes under the same name."""
CONTROL_COMMAND = Service(SetBool, "control_command")


class PhysicalAi(Node):
    """Processes numbers: takes sensor_input, publishes robot_status (and a heartbeat there, 2 Hz); serves control_command."""

    node_name = "physical_ai_node"
    status = publishes(ROBOT_STATUS)

    async def on_start(self) -> None:
        self.log.info("Physical AI Node initialized")

    @SENSOR_INPUT.on()
    def process(self, message: Float32) -> None:
        self.log.info(f"Received sensor data: {message.data}")
        self.status(String(data=f"Processed: {message.data}"))

    @every(period=0.5)
    def beat(self) -> None:
        self.status(String(data=f"Heartbeat: {self.clock.now():.1f}"))

    @CONTROL_COMMAND.serve()
    async def control(self, request: SetBool_Request) -> SetBool_Response:
        self.log.info("Activation command received" if request.data else "Deactivation command received")
        return SetBool.Response(success=True, message="Robot activated" if request.data else "Robot deactivated")

    async def on_stop(self, reason: ExitReason) -> None:
        if was_interrupted(reason):
            self.log.info("Interrupted, shutting down")


class PhysicalAiTwin(Node):
    """Says hello: publishes robot_status at 2 Hz, and takes sensor_input as text."""

    node_name = "physical_ai_cpp_node"
    status = publishes(ROBOT_STATUS)

    @every(period=0.5)
    def greet(self) -> None:
        self.status(String(data="Hello from C++ Node"))

    @SENSOR_TEXT.on()
    def listen(self, message: String) -> None:
        self.log.info(f"Received: '{message.data}'")


class SensorFeed(Node):
    """Something to process: publishes 3.5 on sensor_input once a second."""

    reading = publishes(SENSOR_INPUT)

    @every(hz=1)
    def publish(self) -> None:
        self.reading(Float32(data=3.5))


def tree() -> Supervisor:
    """A first node and its twin, which do not agree about one topic, and a publisher there."""
    return system("physical_ai", PhysicalAi, PhysicalAiTwin, SensorFeed)


if __name__ == "__main__":
    main(tree)

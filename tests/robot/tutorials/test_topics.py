"""The tutorials' small systems of topics (Y-05, Y-06, Y-09, Y-14 to Y-17, Y-30, Y-36)."""

from __future__ import annotations

import signal

import pytest

from actors import Child, Node
from actors.interfaces.sensor_msgs.msg import Image, JointState
from actors.interfaces.std_msgs.msg import Float32, String
from actors.interfaces.std_srvs.srv import SetBool
from actors.running.signals import interrupt
from actors.testing import Rig
from robot.interfaces.tutorials.proposed_interfaces.srv import GetAverageTemperature, GetAverageTemperature_Response
from robot.tutorials import (
    camera_detector,
    camera_topics,
    communication_demo,
    minimal_node,
    sensor_fusion,
    sensor_pair,
    talker_listener,
    text_topics,
)
from robot.tutorials.calibration import CalibrationService
from robot.tutorials.camera_detector import Box, draw, red_box
from robot.tutorials.camera_topics import CAMERA_RGB, CameraPublisher, ImageProcessor
from robot.tutorials.communication_demo import ALERT, AVERAGE, STATUSES, TEMPERATURE, DataProcessor, SensorSimulator
from robot.tutorials.physical_ai import (
    CONTROL_COMMAND,
    ROBOT_STATUS,
    SENSOR_INPUT,
    SENSOR_TEXT,
    PhysicalAi,
    PhysicalAiTwin,
)
from robot.tutorials.sensor_fusion import FUSED, SensorFusion
from robot.tutorials.sensor_pair import PRESSURE, SensorPublisher, SensorSubscriber
from tests.robot.stage import said, twist, warnings

# -- physical AI ------------------------------------------------------------------------------------------------------------


async def test_numbers_are_processed_and_the_heart_beats(rig: Rig) -> None:
    await rig.start(PhysicalAi)
    status = rig.probe(ROBOT_STATUS)
    rig.publish(SENSOR_INPUT, Float32(data=3.5))
    await rig.advance(10.0)
    texts = [message.data for message in status]
    assert texts[0] == "Processed: 3.5"
    assert "Received sensor data: 3.5" in said(rig, "physical_ai_node")
    assert texts[1:] == [f"Heartbeat: {tick / 2:.1f}" for tick in range(1, 21)]  # O-06, V-70: seconds, as a number


async def test_commands_are_answered(rig: Rig) -> None:
    await rig.start(PhysicalAi)
    answers = [await rig.call(CONTROL_COMMAND, SetBool.Request(data=on)) for on in (True, False)]
    assert [(answer.success, answer.message) for answer in answers] == [
        (True, "Robot activated"),
        (True, "Robot deactivated"),
    ]
    assert said(rig, "physical_ai_node") == [
        "Physical AI Node initialized",
        "Activation command received",
        "Deactivation command received",
    ]


async def test_ctrl_c_is_said_and_ends_it(rig: Rig) -> None:
    system = await rig.start(PhysicalAi)
    interrupt(system, signal.SIGINT)
    await rig.quiet()
    assert not system.running
    assert said(rig, "physical_ai_node") == ["Physical AI Node initialized", "Interrupted, shutting down"]


@pytest.mark.parametrize(
    ("node", "name", "said_last"),
    [
        (SensorPublisher, "sensor_publisher", "Shutting down sensor publisher"),
        (SensorSubscriber, "sensor_subscriber", "Shutting down sensor subscriber"),
        (CalibrationService, "calibration_service", "Shutting down calibration service"),
        (SensorSimulator, "sensor_simulator", "Shutting down sensor simulator"),
        (DataProcessor, "data_processor", "Shutting down data processor"),
    ],
)
async def test_ctrl_c_is_said_by_each_program_as_its_document_does(
    node: type[Node], name: str, said_last: str, rig: Rig
) -> None:
    system = await rig.start(node)
    interrupt(system, signal.SIGINT)
    await rig.quiet()
    assert said(rig, name)[-1] == said_last


async def test_the_twin_runs_beside_it_and_the_clash_of_types_is_reported(rig: Rig) -> None:
    await rig.start(PhysicalAi, PhysicalAiTwin)
    status = rig.probe(ROBOT_STATUS)
    feed = rig.me.publisher(SENSOR_INPUT)
    feed(Float32(data=3.5))
    await rig.advance(1.0)
    texts = {message.data for message in status}
    assert {"Processed: 3.5", "Hello from C++ Node"} <= texts
    (line,) = warnings(rig, "physical_ai_cpp_node")
    assert line == "Incompatible types on topic '/sensor_input'"
    record = next(record for record in rig.logs if record.event == line)
    assert record.fields["why"] == (
        "it is published as std_msgs/msg/Float32 and subscribed as std_msgs/msg/String: one topic has one type"
    )
    assert feed.status.incompatible_type == 1
    twin = rig.node(PhysicalAiTwin).subscription(SENSOR_TEXT)
    assert (twin.received, twin.status.incompatible_type) == (0, 1)  # it never got the number


async def test_the_twin_hears_text(rig: Rig) -> None:
    await rig.start(PhysicalAiTwin)
    rig.me.publisher(PhysicalAiTwin.declarations.topics[0].topic)(String(data="hello"))
    await rig.quiet()
    assert said(rig, "physical_ai_cpp_node") == ["Received: 'hello'"]


# -- sensor publisher and subscriber ----------------------------------------------------------------------------------------


async def test_ten_times_a_second_joints_a_velocity_and_an_image(rig: Rig) -> None:
    await rig.start(sensor_pair.SensorPublisher)
    joints, velocities, images = (
        rig.probe(sensor_pair.JOINT_STATES),
        rig.probe(sensor_pair.CMD_VEL),
        rig.probe(sensor_pair.IMAGE),
    )
    await rig.advance(5.0)
    assert (len(joints), len(velocities), len(images)) == (50, 50, 50)
    last = joints[-1]
    assert dict(zip(last.name, last.position.tolist(), strict=True)) == {"joint1": 0.1, "joint2": 0.2, "joint3": 0.3}
    assert (last.header.stamp.sec, last.header.stamp.nanosec) == (5, 0)
    assert velocities.last == twist(0.5, wz=0.2)
    assert said(rig, "sensor_publisher") == [f"Published sensor data #{n}" for n in range(1, 51)]


async def test_what_is_unusual_is_warned_of(rig: Rig) -> None:
    await rig.start(SensorSubscriber)
    rig.publish(sensor_pair.JOINT_STATES, JointState(name=("a", "b", "c"), position=[0.1, -3.2, 3.14]))
    rig.publish(sensor_pair.CMD_VEL, twist(0.5, wz=0.2))
    for pressure in (9.99, 10.0):
        rig.publish(PRESSURE, Float32(data=pressure))
    await rig.quiet()
    assert warnings(rig, "sensor_subscriber") == ["Unusual joint position: -3.2", "Low pressure detected: 9.99"]
    infos = set(said(rig, "sensor_subscriber"))
    assert {"Joint positions: [0.1, -3.2, 3.14]", "Received velocity command: linear.x=0.50, angular.z=0.20"} <= infos


async def test_the_pair_runs_without_a_warning(rig: Rig) -> None:
    await rig.start(sensor_pair.tree())
    await rig.advance(5.0)
    assert warnings(rig, "sensor_subscriber") == []
    assert "Joint positions: [0.1, 0.2, 0.3]" in said(rig, "sensor_subscriber")


# -- the communication demo -------------------------------------------------------------------------------------------------


async def test_a_minute_of_temperatures_and_an_alert_for_each_hot_one(rig: Rig) -> None:
    await rig.start(communication_demo.tree(), seed=1)
    temperatures, statuses = rig.probe(TEMPERATURE), rig.probe(communication_demo.ROBOT_STATUS)
    alerts = rig.probe(ALERT)
    await rig.advance(60.0)
    assert len(temperatures) == len(statuses) == 120
    assert all(20.0 <= message.data < 30.0 for message in temperatures)
    assert {message.data for message in statuses} == set(STATUSES)
    hot = [message.data for message in temperatures if message.data > 28.0]
    assert [alert.data for alert in alerts] == [f"WARNING: High temperature detected: {t:.2f}°C" for t in hot]
    assert 12 <= len(hot) <= 36


async def test_the_threshold_is_strict(rig: Rig) -> None:
    await rig.start(DataProcessor)
    alerts = rig.probe(ALERT)
    for temperature in (28.0, 28.01):
        rig.publish(TEMPERATURE, Float32(data=temperature))
    rig.publish(communication_demo.ROBOT_STATUS, String(data="idle"))
    await rig.quiet()
    assert [alert.data for alert in alerts] == ["WARNING: High temperature detected: 28.01°C"]
    assert warnings(rig, "data_processor") == [alerts[0].data]
    assert set(said(rig, "data_processor")) == {
        "Data processor initialized",
        "Normal temperature: 28.00°C",
        "WARNING: High temperature detected: 28.01°C",
        "Robot status: idle",
    }


async def average(rig: Rig, count: int) -> GetAverageTemperature_Response:
    return await rig.call(AVERAGE, GetAverageTemperature.Request(count=count))


async def test_the_average_of_the_last_few(rig: Rig) -> None:
    await rig.start(DataProcessor)
    alerts = rig.probe(ALERT)
    none = await average(rig, 4)
    assert (none.success, none.message) == (False, "no temperature has been received yet")
    values = [20.5, 21.25, 22.0, 23.5, 24.0, 25.5, 26.25, 27.0, 27.5, 29.0]
    for value in values:
        rig.publish(TEMPERATURE, Float32(data=value))
    await rig.quiet()
    four = await average(rig, 4)
    assert (four.success, four.samples) == (True, 4)
    assert four.average == pytest.approx(sum(values[-4:]) / 4, abs=1e-5)
    many = await average(rig, 50)
    assert (many.samples, many.average) == (10, pytest.approx(sum(values) / 10, abs=1e-5))
    assert many.message == "Average of the last 10 temperatures, 50 were asked for"
    for count in (0, -1):
        assert not (await average(rig, count)).success
    assert alerts.times == [0.0]  # nobody was kept waiting


# -- the smallest ones ------------------------------------------------------------------------------------------------------


async def test_a_minimal_node_says_hello_is_listed_and_ends(rig: Rig) -> None:
    system = await rig.start(minimal_node.tree())
    await rig.advance(10.0)
    assert said(rig, "minimal_node") == ["Hello ROS 2!"]
    assert "/minimal_node" in {node.name for node in system.snapshot().nodes}
    await system.stop()
    assert not system.running


async def test_readings_in_words(rig: Rig) -> None:
    await rig.start(text_topics.SensorPublisher)
    data = rig.probe(text_topics.SENSOR_DATA)
    await rig.advance(5.0)
    assert [message.data for message in data] == [f"Sensor reading {n}" for n in range(10)]
    assert said(rig, "sensor_publisher")[0] == 'Publishing: "Sensor reading 0"'


async def test_commands_in_words(rig: Rig) -> None:
    await rig.start(text_topics.tree())
    rig.publish(text_topics.MOTOR_COMMANDS, String(data="go"))
    await rig.quiet()
    assert said(rig, "motor_subscriber") == ['Received: "go"']


async def test_what_the_talker_says_the_listener_hears(rig: Rig) -> None:
    await rig.start(talker_listener.tree())
    chatter = rig.probe(talker_listener.CHATTER)
    await rig.advance(5.0)
    texts = [f"Hello World {n}" for n in range(5)]
    assert [message.data for message in chatter] == texts
    assert said(rig, "talker") == [f"Publishing: {text}" for text in texts]
    assert said(rig, "listener") == [f"Received: {text}" for text in texts]


# -- images -----------------------------------------------------------------------------------------------------------------


async def test_ten_seconds_of_images_all_of_them_seen(rig: Rig) -> None:
    await rig.start(camera_topics.tree())
    frames = rig.probe(CAMERA_RGB)
    await rig.advance(10.0)
    assert 301 <= len(frames) <= 305
    assert {(f.data.nbytes, f.step, f.encoding, f.header.frame_id) for f in frames} == {
        (921600, 1920, "rgb8", "camera_frame")
    }
    assert (
        len({id(f.data.base if f.data.base is not None else f.data) for f in frames}) == 1
    )  # no copies: memory is stable
    assert rig.node(ImageProcessor).frames >= 0.99 * rig.node(CameraPublisher).frames
    assert said(rig, "image_processor")[-1] == "Received image: 640x480, encoding: rgb8"


class Demanding(Node):
    """The reader as the tutorial prints it: it asks for reliable delivery."""

    seen = 0

    @CAMERA_RGB.on(qos=10)
    def look(self, image: Image) -> None:
        self.seen += 1


async def test_a_reader_that_demands_too_much_sees_nothing_and_both_are_told(rig: Rig) -> None:
    await rig.start(CameraPublisher, Demanding)
    await rig.advance(1.0)
    assert rig.node(Demanding).seen == 0
    lines = [record for record in rig.logs if "incompatible QoS" in record.event]
    assert sorted(record.node for record in lines) == ["/camera_publisher", "/demanding"]
    assert all("RELIABILITY" in repr(record) for record in lines)


async def test_two_sensors_on_one_topic_are_told_apart(rig: Rig) -> None:
    await rig.start(sensor_fusion.tree())
    images = rig.probe(FUSED)
    await rig.advance(5.0)
    assert len(images) == 100
    assert rig.node(SensorFusion).seen == {"camera_frame": 50, "lidar_frame": 50}


async def test_a_red_square_is_found_and_turned_to(rig: Rig) -> None:
    await rig.start(Child(camera_detector.Detector), Child(camera_detector.Controller))
    detections, commands = rig.probe(camera_detector.DETECTIONS), rig.probe(camera_detector.CMD_VEL)
    box = Box(200, 60, 40, 40)
    image = Image(height=240, width=320, encoding="rgb8", step=960, data=draw(box).reshape(-1))
    rig.publish(camera_detector.IMAGE, image)
    await rig.quiet()
    found = detections[0]
    assert all(
        abs(seen - true) <= 2 for seen, true in zip((found.x, found.y, found.width, found.height), box, strict=True)
    )
    assert (found.label, found.pixels) == ("red", 1600)
    assert commands[0].angular.z == pytest.approx(-(220 / 160 - 1.0))  # it is to the right


def test_without_red_there_is_nothing_to_detect() -> None:
    assert red_box(draw(Box(0, 0, 0, 0))) is None
    assert red_box(draw(Box(10, 10, 2, 2))) is None  # four pixels may be noise
    assert red_box(draw(Box(0, 0, 320, 240))) == (Box(0, 0, 320, 240), 320 * 240)


async def test_the_pipeline_runs_and_other_encodings_are_refused(rig: Rig) -> None:
    await rig.start(camera_detector.tree())
    commands = rig.probe(camera_detector.CMD_VEL)
    await rig.advance(10.0)
    assert len(commands) == 100
    assert min(c.angular.z for c in commands) < -0.8 and max(c.angular.z for c in commands) > 0.8
    rig.publish(camera_detector.IMAGE, Image(height=1, width=1, encoding="bgr8", step=3, data=b"\0\0\0"))
    await rig.quiet()
    assert warnings(rig, "detector") == ["Cannot read images of encoding 'bgr8', only rgb8"]

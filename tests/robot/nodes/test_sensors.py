"""The robot's sensors as others meet them: at their rates, all at once, rendered only for those who listen, and what is made of them."""

from __future__ import annotations

import zlib
from dataclasses import replace
from pathlib import Path
from typing import TypeVar

import numpy as np
import pytest

from actors import Child, Node, Supervisor, Topic, every, publishes
from actors.interfaces import cdr
from actors.interfaces.builtin_interfaces.msg import Time
from actors.interfaces.sensor_msgs.msg import Image, PointCloud2, PointField
from actors.interfaces.std_msgs.msg import Header, String
from actors.interfaces.std_srvs.srv import Trigger
from actors.testing import Rig
from actors.tf2 import Transform
from robot import Robot
from robot.contracts import (
    CAMERA_DEPTH,
    CAMERA_INFO,
    CAMERA_POINTS,
    CAMERA_RGB,
    CAPTURE_PHOTO,
    CONTACTS,
    DETECTIONS,
    IMU,
    IMU_RAW,
    JOINT_STATES,
    LIDAR_POINTS,
    MOTOR_TARGETS,
    ODOMETRY,
    POSE,
    SCAN,
)
from robot.geometry.planar import Pose2
from robot.hardware import mounts
from robot.hardware.body import Sample
from robot.hardware.lens import HEIGHT, WIDTH, project
from robot.nodes.camera import Camera
from robot.nodes.detector import Detector
from robot.nodes.gait import Gait
from robot.nodes.lidar import Lidar
from robot.nodes.motors import Motors
from robot.nodes.point_clouds import pack_points, unpack_points
from robot.nodes.proprioception import Proprioception
from robot.scenes.scene import Box, Cylinder, Thing
from robot.sim import devices as simulated_devices
from robot.sim.devices import SimulatedCamera, SimulatedLidar
from robot.sim.kinematic import KinematicBody
from tests.robot.stage import Eyes, done, floor, robot_around

T = TypeVar("T")

CUP = Thing("cup", Cylinder(1.6, 0.2, 0.04, height=0.12), (210, 30, 30), z=0.2)
WALL = Box(4.0, 0.0, 0.2, 6.0, height=2.0)
ROOM = replace(floor(WALL, half=5.0), things=(CUP,))


def png_size(path: Path) -> tuple[int, int]:
    """Width and height of a PNG file whose pixels can be unpacked."""
    picture = path.read_bytes()
    assert picture.startswith(b"\x89PNG")
    width, height = (int.from_bytes(picture[at : at + 4], "big") for at in (16, 20))
    start = picture.index(b"IDAT") + 4
    rows = zlib.decompress(picture[start : start + int.from_bytes(picture[start - 8 : start - 4], "big")])
    assert len(rows) == height * (1 + 3 * width)
    return width, height


def one(node: type[Node], *arguments: object, **parameters: object) -> Supervisor:
    return Supervisor("lab", children=[Child(node, args=arguments, parameters=parameters)])


# -- rates ----------------------------------------------------------------------------------------------------------------------


async def test_all_sensors_of_the_robot_at_once(rig: Rig) -> None:
    await rig.start(Robot("warehouse", body="kinematic", mission="patrol", seed=1).tree)
    rates = {
        CAMERA_RGB: 30.0, CAMERA_DEPTH: 30.0, CAMERA_INFO: 30.0, CAMERA_POINTS: 10.0, SCAN: 10.0, LIDAR_POINTS: 10.0,
        IMU: 200.0, IMU_RAW: 200.0, JOINT_STATES: 200.0, CONTACTS: 200.0, ODOMETRY: 50.0, POSE: 50.0,
    }  # fmt: skip
    await rig.advance(1.0)
    probes = {topic: rig.probe(topic) for topic in rates}
    await rig.advance(3.0)
    for topic, rate in rates.items():
        assert len(probes[topic]) == pytest.approx(3.0 * rate, rel=0.02, abs=1), topic
    image = probes[CAMERA_RGB].last
    depth = probes[CAMERA_DEPTH].last
    assert isinstance(image, Image) and isinstance(depth, Image)
    assert (image.width, image.height, image.step, image.encoding, len(image.data)) == (640, 480, 1920, "rgb8", 921600)
    assert (depth.width, depth.height, depth.step, depth.encoding, len(depth.data)) == (640, 480, 1280, "16UC1", 614400)
    assert image.header == depth.header
    assert image.header.frame_id == "camera_link"


@pytest.mark.parametrize("rate", [100.0, 200.0])
async def test_the_imu_runs_at_either_rate_while_the_encoders_keep_theirs(rig: Rig, rate: float) -> None:
    await rig.start(one(Proprioception, KinematicBody(ROOM, seed=1), imu_rate=rate))
    imu, raw, joints = rig.probe(IMU), rig.probe(IMU_RAW), rig.probe(JOINT_STATES)
    await rig.advance(2.0)
    assert len(imu) == pytest.approx(2.0 * rate, abs=2)
    assert len(raw) == pytest.approx(400, abs=2)
    assert len(joints) == pytest.approx(400, abs=2)
    steps = np.diff([m.header.stamp.sec + 1e-9 * m.header.stamp.nanosec for m in imu])
    assert steps == pytest.approx(np.full(len(steps), 1.0 / rate), abs=1e-6)


class Held(KinematicBody):
    """A body whose samples stay away for a while, as one in a process of its own that is held up."""

    silent = False

    def next_sample(self) -> Sample | None:
        return None if self.silent else super().next_sample()


async def test_samples_that_are_read_late_are_told_as_fewer(rig: Rig) -> None:
    body = Held(ROOM, seed=1)
    await rig.start(one(Proprioception, body))
    await rig.advance(0.5)
    joints, imu = rig.probe(JOINT_STATES), rig.probe(IMU)
    body.silent = True
    await rig.advance(0.05)
    assert len(joints) == 0
    body.silent = False
    await rig.advance(0.005)
    assert len(joints) == len(imu) == 3  # eleven samples, in groups of four
    await rig.advance(0.05)
    stamps = np.array([m.header.stamp.sec + 1e-9 * m.header.stamp.nanosec for m in joints])
    assert np.diff(stamps[:3]) == pytest.approx([0.02, 0.015], abs=1e-6)
    assert np.diff(stamps[3:]) == pytest.approx(np.full(len(stamps) - 4, 0.005), abs=1e-6)  # all of them again


async def test_an_imu_rate_that_is_no_part_of_the_rate_is_refused(rig: Rig) -> None:
    rig.expect_failure()
    with pytest.raises(Exception, match=r"imu_rate 150 Hz is no whole part of rate 200 Hz: give 200, 100"):
        await rig.start(one(Proprioception, KinematicBody(ROOM, seed=1), imu_rate=150.0))


async def test_the_control_loop_runs_at_500_hz(rig: Rig) -> None:
    body = KinematicBody(ROOM, seed=1)
    children = [
        Child(Motors, args=(body,), stop=5.0),
        Child(Proprioception, args=(body,), parameters={"rate": 500.0, "imu_rate": 250.0}),
        Child(Gait, parameters={"commands": "motor_targets"}),
    ]
    await rig.start(Supervisor("robot", children=children))
    probe = rig.probe(MOTOR_TARGETS)
    await rig.advance(2.0)
    assert len(probe) == pytest.approx(1000, rel=0.02)


async def test_timers_of_two_ten_half_and_one_hertz(rig: Rig) -> None:
    topics = {
        hz: Topic(String, f"every_{name}") for name, hz in (("half", 0.5), ("one", 1.0), ("two", 2.0), ("ten", 10.0))
    }

    class Clockwork(Node):
        half, one, two, ten = (publishes(topics[hz]) for hz in (0.5, 1.0, 2.0, 10.0))

        @every(period=2.0)
        def plan(self) -> None:
            self.half(String())

        @every(hz=1)
        def chatter(self) -> None:
            self.one(String())

        @every(period=0.5)
        def telemetry(self) -> None:
            self.two(String())

        @every(hz=10)
        def sensor(self) -> None:
            self.ten(String())

    await rig.start(one(Clockwork))
    probes = {hz: rig.probe(topic) for hz, topic in topics.items()}
    await rig.advance(100.0)
    assert {hz: len(probe) for hz, probe in probes.items()} == {hz: 100 * hz for hz in topics}


# -- the camera -----------------------------------------------------------------------------------------------------------------


async def test_a_camera_that_nobody_listens_to_renders_nothing(rig: Rig, monkeypatch: pytest.MonkeyPatch) -> None:
    looks: list[float] = []
    look = simulated_devices.View.look
    monkeypatch.setattr(simulated_devices.View, "look", lambda *given: looks.append(rig.now) or look(*given))
    await rig.start(one(Camera, SimulatedCamera(KinematicBody(ROOM, seed=1))))
    await rig.advance(2.0)
    assert looks == []
    info, points = rig.probe(CAMERA_INFO), rig.probe(CAMERA_POINTS)
    await rig.advance(1.0)
    assert (len(info), len(points), len(looks)) == (30, 10, 10)
    info.close()
    points.close()
    rig.probe(CAMERA_DEPTH)
    await rig.advance(1.0)
    assert len(looks) == 40


async def test_the_camera_looks_from_where_the_body_stands_and_sees_what_is_carried(rig: Rig) -> None:
    body = KinematicBody(ROOM, seed=1)
    await rig.start(one(Camera, SimulatedCamera(body)))
    probe = rig.probe(CAMERA_DEPTH)
    await rig.advance(0.1)
    body.place(Pose2(1.0, 0.0))
    probe.clear()
    await rig.advance(0.1)
    depth = probe.last
    assert depth is not None
    middle = depth.data.view("<u2").reshape(HEIGHT, WIDTH)[HEIGHT // 2 - 20, WIDTH // 2 + 100]
    assert middle == pytest.approx(1000 * (3.9 - 1.45), abs=1)


async def test_the_camera_sees_obstacles_that_have_been_put_into_the_world_since_it_began(rig: Rig) -> None:
    body = KinematicBody(ROOM, seed=1)
    await rig.start(one(Camera, SimulatedCamera(body)))
    depths = rig.probe(CAMERA_DEPTH)
    await rig.advance(0.1)
    body.set_obstacles([Box(2.0, 0.0, 0.2, 6.0, height=2.0)])
    await rig.advance(0.1)
    middle = [
        int(np.frombuffer(bytes(image.data), "<u2").reshape(HEIGHT, WIDTH)[HEIGHT // 2, WIDTH // 4]) for image in depths
    ]
    camera = mounts.CAMERA.translation[0]
    assert middle[0] == pytest.approx(1000 * (3.9 - camera), abs=5)
    assert middle[-1] == pytest.approx(1000 * (1.9 - camera), abs=5)


async def test_image_messages_take_the_pictures_without_a_copy(rig: Rig, monkeypatch: pytest.MonkeyPatch) -> None:
    frames = []
    look = simulated_devices.View.look
    monkeypatch.setattr(simulated_devices.View, "look", lambda *given: frames.append(look(*given)) or frames[-1])
    await rig.start(one(Camera, SimulatedCamera(KinematicBody(ROOM, seed=1))))
    rgb, depth = rig.probe(CAMERA_RGB), rig.probe(CAMERA_DEPTH)
    await rig.advance(0.04)
    assert rgb[0].data is frames[0].rgb
    assert depth[0].data is frames[0].depth


async def test_a_photo_is_stored_and_its_path_answered(rig: Rig, tmp_path: Path) -> None:
    await rig.start(one(Camera, SimulatedCamera(KinematicBody(ROOM, seed=1)), photo_directory=str(tmp_path / "photos")))
    answer = await done(rig, rig.call(CAPTURE_PHOTO, Trigger.Request()))
    assert answer.success
    path = Path(answer.message)
    assert path.parent == tmp_path / "photos"
    assert png_size(path) == (640, 480)


async def test_a_photo_that_cannot_be_stored_is_told(rig: Rig, tmp_path: Path) -> None:
    (tmp_path / "file").write_text("no folder")
    await rig.start(one(Camera, SimulatedCamera(KinematicBody(ROOM, seed=1)), photo_directory=str(tmp_path / "file")))
    answer = await done(rig, rig.call(CAPTURE_PHOTO, Trigger.Request()))
    assert not answer.success
    assert answer.message.startswith("the photo was not stored: ")


# -- points ---------------------------------------------------------------------------------------------------------------------


def test_a_hundred_points_are_1200_bytes_and_come_back_the_same() -> None:
    points = np.random.default_rng(1).normal(0.0, 5.0, (100, 3)).astype(np.float32)
    cloud = pack_points(Header(frame_id="lidar_link"), points)
    assert len(cloud.data) == cloud.row_step == 1200
    assert (cloud.height, cloud.width, cloud.point_step, cloud.is_dense) == (1, 100, 12, True)
    assert [(f.name, f.offset, f.datatype) for f in cloud.fields] == [("x", 0, 7), ("y", 4, 7), ("z", 8, 7)]
    np.testing.assert_array_equal(unpack_points(cloud), points)
    np.testing.assert_array_equal(unpack_points(cdr.decode(PointCloud2, cdr.encode(cloud))), points)


def test_clouds_of_others_are_read_whatever_else_they_hold() -> None:
    kind = np.dtype(
        {
            "names": ["i", "z", "x", "y"],
            "formats": [">f4", ">f8", ">f8", ">f8"],
            "offsets": [0, 8, 16, 24],
            "itemsize": 40,
        }
    )
    data = np.zeros((2, 3), dtype=kind)
    data["x"], data["y"], data["z"] = np.arange(6.0).reshape(2, 3), 7.0, -1.5
    fields = [
        PointField(name=name, offset=kind.fields[name][1], datatype=8 if name in "xyz" else 7, count=1)
        for name in kind.names
    ]
    cloud = PointCloud2(
        height=2, width=3, fields=fields, is_bigendian=True, point_step=40, row_step=120, data=np.frombuffer(data.tobytes(), np.uint8)
    )  # fmt: skip
    np.testing.assert_array_equal(unpack_points(cloud), [(x, 7.0, -1.5) for x in range(6)])


def test_what_is_no_cloud_is_refused() -> None:
    with pytest.raises(ValueError, match=r"shape \(n, 3\), not \(4, 2\)"):
        pack_points(Header(), np.zeros((4, 2)))
    with pytest.raises(ValueError, match="its fields are: none"):
        unpack_points(PointCloud2())
    good = pack_points(Header(), np.zeros((4, 3)))
    with pytest.raises(ValueError, match="needs 48 bytes and has 12"):
        unpack_points(good.replace(data=good.data[:12].copy()))
    assert not pack_points(Header(), [[np.nan, 0.0, 0.0]]).is_dense
    assert unpack_points(pack_points(Header(), np.zeros((0, 3)))).shape == (0, 3)


async def test_the_points_of_lidar_and_camera_lie_on_the_wall(rig: Rig) -> None:
    body = KinematicBody(ROOM, seed=1, noise=False)
    await rig.start(
        Supervisor(
            "lab", children=[Child(Lidar, args=(SimulatedLidar(body),)), Child(Camera, args=(SimulatedCamera(body),))]
        )
    )
    lidar, camera, scan = rig.probe(LIDAR_POINTS), rig.probe(CAMERA_POINTS), rig.probe(SCAN)
    await rig.advance(0.25)
    assert lidar[0].header == scan[0].header
    points = unpack_points(lidar[0])
    assert len(points) == int((scan[0].ranges < scan[0].range_max).sum())
    ahead = points[(np.abs(points[:, 1]) < 2.5) & (points[:, 0] > 0.0)]
    assert ahead[:, 0] == pytest.approx(np.full(len(ahead), 3.9), abs=1e-5)
    cloud = unpack_points(camera[0])
    assert 2000 < len(cloud) <= 4800
    wall = cloud[cloud[:, 2] > 0.2]
    assert wall[:, 0] == pytest.approx(np.full(len(wall), 3.9 - 0.45), abs=1e-3)
    assert cloud[:, 2].min() == pytest.approx(-0.236, abs=1e-3)  # the floor, below a sitting robot's camera


# -- detections -----------------------------------------------------------------------------------------------------------------


async def test_a_red_square_in_a_picture_is_a_detection_within_2_px(rig: Rig) -> None:
    await rig.start(one(Detector))
    found = rig.probe(DETECTIONS)
    image, depth = np.full((480, 640, 3), 90, np.uint8), np.full((480, 640), 1500, np.uint16)
    image[200:260, 300:360] = (230, 20, 20)
    header = Header(frame_id="camera_link")
    for _ in range(4):
        rig.publish(CAMERA_RGB, Image(header=header, height=480, width=640, encoding="rgb8", step=1920, data=image))
        rig.publish(
            CAMERA_DEPTH,
            Image(header=header, height=480, width=640, encoding="16UC1", step=1280, data=depth.view(np.uint8)),
        )
        await rig.advance(0.2)
    detection = found.last
    assert detection is not None
    assert detection.label == "red"
    assert detection.header == header
    box = (detection.x, detection.y, detection.width, detection.height)
    assert box == pytest.approx((300, 200, 60, 60), abs=2)
    assert detection.pixels == 3600
    assert detection.position.x == pytest.approx(1.5)


async def test_the_cup_in_the_room_is_found_in_space(rig: Rig) -> None:
    body = KinematicBody(ROOM, seed=1)
    system = await rig.start(robot_around(body))
    await system.join(Child(Eyes))
    await rig.advance(2.5)
    found = rig.probe(DETECTIONS)
    await rig.advance(0.5)
    seen = found.last
    assert seen is not None
    frame = seen.header.frame_id
    where = Transform.from_msg(
        await done(rig, rig.node(Eyes).tf.lookup_transform_async("map", frame, seen.header.stamp))
    )
    x, y, z = where.point((seen.position.x, seen.position.y, seen.position.z))
    assert (x, y) == pytest.approx((1.6, 0.2), abs=0.06)  # its near side, and the localizer's centimetres
    assert z == pytest.approx(0.26, abs=0.05)
    column, row = project(seen.position.x, seen.position.y, seen.position.z)
    assert abs(column - (seen.x + seen.width / 2)) < 2 and abs(row - (seen.y + seen.height / 2)) < 8


async def test_the_detector_asks_the_camera_for_no_more_than_it_looks_at(
    rig: Rig, monkeypatch: pytest.MonkeyPatch
) -> None:
    looks: list[float] = []
    look = simulated_devices.View.look
    monkeypatch.setattr(simulated_devices.View, "look", lambda *given: looks.append(rig.now) or look(*given))
    body = KinematicBody(ROOM, seed=1)
    await rig.start(Supervisor("lab", children=[Child(Camera, args=(SimulatedCamera(body),)), Child(Detector)]))
    await rig.advance(1.0)
    assert looks == []
    found = rig.probe(DETECTIONS)
    await rig.advance(2.0)
    assert 8 <= len(looks) <= 11
    assert len(found) == len(looks)


async def test_a_silent_camera_is_told_once(rig: Rig) -> None:
    system = await rig.start(one(Detector))
    rig.probe(DETECTIONS)
    await rig.advance(5.0)
    lines = [record.event for record in system.records if record.node == "/detector"]
    assert lines == ["the camera is silent: nothing can be detected"]


# -- frames ---------------------------------------------------------------------------------------------------------------------


async def test_the_robots_frames_agree_with_its_poses(rig: Rig) -> None:
    robot = Robot("warehouse", body="kinematic", mission="patrol", seed=1)
    system = await rig.start(robot.tree)
    await rig.advance(1.0)
    await system.join(Child(Eyes))
    poses, odoms, scans = rig.probe(POSE), rig.probe(ODOMETRY), rig.probe(SCAN)
    await rig.advance(4.0)
    tf = rig.node(Eyes).tf

    def lookup(target: str, source: str, at: Time | None = None) -> Transform:
        return Transform.from_msg(tf.lookup_transform(target, source, at))

    links = {f"{leg}_{link}" for leg in ("fl", "fr", "rl", "rr") for link in ("hip", "thigh", "calf", "foot")}
    others = {"base_link", "camera_link", "gimbal_link", "imu_link", "lidar_link", "map", "odom"}
    assert set(tf.all_frame_names()) == others | links
    odom = odoms[-5]
    base = lookup("odom", "base_link", odom.header.stamp)
    there = odom.pose.pose.position
    assert base.translation == pytest.approx((there.x, there.y, there.z), abs=1e-9)
    pose = poses[-5]
    on_map = lookup("map", "base_link", pose.header.stamp).translation
    assert on_map[:2] == pytest.approx((pose.pose.position.x, pose.pose.position.y), abs=1e-6)
    level = lookup("map", "lidar_link", pose.header.stamp)
    assert level.rotation[1:3] == pytest.approx((0.0, 0.0), abs=1e-9)
    assert scans[0].header.frame_id == "lidar_link"
    truth = robot.body.truth().position
    assert lookup("map", "base_link").translation[:2] == pytest.approx(truth[:2].tolist(), abs=0.1)

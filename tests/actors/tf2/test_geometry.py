"""Messages in another frame: against 4 x 4 matrices of numpy, and the values that tf2's own tests state."""

from __future__ import annotations

from math import pi
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from actors.interfaces.builtin_interfaces.msg import Time
from actors.interfaces.geometry_msgs import msg as geometry
from actors.interfaces.sensor_msgs.msg import PointCloud2, PointField
from actors.interfaces.std_msgs.msg import Header, String
from actors.tf2 import Buffer, InvalidArgumentException, Transform, do_transform, stamped

HALF_TURN_X = stamped("a", "b", Transform((1.0, 0.0, 0.0), (0.0, 1.0, 0.0, 0.0)), Time(sec=2))
"""b is 1 m along x of a, and turned by 180 degrees about x."""
ANY = stamped("a", "b", Transform.from_rpy((1.0, -2.0, 0.5), 0.3, -0.7, 1.9), Time(sec=2))
HERE = Header(frame_id="b", stamp=Time(sec=1))


def matrix(transform: geometry.TransformStamped) -> NDArray[np.float64]:
    """4 x 4, by scipy."""
    t, q = transform.transform.translation, transform.transform.rotation
    whole = np.eye(4)
    whole[:3, :3] = Rotation.from_quat((q.x, q.y, q.z, q.w)).as_matrix()
    whole[:3, 3] = (t.x, t.y, t.z)
    return whole


def xyz(value: Any) -> tuple[float, float, float]:
    return (value.x, value.y, value.z)


def test_a_point_a_pose_and_a_covariance_are_those_that_tf2_gives() -> None:
    buffer = Buffer()
    buffer.set_transform(HALF_TURN_X)
    header = Header(frame_id="a", stamp=Time(sec=2))
    position, turned = geometry.Point(x=1.0, y=2.0, z=3.0), geometry.Quaternion(w=0.0, x=1.0)
    point = buffer.transform(geometry.PointStamped(header=header, point=position), "b")
    assert xyz(point.point) == pytest.approx((0.0, -2.0, -3.0))
    assert (point.header.frame_id, point.header.stamp) == ("b", Time(sec=2))
    pose = buffer.transform(
        geometry.PoseStamped(header=header, pose=geometry.Pose(position=position, orientation=turned)), "b"
    )
    assert xyz(pose.pose.position) == pytest.approx((0.0, -2.0, -3.0))
    assert abs(pose.pose.orientation.w) == pytest.approx(1.0)


def test_the_covariance_turns_in_both_halves() -> None:
    there = stamped("a", "b", Transform((1.0, 2.0, 3.0), (0.0, 1.0, 0.0, 0.0)), Time())
    pose = geometry.Pose(position=geometry.Point(x=1.0, y=2.0, z=3.0), orientation=geometry.Quaternion(w=0.0, x=1.0))
    given = geometry.PoseWithCovarianceStamped(
        header=HERE,
        pose=geometry.PoseWithCovariance(pose=pose, covariance=[1.0, 2.0, 3.0, 4.0, 5.0, 6.0] * 6),
    )
    moved = do_transform(given, there)
    same, other = [1.0, -2.0, -3.0, 4.0, -5.0, -6.0], [-1.0, 2.0, 3.0, -4.0, 5.0, 6.0]
    assert moved.pose.covariance.tolist() == pytest.approx([*same, *other, *other] * 2)
    assert xyz(moved.pose.pose.position) == pytest.approx((2.0, 0.0, 0.0))
    assert abs(moved.pose.pose.orientation.w) == pytest.approx(1.0)


def test_a_covariance_is_that_of_turned_random_numbers() -> None:
    root = np.random.default_rng(1).normal(size=(6, 6))
    before = root @ root.T
    given = geometry.PoseWithCovariance(covariance=before.ravel())
    turn = np.kron(np.eye(2), matrix(ANY)[:3, :3])
    assert do_transform(given, ANY).covariance.reshape(6, 6) == pytest.approx(turn @ before @ turn.T)


@pytest.mark.parametrize(
    ("transform", "expected"),
    [
        (Transform((1.0, 2.0, 3.0)), (1.0, 0.0, 0.0)),  # a translation does nothing to a vector
        (Transform((1.0, 2.0, 3.0), (0.0, 0.0, 1.0, 0.0)), (-1.0, 0.0, 0.0)),  # half a turn about y
    ],
)
def test_a_vector_is_turned_only(transform: Transform, expected: tuple[float, ...]) -> None:
    vector = geometry.Vector3Stamped(header=HERE, vector=geometry.Vector3(x=1.0))
    assert xyz(do_transform(vector, stamped("a", "b", transform, Time())).vector) == pytest.approx(expected, abs=1e-12)


def test_every_kind_agrees_with_matrices_and_gets_the_header_of_the_transform() -> None:
    whole = matrix(ANY)
    turn = whole[:3, :3]
    place = np.array((0.4, -0.2, 3.0))
    there = (whole @ (*place, 1.0))[:3]
    point, vector = geometry.Point(x=0.4, y=-0.2, z=3.0), geometry.Vector3(x=0.4, y=-0.2, z=3.0)
    small = geometry.Point32(x=0.4, y=-0.2, z=3.0)
    assert xyz(do_transform(point, ANY)) == pytest.approx(there)
    assert xyz(do_transform(small, ANY)) == pytest.approx(there, abs=1e-6)
    assert xyz(do_transform(vector, ANY)) == pytest.approx(turn @ place)
    polygon = do_transform(geometry.PolygonStamped(header=HERE, polygon=geometry.Polygon(points=(small,))), ANY)
    assert xyz(polygon.polygon.points[0]) == pytest.approx(there, abs=1e-6)
    assert polygon.header == ANY.header
    turned = Rotation.from_euler("xyz", (0.1, 0.2, 0.3))
    x, y, z, w = turned.as_quat().tolist()
    orientation = geometry.Quaternion(x=x, y=y, z=z, w=w)
    both = (Rotation.from_matrix(turn) * turned).as_matrix()
    for moved in (
        do_transform(geometry.QuaternionStamped(header=HERE, quaternion=orientation), ANY).quaternion,
        do_transform(geometry.Pose(orientation=orientation), ANY).orientation,
        do_transform(geometry.PoseArray(header=HERE, poses=(geometry.Pose(orientation=orientation),)), ANY)
        .poses[0]
        .orientation,
    ):
        assert Rotation.from_quat((moved.x, moved.y, moved.z, moved.w)).as_matrix() == pytest.approx(both)


def test_a_wrench_has_the_same_power_in_either_frame() -> None:
    """Force times velocity plus torque times turning does not depend on the frame: twists go across by the other rule."""
    whole = matrix(ANY)
    turn, offset = whole[:3, :3], whole[:3, 3]
    force, torque, turning, speed = np.random.default_rng(2).normal(size=(4, 3))
    wrench = geometry.WrenchStamped(
        header=HERE,
        wrench=geometry.Wrench(
            force=geometry.Vector3(x=force[0], y=force[1], z=force[2]),
            torque=geometry.Vector3(x=torque[0], y=torque[1], z=torque[2]),
        ),
    )
    moved = do_transform(wrench, ANY).wrench
    turning_there = turn @ turning
    speed_there = turn @ speed + np.cross(offset, turning_there)  # of the body's point at the origin of a
    power = np.dot(xyz(moved.force), speed_there) + np.dot(xyz(moved.torque), turning_there)
    assert power == pytest.approx(force @ speed + torque @ turning)


def test_what_has_no_place_or_no_header_is_refused_by_name() -> None:
    with pytest.raises(TypeError, match=r"do_transform does not know String; it takes Point, Point32, Vector3"):
        do_transform(String(), ANY)
    with pytest.raises(TypeError, match=r"does not know PointField; did you mean 'Point"):
        do_transform(PointField(), ANY)
    with pytest.raises(TypeError, match=r"Point has no header, so it has no frame and no time; look the transform up"):
        Buffer().transform(geometry.Point(), "a")
    with pytest.raises(InvalidArgumentException, match="rotation not of length 0"):
        do_transform(geometry.Point(), geometry.TransformStamped().replace(transform=nothing()))


def nothing() -> geometry.Transform:
    return geometry.Transform(rotation=geometry.Quaternion(w=0.0))


# -- clouds -----------------------------------------------------------------------------------------------------------------------


def cloud(points: NDArray[Any], *, height: int = 1, padding: int = 0, big: bool = False) -> PointCloud2:
    """A cloud of a structured array, row by row, with bytes of padding after each row."""
    assert points.dtype.names is not None and points.dtype.fields is not None
    kinds = {"f4": PointField.FLOAT32, "f8": PointField.FLOAT64, "u2": PointField.UINT16}
    fields = tuple(
        PointField(
            name=name,
            offset=points.dtype.fields[name][1],
            datatype=kinds[points.dtype.fields[name][0].str[1:]],
            count=1,
        )
        for name in points.dtype.names
    )
    width = len(points) // height
    rows = points.reshape(height, width)
    data = b"".join(row.tobytes() + b"\x07" * padding for row in rows)
    step = points.dtype.itemsize
    return PointCloud2(
        header=HERE,
        height=height,
        width=width,
        fields=fields,
        is_bigendian=big,
        point_step=step,
        row_step=width * step + padding,
        data=np.frombuffer(data, np.uint8),
        is_dense=True,
    )


@pytest.mark.parametrize("order", ["<", ">"])
@pytest.mark.parametrize("size", ["f4", "f8"])
def test_the_points_of_a_cloud_go_across_and_its_other_fields_stay(order: str, size: str) -> None:
    kind = np.dtype([("intensity", order + "u2"), ("x", order + size), ("y", order + size), ("z", order + size)])
    points = np.zeros(6, kind)
    generator = np.random.default_rng(3)
    for name in ("x", "y", "z"):
        points[name] = generator.normal(size=6)
    points["intensity"] = range(6)
    given = cloud(points, height=2, padding=5, big=order == ">")
    before = given.data.tobytes()
    moved = do_transform(given, ANY)
    assert (moved.header.frame_id, moved.header.stamp) == ("a", HERE.stamp)  # the points are still of their own time
    rows = moved.data.reshape(2, -1)
    assert (rows[:, -5:] == 7).all()
    found = np.frombuffer(rows[:, :-5].tobytes(), kind)
    old = np.column_stack([points["x"], points["y"], points["z"], np.ones(6)])
    expected = (matrix(ANY) @ old.T).T[:, :3]
    assert np.column_stack([found["x"], found["y"], found["z"]]) == pytest.approx(expected, abs=1e-5)
    assert found["intensity"].tolist() == list(range(6))
    assert given.data.tobytes() == before


def test_a_cloud_of_points_100_m_above_is_seen_100_m_below() -> None:
    buffer = Buffer()
    buffer.set_transform_static(stamped("test", "target", Transform((0.0, 0.0, 100.0)), Time()))
    points = np.zeros(2, np.dtype([(name, "<f4") for name in "xyz"]))
    points["z"] = (1.0, 5.0)
    moved = buffer.transform(cloud(points).replace(header=Header(frame_id="test")), "target")
    found = np.frombuffer(moved.data.tobytes(), points.dtype)
    assert found["z"].tolist() == [-99.0, -95.0]
    assert moved.header.frame_id == "target"


def test_a_cloud_without_coordinates_or_with_too_few_bytes_is_refused() -> None:
    points = np.zeros(2, np.dtype([("x", "<f4"), ("y", "<f4"), ("range", "<f4")]))
    with pytest.raises(InvalidArgumentException, match=r"needs fields x, y and z.*its fields: x, y, range"):
        do_transform(cloud(points), ANY)
    with pytest.raises(InvalidArgumentException, match="its fields: none"):
        do_transform(PointCloud2(), ANY)
    whole = cloud(np.zeros(2, np.dtype([(name, "<f4") for name in "xyz"])))
    beyond = (*whole.fields[:2], whole.fields[2].replace(offset=9))
    for broken in (whole.replace(data=whole.data[:-1]), whole.replace(row_step=3), whole.replace(fields=beyond)):
        with pytest.raises(InvalidArgumentException, match=r"1 x 2 points of 12 bytes, \d+ bytes a row, does not fit"):
            do_transform(broken, ANY)
    empty = cloud(np.zeros(0, np.dtype([(name, "<f4") for name in "xyz"])))
    assert len(do_transform(empty, ANY).data) == 0


def test_a_transform_is_put_behind_the_other() -> None:
    inner = stamped("b", "c", Transform.from_rpy((0.2, 0.4, -3.0), 1.0, 0.5, -2.0), Time(sec=1))
    moved = do_transform(inner, ANY)
    assert matrix(moved) == pytest.approx(matrix(ANY) @ matrix(inner))
    assert (moved.header.frame_id, moved.child_frame_id, moved.header.stamp) == ("a", "c", Time(sec=2))
    assert do_transform(inner.transform, ANY) == moved.transform


def test_a_velocity_is_that_of_the_same_body_at_the_new_origin() -> None:
    """The body turns and slides; a point of it that is at the origin of a is followed for a moment, by numpy."""
    turning, sliding = np.array((0.3, -0.5, 0.8)), np.array((1.0, 2.0, -0.4))
    velocity = geometry.Twist(
        linear=geometry.Vector3(x=1.0, y=2.0, z=-0.4), angular=geometry.Vector3(x=0.3, y=-0.5, z=0.8)
    )
    given = geometry.VelocityStamped(header=HERE, body_frame_id="wheel", reference_frame_id="b", velocity=velocity)
    moved = do_transform(given, ANY)
    point = (np.linalg.inv(matrix(ANY)) @ (0.0, 0.0, 0.0, 1.0))[:3]
    step = 1e-6
    later = Rotation.from_rotvec(step * turning).apply(point) + step * sliding
    rotation = matrix(ANY)[:3, :3]
    assert xyz(moved.velocity.linear) == pytest.approx(tuple(rotation @ (later - point) / step), abs=1e-5)
    assert xyz(moved.velocity.angular) == pytest.approx(tuple(rotation @ turning))
    assert (moved.header.frame_id, moved.body_frame_id) == ("a", "wheel")


# -- roll, pitch, yaw -------------------------------------------------------------------------------------------------------------


def test_roll_pitch_and_yaw_are_about_fixed_axes_and_come_back() -> None:
    for rpy in ((0.3, -0.7, 1.9), (-3.0, 1.5, 0.0), (0.0, 0.0, -3.1)):
        there = Transform.from_rpy((0.0, 0.0, 0.0), *rpy)
        assert there.matrix == pytest.approx(Rotation.from_euler("xyz", rpy).as_matrix())
        assert there.rpy == pytest.approx(rpy)


@pytest.mark.parametrize("pitch", [pi / 2, -pi / 2])
def test_with_the_nose_straight_up_or_down_roll_is_nothing_and_the_rotation_the_same(pitch: float) -> None:
    there = Transform.from_rpy((0.0, 0.0, 0.0), 0.4, pitch, 0.9)
    roll, same, yaw = there.rpy
    assert (roll, same) == (0.0, pytest.approx(pitch))
    again = Transform.from_rpy((0.0, 0.0, 0.0), roll, same, yaw)
    assert again.matrix == pytest.approx(there.matrix, abs=1e-7)

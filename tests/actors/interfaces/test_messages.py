"""The messages of the common packages: defaults, checks, arrays, equality. One test for each row of the inventory."""

from __future__ import annotations

import array
import copy
import math
import pickle
import struct
import warnings
from enum import IntEnum, StrEnum
from typing import Any

import numpy as np
import pytest

from actors.interfaces import (
    Message,
    MessageTypeError,
    MessageValueError,
    decode,
    encode,
    flaws,
    from_plain,
    load,
    to_plain,
)
from actors.interfaces.builtin_interfaces.msg import Time
from actors.interfaces.geometry_msgs.msg import (
    Point,
    Pose,
    PoseStamped,
    PoseWithCovariance,
    Quaternion,
    Transform,
    Twist,
    Vector3,
)
from actors.interfaces.nav_msgs.msg import MapMetaData, OccupancyGrid, Odometry, Path
from actors.interfaces.rcl_interfaces.msg import ParameterValue
from actors.interfaces.sensor_msgs.msg import Image, Imu, JointState, LaserScan, PointCloud2, PointField
from actors.interfaces.std_msgs.msg import (
    Bool,
    Byte,
    Empty,
    Float32,
    Float32MultiArray,
    Float64,
    Header,
    Int32,
    Int32MultiArray,
    String,
    UInt8MultiArray,
)
from tests.facts import lacks


def anything(cls: Any) -> Any:
    """The class without its types, to give it what a type checker would refuse."""
    return cls


def test_a_stamp_has_whole_seconds_and_nanoseconds_within_their_ranges() -> None:
    stamp = Time(sec=12, nanosec=500_000_000)
    assert (stamp.sec, stamp.nanosec) == (12, 500_000_000)
    with pytest.raises(MessageValueError, match=r"Time\.nanosec: -1 is out of range for uint32 \(0\.\.4294967295\)"):
        Time(nanosec=-1)


def test_a_header_starts_at_zero_without_a_frame() -> None:
    assert Header() == Header(stamp=Time(sec=0, nanosec=0), frame_id="")


def test_a_string_survives_plain_data_and_reads_like_ros() -> None:
    message = String(data="x")
    assert from_plain(String, to_plain(message)) == message
    assert repr(message) == "std_msgs.msg.String(data='x')"


def test_a_number_out_of_range_is_refused_with_the_field_and_the_range() -> None:
    with pytest.raises(MessageValueError) as error:
        Int32(data=2**31)
    assert lacks(str(error.value), "Int32.data 2147483648 int32 -2147483648 2147483647") == []
    assert Int32(data=2**31 - 1).data == 2**31 - 1


def test_a_float32_holds_what_every_receiver_will_see() -> None:
    message = Float32(data=0.1)
    assert message.data == float(np.float32(0.1))
    assert math.isclose(message.data, 0.1, rel_tol=1e-6)
    assert decode(Float32, encode(message)) == message


def test_a_float32_takes_infinity_and_nan_but_no_number_beyond_its_range() -> None:
    assert Float32(data=math.inf).data == math.inf
    assert math.isnan(Float32(data=math.nan).data)
    with pytest.raises(MessageValueError, match=r"Float32\.data: 1e\+39 is out of range for float32"):
        Float32(data=1e39)


def test_a_float64_is_exact_and_takes_whole_numbers() -> None:
    assert Float64(data=0.1).data == 0.1
    widened = Float64(data=3).data
    assert (widened, type(widened)) == (3.0, float)


@pytest.mark.parametrize("value", [1, 0, "true", None, 1.0])
def test_only_a_bool_is_a_bool(value: object) -> None:
    with pytest.raises(MessageTypeError, match=r"Bool\.data: expected bool"):
        anything(Bool)(data=value)
    assert Bool(data=True).data is True


def test_a_bool_is_no_number() -> None:
    with pytest.raises(MessageTypeError, match=r"Int32\.data: expected int32, got bool True"):
        Int32(data=True)
    with pytest.raises(MessageTypeError, match=r"Float64\.data: expected float64"):
        Float64(data=True)


def test_an_empty_message_is_equal_to_any_other_and_has_no_fields() -> None:
    assert Empty() == Empty()
    assert Empty.__ros_fields__ == ()
    with pytest.raises(TypeError, match="Unexpected keyword argument 'data'"):
        anything(Empty)(data=1)


def test_vectors_start_at_zero_and_rotations_at_the_identity() -> None:
    assert Vector3() == Vector3(x=0.0, y=0.0, z=0.0)
    assert Quaternion() == Quaternion(x=0.0, y=0.0, z=0.0, w=1.0)
    assert Transform().rotation.w == 1.0


def test_a_point_is_built_by_keyword_and_only_by_keyword() -> None:
    point = Point(x=2.0, y=1.0, z=0.0)
    assert (point.x, point.y, point.z) == (2.0, 1.0, 0.0)
    with pytest.raises(TypeError):
        anything(Point)(2.0, 1.0, 0.0)


def test_two_poses_may_share_their_defaults_because_nobody_can_change_them() -> None:
    first, second = Pose(), Pose()
    with pytest.raises(AttributeError, match=r"Point\.x: a message never changes.*message\.replace\(x=\.\.\.\)"):
        anything(first.position).x = 1.0
    assert second.position.x == 0.0


def test_a_nested_field_is_changed_by_building_the_messages_around_it_anew() -> None:
    pose = PoseStamped()
    moved = pose.replace(pose=pose.pose.replace(position=pose.pose.position.replace(x=1.0)))
    assert (pose.pose.position.x, moved.pose.position.x) == (0.0, 1.0)
    with pytest.raises(MessageTypeError, match=r"Point has no field 'xx'\. Did you mean 'x'\?"):
        Point().replace(xx=1.0)
    with pytest.raises(MessageTypeError, match=r"Point\.x: expected float64"):
        Point().replace(x="far")


def test_a_partial_twist_from_plain_data_fills_the_rest_with_zeros() -> None:
    twist = from_plain(Twist, {"linear": {"x": 0.5}, "angular": {"z": 0.3}})
    assert twist == Twist(linear=Vector3(x=0.5), angular=Vector3(z=0.3))


def test_an_image_takes_bytes_and_arrays_and_says_when_its_step_is_wrong() -> None:
    pixels = np.zeros((480, 640, 3), np.uint8)
    image = Image(height=480, width=640, encoding="rgb8", step=1920, data=pixels)
    assert len(image.data) == 921_600
    assert image == image.replace(data=pixels.tobytes())
    assert image == image.replace(data=bytearray(pixels.tobytes()))
    assert flaws(image) == ()
    assert "step 0 times height 480" in flaws(image.replace(step=0))[0]


def test_bytes_are_kept_without_a_copy() -> None:
    data = bytes(1000)
    assert np.shares_memory(Image(data=data).data, np.frombuffer(data, np.uint8))


def test_a_point_cloud_gives_its_points_back() -> None:
    points = np.arange(300, dtype=np.float32).reshape(100, 3)
    fields = [PointField(name=name, offset=4 * i, datatype=PointField.FLOAT32, count=1) for i, name in enumerate("xyz")]
    cloud = PointCloud2(height=1, width=100, fields=fields, point_step=12, row_step=1200, data=points.tobytes())
    assert len(cloud.data) == 1200
    assert np.array_equal(cloud.data.view(np.float32).reshape(100, 3), points)
    assert flaws(cloud) == ()
    assert flaws(cloud.replace(width=99))


def test_a_scan_whose_angles_and_ranges_disagree_is_flagged() -> None:
    scan = LaserScan(angle_min=-1.0, angle_max=1.0, angle_increment=0.01, ranges=[1.0] * 201)
    assert flaws(scan) == ()
    (flaw,) = flaws(scan.replace(ranges=[1.0] * 100))
    assert lacks(flaw, "LaserScan angles 201 100 ranges") == []


def test_a_covariance_has_exactly_nine_entries() -> None:
    imu = Imu()
    assert imu.orientation_covariance.tolist() == [0.0] * 9
    message = r"Imu\.orientation_covariance: float64\[9\] holds exactly 9 elements, got 8"
    with pytest.raises(MessageValueError, match=message):
        Imu(orientation_covariance=[0.0] * 8)


def test_joint_states_of_unequal_lengths_are_flagged_and_empty_ones_are_not() -> None:
    state = JointState(name=["a", "b"], position=[1.0, 2.0])
    assert flaws(state) == ()
    (flaw,) = flaws(state.replace(velocity=[1.0]))
    assert lacks(flaw, "JointState velocity 1 2 names") == []


def test_a_path_grows_by_replacing_it() -> None:
    empty = Path()
    longer = empty.replace(poses=[*empty.poses, PoseStamped()])
    assert (empty.poses, longer.poses) == ((), (PoseStamped(),))


def test_the_covariances_of_odometry_are_six_by_six() -> None:
    odometry = Odometry()
    assert len(odometry.pose.covariance) == len(odometry.twist.covariance) == 36


def test_the_cells_of_a_grid_lie_row_by_row() -> None:
    grid = OccupancyGrid(info=MapMetaData(width=3, height=2, resolution=0.05), data=[0, 100, -1, 50, 0, 0])
    assert (grid.data[1], grid.data[grid.info.width]) == (100, 50)
    assert flaws(grid) == ()
    (flaw,) = flaws(grid.replace(data=[101] * 6))
    assert lacks(flaw, "OccupancyGrid -1 0 100") == []
    assert "3 x 2 cells, but 1 values" in flaws(grid.replace(data=[0]))[0]


def test_a_value_of_the_wrong_type_is_refused_where_the_message_is_built() -> None:
    with pytest.raises(MessageTypeError, match=r"String\.data: expected string \(str\), got int 3"):
        anything(String)(data=3)
    with pytest.raises(
        MessageTypeError, match=r"Twist\.linear: expected geometry_msgs/msg/Vector3, got std_msgs/msg/Float32"
    ):
        anything(Twist)(linear=Float32())


def test_a_message_is_a_snapshot_of_the_arrays_it_was_built_from() -> None:
    values = np.zeros(3)
    state = JointState(name=["a", "b", "c"], position=values)
    values[0] = 1.0
    assert state.position[0] == 0.0
    with pytest.raises(ValueError, match="read-only"):
        state.position[0] = 1.0
    with pytest.raises(AttributeError, match=r"JointState\.name: a message never changes"):
        anything(state).name = ()


def test_a_view_is_copied_unless_nobody_can_write_through_it() -> None:
    values = np.arange(6.0)
    view = values[:3]
    view.setflags(write=False)
    assert not np.shares_memory(JointState(position=view).position, values)
    values.setflags(write=False)
    assert np.shares_memory(JointState(position=values[:3]).position, values)
    memory = bytearray(24)
    borrowed = np.frombuffer(memory, np.float64)
    borrowed.setflags(write=False)
    assert not np.shares_memory(JointState(position=borrowed).position, borrowed)
    assert JointState(position=np.arange(6.0)[::2]).position.flags.c_contiguous


READ_ONLY_OWNER = np.arange(6.0)
READ_ONLY_OWNER.setflags(write=False)
SOURCES: dict[str, Any] = {
    "a list": [0.0, 1.0],
    "nothing": [],
    "a writeable array": np.arange(6.0),
    "a part of one": np.arange(6.0)[::2],
    "another dtype": np.arange(6, dtype=np.int16),
    "the other byte order": np.arange(6.0).astype(">f8"),
    "a large array": np.zeros(200_000),
    "a read-only array": READ_ONLY_OWNER,
    "a read-only array's view": READ_ONLY_OWNER[2:],
    "a read-only array's every other": READ_ONLY_OWNER[::2],
    "a part of a view of bytes": np.frombuffer(bytes(48))[2:],
    "another message": JointState(position=[1.0, 2.0]).position,
}


@pytest.mark.parametrize("source", SOURCES)
def test_an_array_of_a_message_cannot_be_resized_or_made_writeable(source: str) -> None:
    given = SOURCES[source]
    state = JointState(position=given)
    assert np.array_equal(state.position, np.asarray(given, np.float64))
    assert state.position.flags.c_contiguous and state.position.flags.aligned
    with pytest.raises(ValueError, match="WRITEABLE"):
        state.position.flags.writeable = True
    with pytest.raises(ValueError, match="WRITEABLE"):
        state.position.setflags(write=True)
    with pytest.raises(ValueError, match="cannot resize this array"):
        state.position.resize(10, refcheck=False)
    assert JointState(position=state.position).position is state.position


def test_arrays_from_the_wire_and_defaults_are_kept_the_same_way() -> None:
    kind = load("float64[] v\nbool[] b\n", "odd_msgs/msg/Odd")
    swapped = decode(kind, bytes(4) + struct.pack(">I4x2dI2?", 2, 1.0, 2.0, 2, True, False))
    assert (swapped.v.tolist(), swapped.b.tolist()) == ([1.0, 2.0], [True, False])
    empty = decode(kind, encode(kind()))
    covariances = [imu.orientation_covariance for imu in (Imu(), decode(Imu, encode(Imu())))]
    for kept in (*covariances, swapped.v, swapped.b, empty.v):
        with pytest.raises(ValueError, match="WRITEABLE"):
            kept.flags.writeable = True
        with pytest.raises(ValueError, match="cannot resize this array"):
            kept.resize(10, refcheck=False)


def test_the_owner_of_a_read_only_array_keeps_its_own_shape() -> None:
    owned = np.arange(6, dtype=np.uint8)
    owned.setflags(write=False)
    image = Image(height=2, width=3, step=3, data=owned)
    assert np.shares_memory(image.data, owned)
    with warnings.catch_warnings():  # newer versions of numpy warn
        warnings.simplefilter("ignore", DeprecationWarning)
        image.data.shape = (2, 3)  # what nobody should do, and numpy cannot refuse
    assert owned.shape == (6,)
    rows = Image(height=2, width=3, step=3, data=owned).data.reshape(2, 3)
    assert rows[1].tolist() == [3, 4, 5]


def test_numeric_arrays_take_what_fits_without_loss() -> None:
    expected = [1, 2, 3]
    for given in ([1, 2, 3], (1, 2, 3), range(1, 4), np.array([1, 2, 3], np.uint8), array.array("h", [1, 2, 3])):
        message = Int32MultiArray(data=anything(given))
        assert message.data.dtype == np.int32
        assert message.data.tolist() == expected
    assert anything(Float32MultiArray)(data=[1, np.int16(2), np.float64(2.5)]).data.tolist() == [1.0, 2.0, 2.5]
    assert Int32MultiArray(data=anything(np.array([1, 2], object))).data.tolist() == [1, 2]
    assert Int32MultiArray(data=np.array([1, 2], ">i4")).data.tolist() == [1, 2]
    assert UInt8MultiArray(data=memoryview(b"ab")).data.tolist() == [97, 98]
    assert ParameterValue(bool_array_value=[True, False]).bool_array_value.dtype == np.bool_


@pytest.mark.parametrize(
    ("given", "text"),
    [
        ([1, 2.5], r"\[1\]: expected int32, got float 2\.5"),
        ([True], r"\[0\]: expected int32, got bool True"),
        ([[1, 2]], r"\[0\]: expected int32, got list"),
        ("123", r"expected int32\[\].*got str '123'"),
        (b"123", r"expected int32\[\].*got bytes"),
        (7, r"expected int32\[\].*got int 7"),
        (np.array([1.0]), r"an array of float64 does not fit int32\[\] without loss"),
        (np.array([True]), r"an array of bool does not fit"),
        (np.zeros((2, 2), np.int32), r"one-dimensional, got an array of shape \(2, 2\); use \.ravel\(\)"),
    ],
)
def test_numeric_arrays_refuse_what_is_of_another_sort(given: object, text: str) -> None:
    with pytest.raises(MessageTypeError, match=r"Int32MultiArray\.data.*" + text):
        anything(Int32MultiArray)(data=given)


@pytest.mark.parametrize("given", [[0, 2**31], np.array([0, 2**31]), np.array([0, 2**31], np.uint64)])
def test_numeric_arrays_refuse_numbers_out_of_range_and_name_the_element(given: object) -> None:
    with pytest.raises(MessageValueError, match=r"Int32MultiArray\.data\[1\]: 2147483648 is out of range for int32"):
        anything(Int32MultiArray)(data=given)


def test_float_arrays_refuse_what_would_become_infinite() -> None:
    with pytest.raises(MessageValueError, match=r"Float32MultiArray\.data\[1\]: 1e\+39 is out of range for float32"):
        Float32MultiArray(data=[0.0, 1e39])
    with pytest.raises(MessageValueError, match="too large for float64"):
        JointState(position=[10**400])
    assert Float32MultiArray(data=[math.inf]).data[0] == math.inf


def test_sequences_of_messages_and_strings_are_tuples_and_name_a_wrong_element() -> None:
    assert Path(poses=(PoseStamped() for _ in range(2))).poses == (PoseStamped(), PoseStamped())
    with pytest.raises(MessageTypeError, match=r"Path\.poses\[1\]: expected geometry_msgs/msg/PoseStamped, got int 3"):
        anything(Path)(poses=[PoseStamped(), 3])
    with pytest.raises(
        MessageTypeError, match=r"JointState\.name: expected string\[\] \(a list, tuple or other iterable\), got str"
    ):
        JointState(name="arm")
    with pytest.raises(MessageTypeError, match=r"JointState\.name\[0\]: expected string"):
        anything(JointState)(name=[b"arm"])


class Mode(IntEnum):
    FAST = 3


class Word(StrEnum):
    HELLO = "hello"


def test_numpy_scalars_and_enumerations_become_plain_values() -> None:
    assert type(Int32(data=int(np.int64(7))).data) is int
    for message, kind in [
        (anything(Int32)(data=np.int16(7)), int),
        (Int32(data=Mode.FAST), int),
        (anything(Float64)(data=np.float32(0.5)), float),
        (anything(Float64)(data=np.int8(1)), float),
        (anything(Bool)(data=np.True_), bool),
        (String(data=Word.HELLO), str),
        (String(data=np.str_("hello")), str),
    ]:
        assert type(message.data) is kind
    with pytest.raises(MessageTypeError, match=r"Int32\.data: expected int32, got float64"):
        anything(Int32)(data=np.float64(1.0))


def test_a_byte_is_a_number_and_may_be_given_as_one_byte() -> None:
    assert Byte(data=7) == anything(Byte)(data=b"\x07")
    with pytest.raises(MessageTypeError, match=r"Byte\.data: expected byte"):
        anything(Byte)(data=b"ab")


def test_messages_are_equal_element_by_element() -> None:
    state = JointState(name=["a"], position=[1.0])
    assert state == JointState(name=["a"], position=np.array([1.0]))
    assert state != JointState(name=["a"], position=[2.0])
    assert state != JointState(name=["a"], position=[1.0, 1.0])
    assert state != JointState(name=["b"], position=[1.0])
    assert state != anything("state")
    assert (state == anything("state"), state == state.replace(), state == state) == (False, True, True)
    assert Twist() != anything("twist")
    assert anything(Vector3()) != Point()
    assert JointState(position=[math.nan]) != JointState(position=[math.nan])


def test_a_message_without_arrays_is_a_key_and_one_with_arrays_says_why_it_is_not() -> None:
    assert {Twist(): 1}[Twist()] == 1
    with pytest.raises(TypeError, match="Imu cannot be hashed: its field orientation_covariance is an array"):
        hash(Imu())
    with pytest.raises(TypeError, match="PoseWithCovariance cannot be hashed: its field covariance is an array"):
        hash(Odometry())
    assert PoseWithCovariance() == PoseWithCovariance()


@pytest.mark.parametrize("message", [Twist(linear=Vector3(x=1.0)), Imu(), Path(poses=[PoseStamped()]), Empty()])
def test_messages_can_be_copied_and_pickled(message: Message) -> None:
    for other in (copy.copy(message), copy.deepcopy(message), pickle.loads(pickle.dumps(message))):
        assert other == message
        assert type(other) is type(message)


def test_a_pickled_message_still_cannot_be_changed() -> None:
    imu = pickle.loads(pickle.dumps(Imu()))
    assert not imu.orientation_covariance.flags.writeable


def test_the_repr_shows_short_arrays_whole_and_long_ones_by_their_ends() -> None:
    assert repr(Path(poses=[])) == (
        "nav_msgs.msg.Path(header=std_msgs.msg.Header(stamp=builtin_interfaces.msg.Time(sec=0, nanosec=0), "
        "frame_id=''), poses=[])"
    )
    assert "data=array([1, 2], dtype=int32)" in repr(Int32MultiArray(data=[1, 2]))
    assert "array([0, 1, 2, ..., 97, 98, 99], dtype=uint8, size=100)" in repr(UInt8MultiArray(data=range(100)))


def test_float_arrays_take_arrays_of_whole_numbers_and_of_narrower_floats() -> None:
    state = anything(JointState)(position=np.array([1, 2], np.int16), velocity=np.array([0.5], np.float32))
    assert (state.position.dtype, state.position.tolist()) == (np.float64, [1.0, 2.0])
    assert (state.velocity.dtype, state.velocity.tolist()) == (np.float64, [0.5])
    assert anything(Int32MultiArray)(data=np.array([], np.int64)).data.tolist() == []


def test_scans_without_angles_and_clouds_with_missing_rows_are_looked_at_too() -> None:
    assert flaws(LaserScan(ranges=[1.0, 2.0])) == ()
    (flaw,) = flaws(LaserScan(ranges=[1.0, 2.0], intensities=[1.0]))
    assert lacks(flaw, "LaserScan 1 intensities 2 ranges") == []
    cloud = PointCloud2(width=2, height=2, point_step=4, row_step=8, data=bytes(16))
    assert flaws(cloud) == ()
    (flaw,) = flaws(cloud.replace(data=bytes(12)))
    assert lacks(flaw, "PointCloud2 row_step 8 height 2 12 data") == []

"""Transforms and message filters: every class of `actors.tf2` and `actors.message_filters`."""

from math import pi

from actors import Child, Node, Supervisor, Topic, background, every
from actors.interfaces.builtin_interfaces.msg import Time
from actors.interfaces.geometry_msgs.msg import Point, PointStamped
from actors.interfaces.sensor_msgs.msg import Imu, JointState, LaserScan
from actors.interfaces.std_msgs.msg import Header
from actors.interfaces.tf2_msgs.srv import FrameGraph
from actors.message_filters import (
    ApproximateTime, ApproximateTimeSynchronizer, Cache, Chain, Connection, DeltaFilter, FilterStream, InputAligner, PassThrough,
    QueueStatus, SimpleFilter, Stamp, Subscriber, Synchronizer, TimeSequencer, TimeSynchronizer,
)
from actors.nodes import JOINT_STATES, ROBOT_DESCRIPTION, BufferServer, RobotStatePublisher, StaticTransformPublisher
from actors.testing import Rig
from actors.tf2 import (
    FRAMES, LOOKUP, TF, TF_STATIC, BackwardExtrapolationException, Buffer, BufferClient, ConnectivityException, DescriptionError,
    ExtrapolationException, FilterFailureReason, ForwardExtrapolationException, Frame, Instant, InvalidArgumentException, Joint,
    JointKind, LookupException, MessageFilter, Mimic, NoDataForExtrapolationException, Quad, StaticTransformBroadcaster,
    TimeoutException, Transform, TransformBroadcaster, TransformException, TransformListener, Triple, do_transform, joints_of, stamped,
)

# -- tell and ask

class Turntable(Node):
    """Turns once in 2 s; a lamp is mounted on it, 0.3 m from its axis."""

    async def on_start(self) -> None:
        self.tf = TransformBroadcaster(self)
        mounted = Transform((0.3, 0.0, 0.0))
        StaticTransformBroadcaster(self).send_transform(stamped("table", "lamp", mounted, self.clock.stamp()))

    @every(hz=20)
    def turn(self) -> None:
        turned = Transform.planar(0.0, 0.0, pi * self.clock.now())
        self.tf.send_transform(stamped("world", "table", turned, self.clock.stamp()))


class Watcher(Node):
    async def on_start(self) -> None:
        self.tf_buffer = Buffer()
        self.tf_listener = TransformListener(self.tf_buffer, self)
        self.seen: Point | None = None

    @background
    async def watch(self) -> None:
        await self.clock.sleep(0.5)
        spot = PointStamped(header=Header(frame_id="lamp", stamp=self.clock.stamp()), point=Point(x=0.1))
        there = await self.tf_buffer.transform_async(spot, "world", timeout=1.0)
        self.seen = there.point


async def test_the_lamp_is_seen_where_it_is(rig: Rig) -> None:
    await rig.start(Supervisor("room", Watcher, Turntable))
    await rig.advance(1.0)
    seen = rig.node(Watcher).seen
    assert seen is not None and abs(seen.x) < 1e-9 and abs(seen.y - 0.4) < 1e-9

buffer = Buffer()
for second in (5, 6):
    buffer.set_transform(stamped("map", "odom", Transform(), Time(sec=second)))
buffer.set_transform_static(stamped("base", "camera", Transform(), Time()))
for target, source, time in (("map", "camra", None), ("map", "camera", None), ("map", "odom", Time(sec=7))):
    try:
        buffer.lookup_transform(target, source, time)
    except TransformException as error:
        print(f"{type(error).__name__}: {error}")

def error_of(target: str, source: str, time: Instant = None) -> TransformException:
    try:
        buffer.lookup_transform(target, source, time)
    except TransformException as error:
        return error
    raise AssertionError("it is known")


buffer.set_transform(stamped("odom", "wheel", Transform(), Time(sec=5)))
assert isinstance(error_of("map", "camra"), LookupException)
assert isinstance(error_of("map", "/odom"), InvalidArgumentException)  # names begin with no slash
assert isinstance(error_of("map", "camera"), ConnectivityException)
for sec, source, kind, past in (
    (4, "odom", BackwardExtrapolationException, True),
    (7, "odom", ForwardExtrapolationException, False),
    (6, "wheel", NoDataForExtrapolationException, False),
):
    error = error_of("map", source, Time(sec=sec))
    assert isinstance(error, kind) and isinstance(error, ExtrapolationException) and error.past is past
assert issubclass(TimeoutException, TransformException)  # of a buffer server that does not answer

known: Frame = buffer.frames()["odom"]
assert (known.parent, known.static, known.oldest, known.newest, known.rate) == ("map", False, 5.0, 6.0, 2.0)

place: Triple = (1.0, 0.0, 0.0)
quarter: Quad = (0.5**0.5, 0.0, 0.0, 0.5**0.5)  # w first
mounted = stamped("base", "arm", Transform(place, quarter), Time(sec=1))
tip = do_transform(PointStamped(header=Header(frame_id="arm"), point=Point(x=2.0)), mounted)
assert tip.header.frame_id == "base" and abs(tip.point.x - 1.0) < 1e-9 and abs(tip.point.y - 2.0) < 1e-9

# -- let another node keep the transforms

class Mount(Node):
    async def on_start(self) -> None:
        at = stamped("base", "camera", Transform((0.2, 0.0, 0.5)), self.clock.stamp())
        StaticTransformBroadcaster(self).send_transform(at)


async def test_somebody_asks_the_server(rig: Rig) -> None:
    await rig.start(Supervisor("robot", BufferServer, Mount))
    there = await BufferClient(rig.me).lookup_transform_async("base", "camera", timeout=1.0)
    assert there.transform.translation.z == 0.5

MOUNTED = StaticTransformPublisher.arguments_as_parameters("--x 0.2 --z 0.5 --frame-id base --child-frame-id camera".split())


async def test_a_mount_is_told_once_and_drawn(rig: Rig) -> None:
    camera = Child(StaticTransformPublisher, name="camera_mount", parameters=MOUNTED)
    await rig.start(Supervisor("robot", BufferServer, camera))
    late = rig.probe(TF_STATIC)  # latched: it does not matter when one comes
    await rig.me.wait_for(LOOKUP, timeout=1.0)
    assert late.newest.transforms[0].child_frame_id == "camera"
    graph = await rig.call(FRAMES, FrameGraph.Request())
    assert graph.frame_yaml.startswith("'camera':\n  parent: 'base'\n")

# -- tell the frames of a robot from its URDF

ARM = """
<robot name="arm"><link name="base"/><link name="arm"/>
  <joint name="shoulder" type="revolute"><parent link="base"/><child link="arm"/><axis xyz="0 0 1"/></joint>
</robot>
"""


async def test_the_arm_is_where_its_joint_says(rig: Rig) -> None:
    await rig.start(Child(RobotStatePublisher, parameters={"robot_description": ARM}))
    frames = rig.probe(TF)
    rig.publish(JOINT_STATES, JointState(name=["shoulder"], position=[3.141592653589793]))
    await rig.settled()
    (arm,) = frames.newest.transforms
    assert (arm.header.frame_id, arm.child_frame_id, round(arm.transform.rotation.z, 9)) == ("base", "arm", 1.0)

GRIPPER = ARM.replace(
    "</robot>",
    """<link name="finger"/><joint name="grip" type="prismatic"><parent link="arm"/><child link="finger"/><axis xyz="0 1 0"/>
    <mimic joint="shoulder" multiplier="0.01" offset="0.02"/></joint></robot>""",
)


async def test_the_joints_are_in_the_description(rig: Rig) -> None:
    await rig.start(Child(RobotStatePublisher, parameters={"robot_description": GRIPPER}))
    described = rig.probe(ROBOT_DESCRIPTION)
    joints: tuple[Joint, ...] = joints_of(described.newest.data)
    kinds: dict[str, JointKind] = {joint.name: joint.kind for joint in joints}
    assert kinds == {"shoulder": "revolute", "grip": "prismatic"}
    follows: Mimic | None = joints[1].mimic
    assert follows == Mimic("shoulder", 0.01, 0.02)
    assert joints[1].at(0.03).translation == (0.0, 0.03, 0.0)


try:
    joints_of("<robot xmlns:xacro='http://www.ros.org/wiki/xacro' name='arm'><xacro:leg side='left'/></robot>")
except DescriptionError as error:
    print(error)

# -- message filters

SCAN, IMU = Topic(LaserScan, "scan"), Topic(Imu, "imu")


class Sensors(Node):
    async def on_start(self) -> None:
        self.scan, self.imu = self.publisher(SCAN), self.publisher(IMU)

    @every(hz=10)
    def scans(self) -> None:
        self.scan(LaserScan(header=Header(stamp=self.clock.stamp())))

    @every(hz=200)
    def turns(self) -> None:
        self.imu(Imu(header=Header(stamp=self.clock.stamp())))


class Deskew(Node):
    async def on_start(self) -> None:
        inputs = [Subscriber(self, SCAN), Subscriber(self, IMU)]
        self.pairs = ApproximateTimeSynchronizer(inputs, queue_size=20, slop=0.003)
        self.count = 0

    @background
    async def pair(self) -> None:
        async for scan, imu in self.pairs:
            self.count += scan.header.stamp == imu.header.stamp


async def test_every_scan_has_its_imu_sample(rig: Rig) -> None:
    await rig.start(Supervisor("robot", Deskew, Sensors))
    await rig.advance(1.05)
    assert rig.node(Deskew).count == 10

def at(sec: int, frame: str = "lidar") -> LaserScan:
    return LaserScan(header=Header(stamp=Time(sec=sec), frame_id=frame))


changed, last = DeltaFilter[LaserScan](["header.frame_id"]), Cache[LaserScan](cache_size=2)
chain = Chain(changed, last)
through: list[LaserScan] = []
connection: Connection = chain.register_callback(through.append)
for scan in (at(1), at(2), at(3, "front"), at(4)):
    chain.add(scan)
assert [one.header.stamp.sec for one in through] == [1, 3, 4]
since: Stamp = Time(sec=2)
assert last.get_interval(since, Time(sec=9)) == [at(3, "front"), at(4)]
connection.disconnect()

left, right = PassThrough[LaserScan](), PassThrough[LaserScan]()


def pairs_of(sync: Synchronizer) -> list[tuple[int, int]]:
    """The stamps of the pairs that it makes from now on."""
    pairs: list[tuple[int, int]] = []
    sync.register_callback(lambda a, b: pairs.append((a.header.stamp.sec, b.header.stamp.sec)))
    return pairs


exact, near = pairs_of(TimeSynchronizer([left, right], 5)), pairs_of(ApproximateTime([left, right], 5))
for one, other in ((10, 10), (20, 21), (30, 30)):
    left.add(at(one))
    right.add(at(other))
assert exact == [(10, 10), (30, 30)] and near == [(10, 10), (20, 21), (30, 30)]

class Near(PassThrough[LaserScan]):
    """Lets scans through that see something within a metre."""

    def add(self, message: LaserScan) -> None:
        if message.ranges.size and message.ranges.min() < 1.0:
            self.signal_message(message)


async def test_a_slow_reader_is_told_what_it_missed(rig: Rig) -> None:
    source = SimpleFilter[LaserScan]()
    stream: FilterStream[LaserScan] = Near(source).stream(depth=1)
    for metres in (0.5, 2.0, 0.7):
        source.signal_message(LaserScan(ranges=[metres]))
    stream.close()
    assert [round(float(scan.ranges[0]), 3) async for scan in stream] == [0.7] and stream.dropped == 1

async def test_messages_come_out_in_the_order_of_their_stamps(rig: Rig) -> None:
    await rig.start(Deskew)
    ordered = TimeSequencer[LaserScan](rig.me, delay=0.5)
    seen: list[LaserScan] = []
    ordered.register_callback(seen.append)
    second, first = (LaserScan(header=Header(stamp=Time(nanosec=10**6 * ms))) for ms in (20, 10))
    ordered.add(second)
    ordered.add(first)
    await rig.advance(1.0)
    assert seen == [first, second] and ordered.dropped == 0

    aligner = InputAligner([left, right], timeout=5.0)
    aligned: list[int] = []
    for output in aligner.outputs:
        output.register_callback(lambda scan: aligned.append(scan.header.stamp.sec))
    left.add(at(42))
    right.add(at(41))
    aligner.dispatch_messages()
    status: QueueStatus = aligner.get_queue_status(0)
    assert aligned == [41] and (status.active, status.queue_size) == (True, 1)  # 42 waits for what right may send


async def test_a_scan_waits_for_its_transform(rig: Rig) -> None:
    buffer, seen, lost = Buffer(), list[LaserScan](), list[FilterFailureReason]()
    scans = MessageFilter[LaserScan](buffer, "map")
    scans.register_callback(seen.append)
    scans.register_failure_callback(lambda scan, reason: lost.append(reason))
    scans.add(at(5))
    scans.add(at(5, frame=""))
    assert seen == [] and lost == [FilterFailureReason.EMPTY_FRAME_ID]
    for sec in (4, 6):
        buffer.set_transform(stamped("map", "lidar", Transform(), Time(sec=sec)))
    assert seen == [at(5)]

"""A graph with one of everything, for commands to look at."""

from __future__ import annotations

from actors import (
    Aborted,
    Action,
    Done,
    LifecycleNode,
    Node,
    QoS,
    Reject,
    Service,
    Steps,
    Topic,
    every,
    parameter,
    publishes,
    qos,
    subscribes,
)
from actors.interfaces.example_interfaces.action import Fibonacci, Fibonacci_Feedback, Fibonacci_Goal, Fibonacci_Result
from actors.interfaces.example_interfaces.srv import AddTwoInts, AddTwoInts_Request, AddTwoInts_Response
from actors.interfaces.geometry_msgs.msg import PoseStamped, Twist
from actors.interfaces.sensor_msgs.msg import JointState
from actors.interfaces.std_msgs.msg import Header, String

CHATTER = Topic(String, "chatter", 10)
LATCHED = Topic(String, "robot/description", qos.LATCHED)
VELOCITY = Topic(Twist, "cmd_vel", 10)
RELIABLE_ONLY = Topic(String, "reliable_only", QoS(depth=10))
JOINTS = Topic(JointState, "joints", qos.SENSOR_DATA)
POSE = Topic(PoseStamped, "pose", 10)
ADD = Service(AddTwoInts, "add_two_ints")
COUNT = Action(Fibonacci, "count")


class Talker(Node):
    """Talks at 20 Hz; its joints are best effort."""

    chatter = publishes(CHATTER)
    description = publishes(LATCHED)
    joints = publishes(JOINTS)

    async def on_start(self) -> None:
        self.description.publish(String(data="four legs"))

    @every(hz=20)
    def talk(self) -> None:
        self.chatter.publish(String(data="hello"))
        stamp = self.clock.stamp()
        self.joints.publish(JointState(header=Header(stamp=stamp), name=["hip", "knee"], position=[0.25, 1.0]))


class Base(Node):
    """Remembers what it is told."""

    velocities = subscribes(VELOCITY)


class Listener(Node):
    async def on_start(self) -> None:
        self.heard: list[Twist] = []
        self.poses: list[PoseStamped] = []

    @VELOCITY.on()
    def hear(self, message: Twist) -> None:
        self.heard.append(message)

    @POSE.on()
    def see(self, message: PoseStamped) -> None:
        self.poses.append(message)


class Adder(Node):
    @ADD.serve()
    async def add(self, request: AddTwoInts_Request) -> AddTwoInts_Response:
        if request.a < 0:
            raise ValueError("only what is positive is added")
        return AddTwoInts.Response(sum=request.a + request.b)


class Counter(Node):
    """Counts at 20 Hz; rejects what is negative, aborts after 7."""

    async def on_start(self) -> None:
        self.canceled = 0

    @COUNT.accepts
    def check(self, goal: Fibonacci_Goal) -> None:
        if goal.order < 0:
            raise Reject("order is negative")

    @COUNT.serve(arrivals="parallel")
    async def count(self, goal: Fibonacci_Goal) -> Steps[Fibonacci_Feedback, Fibonacci_Result]:
        numbers = [0, 1]
        try:
            for _ in range(goal.order - 1):
                await self.clock.sleep(0.05)
                numbers.append(numbers[-1] + numbers[-2])
                yield Fibonacci.Feedback(sequence=numbers)
                if len(numbers) == 7:
                    yield Aborted(Fibonacci.Result(sequence=numbers), "that is enough")
                    return
        except BaseException:
            self.canceled += 1
            raise
        yield Done(Fibonacci.Result(sequence=numbers))


class Motor(Node):
    speed = parameter(0.5, ge=0.0, le=2.0, unit="m/s", description="How fast.")
    gains = parameter([1.0, 0.1])
    mode = parameter("walk")
    legs = parameter(4, read_only=True)
    allow_undeclared_parameters = True


class Camera(LifecycleNode):
    pass

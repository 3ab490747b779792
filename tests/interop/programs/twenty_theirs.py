"""Twenty small programs as one writes them for `rclpy`. What they are here is in docs/howto/port-from-rclpy.md; the site shows both side by side.

`python -m tests.interop.ros2 'twenty programs'` runs them with an installed ROS 2.
"""

import threading
import time

import rclpy
from example_interfaces.action import Fibonacci
from example_interfaces.srv import AddTwoInts
from rcl_interfaces.msg import SetParametersResult
from rclpy.action import ActionClient, ActionServer, CancelResponse, GoalResponse
from rclpy.callback_groups import MutuallyExclusiveCallbackGroup, ReentrantCallbackGroup
from rclpy.executors import ExternalShutdownException, MultiThreadedExecutor, SingleThreadedExecutor
from rclpy.lifecycle import LifecycleNode, TransitionCallbackReturn
from rclpy.node import Node
from rclpy.qos import DurabilityPolicy, QoSProfile, qos_profile_sensor_data
from sensor_msgs.msg import LaserScan
from std_msgs.msg import Float64, String

# -- 1. Publisher


class Talker(Node):
    def __init__(self):
        super().__init__("talker")
        self.pub = self.create_publisher(String, "chatter", 10)
        self.count = 0
        self.timer = self.create_timer(0.5, self.talk)

    def talk(self):
        self.pub.publish(String(data=f"Hello {self.count}"))
        self.count += 1


# -- 2. Subscriber


class Listener(Node):
    def __init__(self):
        super().__init__("listener")
        self.heard = []
        self.create_subscription(String, "chatter", self.hear, 10)

    def hear(self, message):
        self.heard.append(message.data)
        self.get_logger().info(f"I heard {message.data}")


# -- 3. Timer


class Watchdog(Node):
    def __init__(self):
        super().__init__("watchdog")
        self.alarms = 0
        self.timer = self.create_timer(1.0, self.bark)
        self.create_subscription(String, "chatter", lambda _: self.timer.reset(), 10)

    def bark(self):
        self.alarms += 1
        self.timer.cancel()


# -- 4. Service


class Adder(Node):
    def __init__(self):
        super().__init__("adder")
        self.create_service(AddTwoInts, "add_two_ints", self.add)

    def add(self, request, response):
        response.sum = request.a + request.b
        return response


# -- 5. Client that waits


def ask_and_wait(node, a, b):
    client = node.create_client(AddTwoInts, "add_two_ints")
    client.wait_for_service()
    future = client.call_async(AddTwoInts.Request(a=a, b=b))
    rclpy.spin_until_future_complete(node, future)  # not in a callback!
    return future.result().sum


# -- 6. Client in a callback


class Doubler(Node):
    def __init__(self):
        super().__init__("doubler")
        self.sums = []
        self.client = self.create_client(AddTwoInts, "add_two_ints")
        self.create_subscription(Float64, "numbers", self.double, 10)

    def double(self, number):
        value = int(number.data)
        future = self.client.call_async(AddTwoInts.Request(a=value, b=value))
        future.add_done_callback(lambda done: self.sums.append(done.result().sum))


# -- 7. Action server, the newest goal first


class Counter(Node):
    def __init__(self):
        super().__init__("counter")
        self.current, self.lock = None, threading.Lock()
        ActionServer(
            self,
            Fibonacci,
            "fibonacci",
            self.execute,
            handle_accepted_callback=self.accepted,
            goal_callback=lambda goal: GoalResponse.ACCEPT if goal.order < 50 else GoalResponse.REJECT,
            cancel_callback=lambda goal: CancelResponse.ACCEPT,
            callback_group=ReentrantCallbackGroup(),
        )

    def accepted(self, goal):
        with self.lock:
            if self.current is not None and self.current.is_active:
                self.current.abort()
            self.current = goal
        goal.execute()

    def execute(self, goal):
        feedback = Fibonacci.Feedback(sequence=[0, 1])
        while len(feedback.sequence) <= goal.request.order:
            if not goal.is_active:
                return Fibonacci.Result()
            if goal.is_cancel_requested:
                goal.canceled()
                return Fibonacci.Result(sequence=feedback.sequence)
            feedback.sequence = [*feedback.sequence, feedback.sequence[-1] + feedback.sequence[-2]]
            goal.publish_feedback(feedback)
            time.sleep(0.1)
        goal.succeed()
        return Fibonacci.Result(sequence=feedback.sequence)


# -- 8. Action client


class Customer(Node):
    def __init__(self):
        super().__init__("customer")
        self.seen, self.result = [], None
        self.client = ActionClient(self, Fibonacci, "fibonacci")

    def order(self, order):
        self.client.wait_for_server()
        future = self.client.send_goal_async(
            Fibonacci.Goal(order=order), feedback_callback=lambda f: self.seen.append(f.feedback.sequence[-1])
        )
        future.add_done_callback(self.answered)

    def answered(self, future):
        goal = future.result()
        if goal.accepted:
            goal.get_result_async().add_done_callback(self.finished)

    def finished(self, future):
        self.result = list(future.result().result.sequence)


# -- 9. Parameters with a callback


class Driver(Node):
    def __init__(self):
        super().__init__("driver")
        self.speed = self.declare_parameter("speed", 0.5).value
        self.add_on_set_parameters_callback(self.check)

    def check(self, parameters):
        for one in parameters:
            if one.name == "speed":
                if not 0.0 <= one.value <= 2.0:
                    return SetParametersResult(successful=False, reason="out of range")
                self.speed = one.value  # although a later one may still be refused
        return SetParametersResult(successful=True)


# -- 10. Lifecycle node


class Camera(LifecycleNode):
    def on_configure(self, state):
        self.frames = self.create_lifecycle_publisher(Float64, "frames", 10)
        return TransitionCallbackReturn.SUCCESS

    def on_activate(self, state):
        self.timer = self.create_timer(0.1, lambda: self.frames.publish(Float64(data=1.0)))
        return super().on_activate(state)

    def on_deactivate(self, state):
        self.destroy_timer(self.timer)
        return super().on_deactivate(state)


# -- 11. Quality of service


class Scanner(Node):
    def __init__(self):
        super().__init__("scanner")
        self.scans = 0
        self.create_subscription(LaserScan, "scan", self.scan, qos_profile_sensor_data)

    def scan(self, message):
        self.scans += 1


# -- 12. Latched topic


class MapServer(Node):
    def __init__(self):
        super().__init__("map_server")
        latched = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)
        self.pub = self.create_publisher(String, "map", latched)
        self.pub.publish(String(data="the map"))


# -- 13. Executors and callback groups


class Busy(Node):
    def __init__(self):
        super().__init__("busy")
        group = ReentrantCallbackGroup()
        self.create_service(AddTwoInts, "add_slowly", self.add, callback_group=group)
        self.create_timer(0.1, self.tick, callback_group=MutuallyExclusiveCallbackGroup())
        self.ticks = 0

    def add(self, request, response):
        time.sleep(1.0)  # holds up a thread
        response.sum = request.a + request.b
        return response

    def tick(self):
        self.ticks += 1


def executor_for(node):
    executor = MultiThreadedExecutor(num_threads=4)
    executor.add_node(node)
    return executor


# -- 14. A script that asks once


def wait_for_one(node, topic, kind):
    future = rclpy.task.Future()
    subscription = node.create_subscription(kind, topic, lambda m: future.done() or future.set_result(m), 10)
    rclpy.spin_until_future_complete(node, future, timeout_sec=5.0)
    node.destroy_subscription(subscription)
    return future.result()  # None if it was too late


# -- 15. Names


def two_talkers():
    arguments = ["--ros-args", "-r", "chatter:=/loud/chatter"]
    return [rclpy.create_node("talker", namespace="/left"), rclpy.create_node("talker", cli_args=arguments)]


# -- 16. Launch

from launch import LaunchDescription
from launch_ros.actions import Node as LaunchedNode


def generate_launch_description():
    return LaunchDescription(
        [
            LaunchedNode(package="my_robot_controller", executable="talker", name="ann"),
            LaunchedNode(package="my_robot_controller", executable="listener", respawn=True),
        ]
    )


# -- 17. Record


def open_bag(path):
    import rosbag2_py

    writer = rosbag2_py.SequentialWriter()
    writer.open(rosbag2_py.StorageOptions(uri=path, storage_id="mcap"), rosbag2_py.ConverterOptions("", ""))
    writer.create_topic(
        rosbag2_py.TopicMetadata(id=0, name="/chatter", type="std_msgs/msg/String", serialization_format="cdr")
    )
    return writer


class BagWriter(Node):
    def __init__(self, writer):
        super().__init__("bag_writer")
        self.writer = writer
        self.create_subscription(String, "chatter", self.write, 10)

    def write(self, message):
        from rclpy.serialization import serialize_message

        self.writer.write("/chatter", serialize_message(message), self.get_clock().now().nanoseconds)


# -- 18. Test


def test_the_talker_is_heard():
    rclpy.init()
    talker, listener = Talker(), Listener()
    executor = SingleThreadedExecutor()
    executor.add_node(talker)
    executor.add_node(listener)
    end = time.monotonic() + 5.0
    while len(listener.heard) < 2 and time.monotonic() < end:
        executor.spin_once(timeout_sec=0.1)
    rclpy.shutdown()
    assert listener.heard[0] == "Hello 0"  # if it was found in time


# -- 19. Shutdown


def main():
    rclpy.init()
    node = Talker()
    try:
        rclpy.spin(node)
    except (KeyboardInterrupt, ExternalShutdownException):
        pass
    finally:
        node.destroy_node()
        rclpy.try_shutdown()


# -- 20. Work that takes long


class Planner(Node):
    def __init__(self):
        super().__init__("planner")
        self.plans = []
        self.create_timer(1.0, self.begin)

    def begin(self):
        threading.Thread(target=self.plan, daemon=True).start()

    def plan(self):
        self.plans.append(sum(range(100_000)))  # whose lock guards this?

"""A process of rclpy, with one node: ``python with_rclpy.py NAME [PARAMETER]``. It needs the environment of ROS 2, and its Python.

With PARAMETER ``lifecycle`` the node is a managed one.
"""

import sys
import threading
import time
from importlib import import_module
from typing import Any

import rclpy
import rclpy.lifecycle
import rclpy.node
from lines import obey, say
from plain import message_to_ordereddict, set_message_fields
from rclpy.action import ActionClient, ActionServer, CancelResponse, GoalResponse
from rclpy.callback_groups import ReentrantCallbackGroup
from rclpy.duration import Duration
from rclpy.event_handler import SubscriptionEventCallbacks
from rclpy.executors import MultiThreadedExecutor
from rclpy.qos import DurabilityPolicy, HistoryPolicy, LivelinessPolicy, QoSProfile, ReliabilityPolicy

rclpy.init()
kind = rclpy.lifecycle.LifecycleNode if sys.argv[2:] == ["lifecycle"] else rclpy.node.Node
node = kind(sys.argv[1], namespace="/ros")
executor = MultiThreadedExecutor(4)
executor.add_node(node)
group = ReentrantCallbackGroup()
things: dict[tuple[str, str], Any] = {}


def class_of(name: str) -> Any:
    package, kind, last = name.split("/")
    return getattr(import_module(f"{package}.{kind}"), last)


def filled(message: Any, plain: dict[str, Any]) -> Any:
    set_message_fields(message, plain)
    return message


def profile(
    reliability: str = "RELIABLE", durability: str = "VOLATILE", depth: int = 10, all: bool = False, lease: float = 0.0
) -> Any:
    """With a `lease`, its liveliness is MANUAL_BY_TOPIC."""
    return QoSProfile(
        history=HistoryPolicy.KEEP_ALL if all else HistoryPolicy.KEEP_LAST,
        depth=depth,
        reliability=ReliabilityPolicy[reliability],
        durability=DurabilityPolicy[durability],
        liveliness=LivelinessPolicy.MANUAL_BY_TOPIC if lease else LivelinessPolicy.AUTOMATIC,
        liveliness_lease_duration=Duration(seconds=lease),
    )


def publisher(topic: str, type: str, qos: dict[str, Any]) -> None:
    things["publisher", topic] = node.create_publisher(class_of(type), topic, profile(**qos))


def publish(topic: str, message: dict[str, Any]) -> None:
    one = things["publisher", topic]
    one.publish(filled(one.msg_type(), message))


def subscription(topic: str, type: str, qos: dict[str, Any]) -> None:
    def heard(message: Any) -> None:
        say("heard", topic=topic, message=message_to_ordereddict(message))

    def changed(event: Any) -> None:
        say("liveliness", topic=topic, alive=event.alive_count, not_alive=event.not_alive_count)

    watching = SubscriptionEventCallbacks(liveliness=changed) if "lease" in qos else None
    things["subscription", topic] = node.create_subscription(
        class_of(type), topic, heard, profile(**qos), event_callbacks=watching
    )


def assert_liveliness(topic: str) -> None:
    things["publisher", topic].assert_liveliness()


def counts(topic: str) -> Any:
    return [node.count_publishers(topic), node.count_subscribers(topic)]


def nodes() -> Any:
    return [f"{namespace.rstrip('/')}/{name}" for name, namespace in node.get_node_names_and_namespaces()]


def server(service: str, type: str, answers: dict[str, Any]) -> None:
    """Answers requests with `answers`; AddTwoInts with the sum."""

    def answer(request: Any, response: Any) -> Any:
        say("asked", service=service, request=message_to_ordereddict(request))
        given = dict(answers)
        if type.endswith("AddTwoInts"):
            given["sum"] = request.a + request.b
        return filled(response, given)

    things["server", service] = node.create_service(class_of(type), service, answer)


def finished(future: Any, seconds: float) -> Any:
    over = threading.Event()
    future.add_done_callback(lambda _: over.set())
    if not over.wait(seconds):
        raise TimeoutError(f"no answer within {seconds:g} s")
    return future.result()


def call(service: str, type: str, request: dict[str, Any], timeout: float) -> Any:
    cls = class_of(type)
    client = node.create_client(cls, service, callback_group=group)
    try:
        if not client.wait_for_service(timeout):
            raise TimeoutError("no server")
        return message_to_ordereddict(finished(client.call_async(filled(cls.Request(), request)), timeout))
    finally:
        node.destroy_client(client)


def action_server(action: str) -> None:
    """Fibonacci, one number each 0.2 s; rejects orders above 40."""
    cls = class_of("example_interfaces/action/Fibonacci")

    def run(handle: Any) -> Any:
        feedback = cls.Feedback(sequence=[0, 1])
        for i in range(1, handle.request.order):
            if handle.is_cancel_requested:
                handle.canceled()
                return cls.Result(sequence=feedback.sequence)
            feedback.sequence.append(feedback.sequence[i] + feedback.sequence[i - 1])
            handle.publish_feedback(feedback)
            time.sleep(0.2)
        if handle.request.order == 13:
            handle.abort()
        else:
            handle.succeed()
        return cls.Result(sequence=feedback.sequence)

    things["action", action] = ActionServer(
        node,
        cls,
        action,
        run,
        goal_callback=lambda goal: GoalResponse.REJECT if goal.order > 40 else GoalResponse.ACCEPT,
        cancel_callback=lambda handle: CancelResponse.ACCEPT,
        callback_group=group,
    )


def goal(action: str, type: str, goal: dict[str, Any], cancel_after: int, timeout: float) -> Any:
    """Carry a goal out at a server; with `cancel_after`, cancel it after so many feedbacks."""
    cls = class_of(type)
    client = ActionClient(node, cls, action, callback_group=group)
    feedbacks: list[Any] = []
    enough = threading.Event()

    def told(message: Any) -> None:
        feedbacks.append(message_to_ordereddict(message.feedback))
        if cancel_after and len(feedbacks) >= cancel_after:
            enough.set()

    try:
        if not client.wait_for_server(timeout):
            raise TimeoutError("no server")
        handle = finished(client.send_goal_async(filled(cls.Goal(), goal), told), timeout)
        if not handle.accepted:
            return {"accepted": False}
        result = handle.get_result_async()
        canceling = None
        if cancel_after:
            if not enough.wait(timeout):
                raise TimeoutError("no feedback")
            canceling = finished(handle.cancel_goal_async(), timeout).return_code
        end = finished(result, timeout)
        return {
            "accepted": True,
            "status": end.status,
            "result": message_to_ordereddict(end.result),
            "feedbacks": feedbacks,
            "canceling": canceling,
        }
    finally:
        client.destroy()


def declare(parameters: dict[str, Any]) -> None:
    for name, value in parameters.items():
        node.declare_parameter(name, value)


def close(kind: str, name: str) -> None:
    one = things.pop((kind, name))
    {"publisher": node.destroy_publisher, "subscription": node.destroy_subscription, "server": node.destroy_service}[
        kind
    ](one)


spinning = threading.Thread(target=executor.spin, daemon=True)
spinning.start()
commands = (
    publisher, publish, assert_liveliness, subscription, counts, nodes, server, call, action_server, goal, declare, close,
)  # fmt: skip
obey({one.__name__: one for one in commands})
executor.shutdown(2.0)
rclpy.shutdown()

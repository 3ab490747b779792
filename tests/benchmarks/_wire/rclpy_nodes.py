"""Nodes of rclpy on its ``rmw_cyclonedds_cpp``. They run in the interpreter that ROBACTOR_ROS2_PYTHON names, without this library."""

from __future__ import annotations

import asyncio
import threading
from collections.abc import AsyncGenerator
from contextlib import asynccontextmanager
from typing import Any

import rclpy
from example_interfaces.action import Fibonacci
from rclpy.action import ActionClient, ActionServer
from rclpy.executors import SingleThreadedExecutor
from rclpy.qos import HistoryPolicy, QoSProfile
from sensor_msgs.msg import Image
from std_msgs.msg import Int64, String
from std_srvs.srv import Trigger

from tests.benchmarks._wire import IMAGE, SMALL, Arrivals, Far, Work, calls, stream, ticks

AT_ONCE = QoSProfile(depth=100)
"""Of services: with the depth of 10 that they have, some of 16 answers at once are lost, and never come."""
OF_ACTION = {"goal_service_qos_profile": AT_ONCE, "result_service_qos_profile": AT_ONCE}
DEEP, ALL = QoSProfile(depth=4_000), QoSProfile(history=HistoryPolicy.KEEP_ALL)


@asynccontextmanager
async def node(name: str, port: int) -> AsyncGenerator[Any]:
    """A node that is spun in a thread."""
    rclpy.init(domain_id=port % 200)
    one, executor = rclpy.create_node(name), SingleThreadedExecutor()
    executor.add_node(one)
    spinning = threading.Thread(target=executor.spin, daemon=True)
    spinning.start()
    try:
        yield one
    finally:
        executor.shutdown()
        spinning.join(5.0)
        rclpy.try_shutdown()


async def far(work: Work, port: int) -> None:
    arrivals = Arrivals(work)

    def answer(request: Any, response: Any) -> Any:
        response.success = True
        return response

    def carry_out(goal: Any) -> Any:
        goal.succeed()
        return Fibonacci.Result(sequence=[0, 1])

    async with node("far", port) as it:
        it.create_subscription(String, "texts", lambda _: arrivals.take(), DEEP)
        it.create_subscription(Image, "images", lambda _: arrivals.take(), ALL)
        it.create_subscription(Int64, "stamps", lambda message: arrivals.stamped(message.data), DEEP)
        it.create_service(Trigger, "ask", answer, qos_profile=AT_ONCE)
        server = ActionServer(it, Fibonacci, "count", carry_out, **OF_ACTION)
        arrivals.ready()
        await asyncio.Event().wait()
        del server


async def near(work: Work, port: int, far: Far) -> list[float]:
    async with node("near", port) as it:
        match work:
            case "messages":
                texts = it.create_publisher(String, "texts", DEEP)
                await until(texts.get_subscription_count)
                return await stream(work, far, lambda: texts.publish(String(data="x" * (SMALL - 9))))
            case "images":
                images = it.create_publisher(Image, "images", ALL)
                picture = Image(height=480, width=640, encoding="rgb8", step=1920, data=bytes(IMAGE))
                await until(images.get_subscription_count)
                return await stream(work, far, lambda: images.publish(picture))
            case "latency":
                stamps = it.create_publisher(Int64, "stamps", DEEP)
                await until(stamps.get_subscription_count)
                return await ticks(far, lambda now: stamps.publish(Int64(data=now)))
            case "calls":
                client = it.create_client(Trigger, "ask", qos_profile=AT_ONCE)
                await until(client.service_is_ready)
                return await calls(far, lambda: done(client.call_async(Trigger.Request())))
            case _:
                goals = ActionClient(it, Fibonacci, "count", **OF_ACTION)
                await until(goals.server_is_ready)
                return await calls(far, lambda: carried_out(goals), "goals")


async def carried_out(goals: Any) -> None:
    handle = await done(goals.send_goal_async(Fibonacci.Goal(order=1)))
    await done(handle.get_result_async())


async def done(future: Any) -> Any:
    loop = asyncio.get_running_loop()
    answered: asyncio.Future[Any] = loop.create_future()
    future.add_done_callback(lambda it: loop.call_soon_threadsafe(answered.set_result, it.result()))
    return await answered


async def until(condition: Any) -> None:
    async with asyncio.timeout(20):
        while not condition():
            await asyncio.sleep(0.01)

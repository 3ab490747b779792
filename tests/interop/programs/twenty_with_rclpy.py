"""The programs of twenty_theirs.py, run with ROS 2: `python3 twenty_with_rclpy.py FILE`. The last line is "all of them".

Needs a shell in which ROS 2 is set up. What needs rosbag2 is left out where that is not installed.
"""

from __future__ import annotations

import os
import signal
import sys
import threading
import time
from collections.abc import Callable
from types import SimpleNamespace
from typing import Any

import rclpy
from rclpy.executors import MultiThreadedExecutor
from rclpy.parameter import Parameter

PATIENCE = 20.0


def until(condition: Callable[[], object], what: str) -> None:
    """Wait for a condition; fail if it does not come true."""
    end = time.monotonic() + PATIENCE
    while not condition():
        if time.monotonic() > end:
            raise AssertionError(f"in vain: {what}")
        time.sleep(0.02)
    print(f"passed: {what}", flush=True)


def halves(page: str) -> Any:
    """The names of the file."""
    with open(page, encoding="utf-8") as file:
        code = file.read()
    names: dict[str, Any] = {"__name__": "halves"}
    exec(compile(code, page, "exec"), names)
    return SimpleNamespace(**names)


def check(page: Any) -> None:
    page.test_the_talker_is_heard()
    print("passed: 18, the test", flush=True)
    rclpy.init()
    kinds = (
        page.Talker,
        page.Listener,
        page.Watchdog,
        page.Adder,
        page.Doubler,
        page.Counter,
        page.Customer,
        page.Driver,
    )
    nodes = {kind: kind() for kind in (*kinds, page.Scanner, page.MapServer, page.Busy, page.Planner)}
    camera, me = page.Camera("camera"), rclpy.create_node("me")
    executor = MultiThreadedExecutor(num_threads=8)
    for node in (*nodes.values(), camera):
        executor.add_node(node)
    spinning = threading.Thread(target=executor.spin, daemon=True)
    spinning.start()
    talk(page, nodes, me)
    work(page, nodes, camera, me)
    assert [one.get_name() for one in page.two_talkers()] == ["talker", "talker"]
    print("passed: 13, 15, executors and names", flush=True)
    executor.shutdown()
    rclpy.shutdown()
    record_and_launch(page)
    threading.Timer(1.0, lambda: os.kill(os.getpid(), signal.SIGINT)).start()
    page.main()
    print("passed: 19, shutdown", flush=True)


def talk(page: Any, nodes: dict[Any, Any], me: Any) -> None:
    until(lambda: len(nodes[page.Listener].heard) >= 2, "1, 2, talker and listener")
    assert nodes[page.Watchdog].alarms == 0
    assert page.ask_and_wait(me, 2, 3) == 5
    print("passed: 4, 5, service and client", flush=True)
    numbers = me.create_publisher(page.Float64, "numbers", 10)
    until(lambda: numbers.publish(page.Float64(data=2.0)) or 4 in nodes[page.Doubler].sums, "6, a call in a callback")
    assert page.wait_for_one(me, "chatter", page.String) is not None
    print("passed: 14, one message", flush=True)
    nodes[page.Talker].timer.cancel()
    until(lambda: nodes[page.Watchdog].alarms == 1, "3, the watchdog")


def work(page: Any, nodes: dict[Any, Any], camera: Any, me: Any) -> None:
    nodes[page.Customer].order(30)
    until(lambda: len(nodes[page.Customer].seen) > 2, "8, feedback")
    nodes[page.Customer].order(4)
    until(lambda: nodes[page.Customer].result == [0, 1, 1, 2, 3], "7, the newest goal first")
    results = nodes[page.Driver].set_parameters([Parameter("speed", value=9.0)])
    assert not results[0].successful and results[0].reason == "out of range"
    print("passed: 9, a parameter", flush=True)
    frames: list[Any] = []
    me.create_subscription(page.Float64, "frames", frames.append, 10)
    camera.trigger_configure()
    camera.trigger_activate()
    until(lambda: rclpy.spin_once(me, timeout_sec=0.1) or frames, "10, the camera")
    latched: list[Any] = []
    profile = page.QoSProfile(depth=1, durability=page.DurabilityPolicy.TRANSIENT_LOCAL)
    me.create_subscription(page.String, "map", latched.append, profile)
    until(lambda: rclpy.spin_once(me, timeout_sec=0.1) or latched, "12, the map")
    scans = me.create_publisher(page.LaserScan, "scan", page.qos_profile_sensor_data)
    until(lambda: scans.publish(page.LaserScan()) or nodes[page.Scanner].scans, "11, a scan")
    until(lambda: nodes[page.Planner].plans and nodes[page.Busy].ticks, "13, 20, ticks and plans")


def record_and_launch(page: Any) -> None:
    try:
        import rosbag2_py  # noqa: F401
    except ImportError:
        print("left out: 17, rosbag2 is not installed", flush=True)
    else:
        page.open_bag("/tmp/twenty_with_rclpy")
    assert len(page.generate_launch_description().entities) == 2
    print("passed: 16, a launch file", flush=True)


if __name__ == "__main__":
    check(halves(sys.argv[1]))
    print("all of them")

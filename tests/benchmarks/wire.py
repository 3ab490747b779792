"""The wire: nodes of two processes on one machine, by Zenoh and by DDS, beside the bindings by themselves, ZeroMQ and rclpy.

Rates are by the clock on the wall, because two processes share the work: run it on a machine that does nothing else. The processor time of both
ends is steadier. With ROBACTOR_ROS2_PYTHON, an interpreter that has rclpy and its ``rmw_cyclonedds_cpp``, rclpy takes part.
"""

from __future__ import annotations

import asyncio
import json
import os
import subprocess
import sys
from collections.abc import Sequence
from dataclasses import replace
from typing import Final

from tests.benchmarks import Contestant, Kind, Row, contest
from tests.benchmarks._wire import Work, measure

SPENT: Final = "us of processor for each, both ends"
OF_DDS: Final = ("dds_nodes", "dds", "dds_raw", "dds_engine", "rclpy_nodes")
WORKS: dict[Work, tuple[str, tuple[str, ...], tuple[str, ...]]] = {
    "messages": ("wire: messages of 64 bytes", ("messages per second", SPENT), ("ours", "raw", "raw_loop", "zmq_sockets", *OF_DDS)),
    "latency": ("wire: one way at 1 kHz", ("us, median", "us, 99th percentile"), ("ours", "raw", "zmq_sockets", *OF_DDS)),
    "images": ("wire: images of 921,600 bytes", ("images per second", SPENT), ("ours", "raw", "zmq_sockets", *OF_DDS)),
    "shared": ("wire: images of 921,600 bytes, by shared memory", ("images per second", SPENT), ("ours", "raw")),
    "calls": (
        "wire: service calls", ("calls per second, one at a time", "calls per second, 16 at once", SPENT),
        ("ours", "raw", "raw_loop", "zmq_sockets", "dds_nodes", "dds_engine", "rclpy_nodes"),
    ),
    "goals": (
        "wire: goals of an action", ("goals per second, one at a time", "goals per second, 16 at once", SPENT),
        ("ours", "dds_nodes", "rclpy_nodes"),
    ),
    "first": ("wire: from the start of a process to its first message", ("ms",), ("ours", "dds_nodes")),
}  # fmt: skip
NAMES = {
    "ours": "nodes",
    "raw": "zenoh, raw binding",
    "raw_loop": "zenoh, encoded and into the loop",
    "zmq_sockets": "pyzmq",
    "dds_nodes": "nodes, by DDS",
    "dds": "cyclonedds",
    "dds_raw": "cyclonedds, bytes",
    "dds_engine": "DDS endpoints into the loop",
    "rclpy_nodes": "rclpy, by rmw_cyclonedds",
}
ROS2_PYTHON: Final = os.environ.get("ROBACTOR_ROS2_PYTHON", "")
NEEDS = {
    "raw": "zenoh",
    "raw_loop": "zenoh",
    "zmq_sockets": "zmq",
    **dict.fromkeys(OF_DDS, "cyclonedds"),
    "rclpy_nodes": "" if ROS2_PYTHON else "rclpy",
}


def run() -> list[Row]:
    rows: list[Row] = []
    for work, (title, units, names) in WORKS.items():
        rows += contest(title, units, [_contestant(name, work) for name in names], rounds=3)
    return [replace(row, value=None, note="no figure") if row.value != row.value else row for row in rows]


def _contestant(name: str, work: Work) -> Contestant:
    kind: Kind = "ours" if name in ("ours", "dds_nodes") else "floor" if name.startswith("raw") else "peer"
    return Contestant(NAMES[name], kind, lambda: measured(name, work), NEEDS.get(name, ""))


def measured(name: str, work: Work) -> Sequence[float]:
    """The figures of one round."""
    for _ in range(3):
        try:
            return _elsewhere(name, work) if name == "rclpy_nodes" else asyncio.run(measure(name, work))
        except TimeoutError:  # a message of those that may be lost was lost
            continue
    return [float("nan")] * len(WORKS[work][1])


def _elsewhere(name: str, work: Work) -> list[float]:
    """A round in the interpreter of ROS 2."""
    environment = {
        **os.environ, "RMW_IMPLEMENTATION": "rmw_cyclonedds_cpp", "ROS_AUTOMATIC_DISCOVERY_RANGE": "LOCALHOST",
    }  # fmt: skip
    words = (ROS2_PYTHON or sys.executable, "-m", "tests.benchmarks._wire.alone", name, work)
    done = subprocess.run(words, env=environment, capture_output=True, text=True, timeout=180)
    if done.returncode != 0:
        raise RuntimeError(f"{words[0]} cannot run this benchmark:\n{done.stderr}")
    figures: list[float] = json.loads(done.stdout.splitlines()[-1])
    return figures

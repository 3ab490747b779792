"""The wire: nodes of two processes on one machine, beside Zenoh's binding by itself, ZeroMQ and Cyclone DDS.

Figures are by the clock on the wall, because two processes share the work: run it on a machine that does nothing else.
"""

from __future__ import annotations

import asyncio
import importlib
import socket
from collections.abc import Sequence
from dataclasses import replace

from tests.benchmarks import Contestant, Kind, Row, contest
from tests.benchmarks._wire import Work, far_end, ours

WORKS: dict[Work, tuple[str, tuple[str, ...], tuple[str, ...]]] = {
    "messages": ("wire: messages of 64 bytes", ("messages per second",), ("ours", "raw", "raw_loop", "zmq_sockets", "dds", "dds_raw", "dds_engine")),
    "latency": ("wire: one way at 1 kHz", ("us, median", "us, 99th percentile"), ("ours", "raw", "zmq_sockets", "dds", "dds_raw", "dds_engine")),
    "images": ("wire: images of 921,600 bytes", ("images per second",), ("ours", "raw", "zmq_sockets", "dds", "dds_raw", "dds_engine")),
    "shared": ("wire: images of 921,600 bytes, by shared memory", ("images per second",), ("ours", "raw")),
    "calls": ("wire: service calls", ("calls per second, one at a time", "calls per second, 16 at once"), ("ours", "raw", "zmq_sockets", "dds_engine")),
    "goals": ("wire: goals of an action", ("goals per second, one at a time", "goals per second, 16 at once"), ("ours",)),
    "first": ("wire: from the start of a process to its first message", ("ms",), ("ours",)),
}  # fmt: skip
NAMES = {
    "ours": "nodes",
    "raw": "zenoh, raw binding",
    "raw_loop": "zenoh, encoded and into the loop",
    "zmq_sockets": "pyzmq",
    "dds": "cyclonedds",
    "dds_raw": "cyclonedds, bytes",
    "dds_engine": "DDS endpoints into the loop",
}
NEEDS = {
    "ours": "",
    "raw": "zenoh",
    "raw_loop": "zenoh",
    "zmq_sockets": "zmq",
    "dds": "cyclonedds",
    "dds_raw": "cyclonedds",
    "dds_engine": "cyclonedds",
}


def run() -> list[Row]:
    rows: list[Row] = []
    for work, (title, units, names) in WORKS.items():
        rows += contest(title, units, [_contestant(name, work) for name in names], rounds=3)
    return [replace(row, value=None, note="no figure") if row.value != row.value else row for row in rows]


def _contestant(name: str, work: Work) -> Contestant:
    kind: Kind = "ours" if name == "ours" else "floor" if name.startswith("raw") else "peer"
    return Contestant(NAMES[name], kind, lambda: measured(name, work), NEEDS[name])


def measured(name: str, work: Work) -> Sequence[float]:
    """The figures of one round."""
    for _ in range(3):
        try:
            return asyncio.run(_measured(name, work))
        except TimeoutError:  # a message of those that may be lost was lost
            continue
    return [float("nan")] * len(WORKS[work][1])


async def _measured(name: str, work: Work) -> Sequence[float]:
    with socket.socket() as one:
        one.bind(("127.0.0.1", 0))
        port: int = one.getsockname()[1]
    if work == "first":
        return [1e3 * await ours.until_first(port, lambda: far_end(name, work, port, wait=False))]
    async with asyncio.timeout(120), far_end(name, work, port) as far:
        figures: list[float] = await importlib.import_module(f"tests.benchmarks._wire.{name}").near(work, port, far)
        return figures

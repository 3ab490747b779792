"""The numbers that the tutorials claim, measured: latency, throughput, queues, callbacks, services, graphs. The claim stands in brackets.

What needs two processes (shared memory, reliability, compression) is measured by `wire`.
"""

from __future__ import annotations

from tests.benchmarks import Row
from tests.benchmarks._claims import callbacks, graphs, latency, queues


def run() -> list[Row]:
    """Every figure once: they are beside claims, not beside other contestants."""
    return [*latency.rows(), *queues.rows(), *callbacks.rows(), *graphs.rows()]

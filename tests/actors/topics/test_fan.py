"""Many nodes on one topic: how the work of starting and stopping them grows, counted in calls and not in seconds."""

from __future__ import annotations

import asyncio
import sys
from types import FrameType

import pytest

from actors import Child, Node, Supervisor, Topic, publishes, run
from actors.interfaces.std_msgs.msg import Int32
from tests.benchmarks import fan

NUMBERS = Topic(Int32, "numbers", 10)


class Both(Node):
    """Publishes and takes one topic."""

    out = publishes(NUMBERS)

    @NUMBERS.on()
    def take(self, message: Int32) -> None: ...


class Reader(Node):
    """Takes the topic."""

    @NUMBERS.on()
    def take(self, message: Int32) -> None: ...


class Writer(Node):
    """Publishes the topic."""

    out = publishes(NUMBERS)


def calls_of_a_life(children: list[Child]) -> int:
    """How many functions are called, Python's and C's, while these nodes are started and stopped."""
    calls = 0

    def count(frame: FrameType, event: str, argument: object) -> None:
        nonlocal calls
        calls += event in ("call", "c_call")

    async def live() -> None:
        sys.setprofile(count)
        try:
            async with run(Supervisor("fan", children=children), signals=False, sinks=()):
                pass
        finally:
            sys.setprofile(None)

    asyncio.run(live())
    return calls


def all_to_all(nodes: int) -> list[Child]:
    return [Child(Both, name=f"n{number}") for number in range(nodes)]


def one_to_many(nodes: int) -> list[Child]:
    return [Child(Writer), *(Child(Reader, name=f"n{number}") for number in range(nodes))]


def many_to_one(nodes: int) -> list[Child]:
    return [Child(Reader), *(Child(Writer, name=f"n{number}") for number in range(nodes))]


@pytest.mark.skipif(sys.gettrace() is not None, reason="a debugger's own calls are counted, too")
def test_all_to_all_is_quadratic_and_one_to_many_linear() -> None:
    calls_of_a_life(all_to_all(2))  # what is imported and remembered at first use
    few, many = (calls_of_a_life(all_to_all(nodes)) for nodes in (40, 80))
    assert many < 4.4 * few
    for tree in (one_to_many, many_to_one):
        few, many = (calls_of_a_life(tree(nodes)) for nodes in (100, 200))
        assert many < 2.2 * few


def test_the_benchmark_tells_start_stop_and_the_longest_stretch(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(fan, "ALL_TO_ALL", 3)
    monkeypatch.setattr(fan, "READERS", 3)
    rows = fan.run()
    assert [(row.workload, row.name, row.unit) for row in rows if row.kind == "ours"] == [
        (workload, name, unit)
        for workload, name in (("3 nodes that publish and take one topic", "all to all"), ("1 publisher, 3 readers", "one to many"))
        for unit in ("ms to start", "ms to stop", "ms at a stretch, longest")
    ]  # fmt: skip
    assert all(row.value is not None and row.value > 0.0 for row in rows)

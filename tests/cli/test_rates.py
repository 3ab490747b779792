"""`topic hz`, `bw` and `delay`: the figures, and what they are on a running graph."""

from __future__ import annotations

import asyncio
import json
import signal
import statistics
import sys

import pytest

from actors import Child, Node, QoS, Topic, every, publishes
from actors.interfaces.geometry_msgs.msg import Vector3Stamped
from actors.interfaces.std_msgs.msg import Header, UInt8MultiArray
from cli.topic.rate import Intervals, Sizes, Spread, Window, bandwidth
from tests.cli.conftest import SystemOf

FAST = Topic(Vector3Stamped, "fast", QoS(depth=1000))
BLOBS = Topic(UInt8MultiArray, "blobs", 10)


def test_the_spread_of_intervals_is_that_of_the_statistics_module() -> None:
    window = Intervals(10)
    moments = [0.0, 0.1, 0.25, 0.3, 0.5]
    for moment in moments:
        window.arrived(moment)
    steps = [0.1, 0.15, 0.05, 0.2]
    spread = window.spread()
    assert spread is not None
    assert spread.number == 4
    assert spread == pytest.approx((statistics.fmean(steps), 0.05, 0.2, statistics.pstdev(steps), 4))


def test_a_window_forgets_the_oldest_and_knows_whether_something_is_new() -> None:
    window = Window(2)
    assert window.spread() is None
    for number in (1.0, 2.0, 4.0):
        window.add(number)
    assert window.fresh
    assert window.spread() == Spread(3.0, 2.0, 4.0, 1.0, 2)
    assert not window.fresh


def test_bandwidth_is_counted_from_the_first_message_of_the_window_until_now() -> None:
    sizes = Sizes(3)
    sizes.arrived(0.0, 100)
    assert sizes.spread(1.0) is None
    sizes.arrived(1.0, 300)
    measured = sizes.spread(2.0)
    assert measured is not None
    rate, spread = measured
    assert (rate, spread.mean, spread.least, spread.most, spread.number) == (200.0, 200.0, 100, 300, 2)


@pytest.mark.parametrize(
    ("rate", "shown"),
    [
        (999.0, ("999 B/s", "24 B", "20 B", "30 B")),
        (1000.0, ("1.00 KB/s", "0.02 KB", "0.02 KB", "0.03 KB")),
        (2_500_000.0, ("2.50 MB/s", "0.00 MB", "0.00 MB", "0.00 MB")),
    ],
)
def test_sizes_are_shown_in_the_unit_of_their_rate(rate: float, shown: tuple[str, ...]) -> None:
    assert bandwidth(rate, Spread(24.0, 20, 30, 0.0, 5)) == shown


class Steady(Node):
    """Vectors at 100 Hz, and at the same rate 1000 bytes."""

    fast = publishes(FAST)
    blobs = publishes(BLOBS)

    @every(hz=100)
    def tick(self) -> None:
        self.fast(Vector3Stamped(header=Header(stamp=self.clock.stamp())))
        self.blobs(UInt8MultiArray(data=bytes(1000)))


async def measured(environment: dict[str, str], lines: int, *words: str) -> list[str]:
    process = await asyncio.create_subprocess_exec(
        sys.executable, "-m", "robot", "topic", *words, env=environment, stdout=-1, stderr=-1
    )
    assert process.stdout is not None
    async with asyncio.timeout(60):
        found = [(await process.stdout.readline()).decode() for _ in range(lines)]
        process.send_signal(signal.SIGINT)
        await process.communicate()
    return found


@pytest.mark.realtime
async def test_C_25_a_rate_of_100_hz_is_measured_as_such(system_of: SystemOf, environment: dict[str, str]) -> None:
    async with system_of(Steady):
        lines = await measured(environment, 4, "hz", "/fast")
        (as_json,) = await measured(environment, 1, "hz", "/fast", "--json")
        table = await measured(environment, 4, "hz", "/fast", "/blobs")
    assert lines[0].startswith("average rate: ")
    assert float(lines[2].removeprefix("average rate: ")) == pytest.approx(100.0, rel=0.05)
    assert lines[3].startswith("\tmin: 0.0")
    assert json.loads(as_json)["rate"] == pytest.approx(100.0, rel=0.1)
    assert table[0].split() == ["topic", "rate", "min_delta", "max_delta", "std_dev", "window"]
    assert {line.split()[0] for line in table[2:]} == {"/fast", "/blobs"}


@pytest.mark.realtime
async def test_bandwidth_and_delay_are_measured(system_of: SystemOf, environment: dict[str, str]) -> None:
    async with system_of(Child(Steady)):
        lines = await measured(environment, 3, "bw", "/blobs")
        delays = await measured(environment, 2, "delay", "/fast")
    assert lines[0] == "Subscribed to [/blobs]\n"
    assert lines[1].split()[1:] == ["KB/s", "from", lines[1].split()[3], "messages"]
    assert lines[2].startswith("\tMessage size mean: 1.0")
    assert delays[0].startswith("average delay: 0.0")
    assert "std dev: " in delays[1]

"""`topic hz`, `bw` and `delay`: the figures, and what they are on a running graph."""

from __future__ import annotations

import asyncio
import json
import signal
import statistics
import sys
from argparse import Namespace

import pytest

from actors import Child, Node, QoS, Topic, every, publishes
from actors.interfaces.builtin_interfaces.msg import Time
from actors.interfaces.geometry_msgs.msg import Vector3Stamped
from actors.interfaces.rosgraph_msgs.msg import Clock
from actors.interfaces.std_msgs.msg import Header, UInt8MultiArray
from actors.nodes import CLOCK
from cli.verbs.topic.rate import Intervals, Sizes, Spread, Window, _print_rates, _printing, bandwidth
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


def test_the_rates_of_several_topics_are_a_table_of_those_that_were_heard(capsys: pytest.CaptureFixture[str]) -> None:
    windows = {name: Intervals(10) for name in ("/fast", "/slow", "/silent")}
    for number in range(5):
        windows["/fast"].arrived(number * 0.1)
        windows["/slow"].arrived(number * 1.0)
    _print_rates(Namespace(json=False, all_topics=False), windows)
    head, _, *rows = (line.split() for line in capsys.readouterr().out.splitlines())
    assert head == ["topic", "rate", "min_delta", "max_delta", "std_dev", "window"]
    assert [row[:3] for row in rows if row] == [["/fast", "10.000", "0.100"], ["/slow", "1.000", "1.000"]]


@pytest.mark.virtual
async def test_what_cannot_be_printed_ends_the_measurement_with_its_error() -> None:
    def show() -> None:
        raise BrokenPipeError("the terminal is gone")

    with pytest.raises(BrokenPipeError, match="the terminal is gone"):
        async with _printing(show):
            await asyncio.sleep(60.0)
    assert asyncio.get_running_loop().time() < 2.0


@pytest.mark.realtime
async def test_a_rate_of_100_hz_is_measured_as_such(system_of: SystemOf, environment: dict[str, str]) -> None:
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


def test_messages_that_have_not_arrived_are_counted_by_the_numbers_of_each_publisher() -> None:
    window = Intervals(100)
    numbers = ((b"a", 7), (b"a", 8), (b"b", 1), (b"a", 11), (b"b", 2), (b"b", 5))
    assert [window.step(publisher, number) for publisher, number in numbers] == [1, 1, 1, 3, 1, 3]
    assert window.lost == 2 + 2


def test_a_message_that_comes_late_was_not_lost() -> None:
    window = Intervals(100)
    assert [window.step(b"a", number) for number in (7, 6, 10, 9, 11)] == [1, 0, 3, 0, 1]
    assert window.lost == 1


def test_the_rate_is_that_of_sending_also_where_half_of_the_messages_do_not_arrive() -> None:
    """1000 messages a second are sent in bursts, and every second one arrives; the window holds the newest hundred."""
    window = Intervals(100)
    for number in range(0, 1000, 2):
        window.arrived(number // 20 * 0.02, window.step(b"a", number))
    spread = window.spread()
    assert spread is not None
    assert 1 / spread.mean == pytest.approx(500.0)
    assert window.rate(spread) == pytest.approx(1000.0)
    assert window.lost == 499


RUSH = """
import asyncio, os, sys
from actors import Node, Topic, every, publishes, run
from actors.interfaces.std_msgs.msg import Int32
from actors.transport import transport_from_environment
class Rush(Node):
    numbers = publishes(Topic(Int32, "numbers", 1000))
    sent = 0
    @every(hz=500)
    def tick(self):
        for _ in range(20):
            self.sent += 1
            self.numbers(Int32(data=self.sent % 2**31))
    @every(hz=2)
    def tell(self):
        print(self.clock.now(), self.sent, flush=True)
async def main():
    async with run(Rush, transport=transport_from_environment(os.environ), sinks=()) as system:
        await system.wait()
asyncio.run(main())
"""


@pytest.mark.realtime
async def test_10_khz_are_measured_as_the_publisher_has_sent_them_with_what_has_not_arrived(
    environment: dict[str, str],
) -> None:
    publisher = await asyncio.create_subprocess_exec(sys.executable, "-c", RUSH, env=environment, stdout=-1)
    assert publisher.stdout is not None
    try:
        (last,) = (await measured(environment, 5, "hz", "/numbers", "--json", "--window", "100000"))[-1:]
    finally:
        publisher.terminate()
        told = (await publisher.stdout.read()).decode().split("\n")
        await publisher.wait()
    (begin, first), (end, final) = ((float(one), int(other)) for one, other in (told[1].split(), told[-2].split()))
    seen = json.loads(last)
    sent = (final - first) / (end - begin)
    # By the numbers of those that arrived, and what is missing between them:
    assert seen["rate"] == pytest.approx(sent, rel=0.1)
    arrived = seen["window"] + 1
    assert seen["received"] * (arrived + seen["lost"]) / arrived == pytest.approx(sent, rel=0.1)


class Simulated(Node):
    """Stands at 1000 s of simulated time, with a message that was stamped half a second before."""

    time = publishes(CLOCK)
    out = publishes(FAST)

    @every(hz=50)
    def publish(self) -> None:
        self.time(Clock(clock=Time(sec=1000)))
        self.out(Vector3Stamped(header=Header(stamp=Time(sec=999, nanosec=500_000_000))))


@pytest.mark.realtime
async def test_delays_are_those_of_simulated_time_if_asked_for(
    system_of: SystemOf, environment: dict[str, str]
) -> None:
    async with system_of(Simulated):
        (line,) = await measured(environment, 1, "delay", "/fast", "--use-sim-time")
    assert line == "average delay: 0.500\n"


class Faster(Node):
    """Ten times as fast as real time: a message every 0.2 s of simulated time."""

    time = publishes(CLOCK)
    out = publishes(FAST)

    def __init__(self) -> None:
        self.ticks = 0

    @every(hz=50)
    def publish(self) -> None:
        self.ticks += 1
        self.time(Clock(clock=Time(sec=1000 + self.ticks // 5, nanosec=self.ticks % 5 * 200_000_000)))
        self.out(Vector3Stamped(header=Header(frame_id="odd" if self.ticks % 2 else "even")))


@pytest.mark.realtime
async def test_rates_are_those_of_simulated_time_if_asked_for(system_of: SystemOf, environment: dict[str, str]) -> None:
    odd = "m.header.frame_id == 'odd'"
    async with system_of(Faster):
        for expected, words in (
            (5.0, ("-s",)),
            (2.5, ("-s", "--filter", odd)),
            (50.0, ("-s", "--wall-time")),
        ):
            (line,) = await measured(environment, 1, "hz", "/fast", *words)
            assert float(line.removeprefix("average rate: ")) == pytest.approx(expected, rel=0.2)


def test_where_time_is_set_back_rates_are_counted_anew_and_no_time_is_no_rate() -> None:
    window = Intervals(10)
    for now in (5.0, 6.0, 7.0, 1.0, 3.0):
        window.arrived(now)
    spread = window.spread()
    assert spread is not None
    assert (spread.mean, spread.number, window.rate(spread)) == (2.0, 1, 0.5)
    window = Intervals(10)
    for _ in range(3):
        window.arrived(4.0)
    spread = window.spread()
    assert spread is not None
    assert window.rate(spread) == 0.0

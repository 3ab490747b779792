"""`topic hz | bw | delay`: how often messages come, how large they are, and how old."""

from __future__ import annotations

import argparse
import asyncio
import time
from collections import deque
from collections.abc import AsyncGenerator, Callable, Sequence
from contextlib import ExitStack, asynccontextmanager
from math import sqrt
from typing import Any, NamedTuple

from cli.command import CommandFailed, Exit
from cli.output import clear_screen, print_json, table
from cli.parsing import complain
from cli.verbs.topic.raw import Arrival, listening, topic_names

PERIOD = 1.0
"""Seconds between two lines."""


class Spread(NamedTuple):
    """What the numbers of a window have in common. Times are in seconds."""

    mean: float
    least: float
    most: float
    deviation: float
    number: int


class Window:
    """The newest numbers, at most `size`, and whether one has come since they were last looked at."""

    def __init__(self, size: int) -> None:
        self._numbers: deque[float] = deque(maxlen=size)
        self.fresh = False

    def add(self, number: float) -> None:
        self._numbers.append(number)
        self.fresh = True

    def spread(self) -> Spread | None:
        """The spread of the numbers; None if there are none."""
        numbers = self._numbers
        if not numbers:
            return None
        self.fresh = False
        mean = sum(numbers) / len(numbers)
        deviation = sqrt(sum((number - mean) ** 2 for number in numbers) / len(numbers))
        return Spread(mean, min(numbers), max(numbers), deviation, len(numbers))


class Intervals(Window):
    """The intervals between messages, of which the window needs one less than messages; and how many messages are missing.

    Invariant: there is a step for each interval, the number of messages that were sent in it.
    """

    def __init__(self, size: int) -> None:
        super().__init__(size)
        self._steps: deque[int] = deque(maxlen=size)
        self._last: float | None = None
        self._numbers_of: dict[bytes, int] = {}
        self.lost = 0
        """How many numbers of publishers were skipped, since the first message of each."""
        self.told = 0
        """How many of those have been told of."""

    def arrived(self, now: float, step: int = 1) -> None:
        """A message has come, the last one of `step` that were sent since the one before. Where time was set back, counting starts over."""
        if self._last is not None and now < self._last:
            self._numbers.clear()
            self._steps.clear()
        elif self._last is not None:
            self.add(now - self._last)
            self._steps.append(step)
        self._last = now

    def step(self, publisher: bytes, number: int) -> int:
        """How far this number leads among those of its publisher: 1, more if some are missing, and 0 for one that comes late."""
        last = self._numbers_of.get(publisher, number - 1)
        self._numbers_of[publisher] = max(last, number)
        self.lost += number - last - 1 if number > last else -min(1, self.lost)
        return max(0, number - last)

    def rate(self, received: Spread) -> float:
        """How many messages a second were sent, by their numbers; `received` is the spread of the intervals. 0 where no time has passed."""
        return sum(self._steps) / (received.mean * received.number) if received.mean else 0.0


class SimTime:
    """The time of /clock."""

    def __init__(self) -> None:
        self._seconds = 0.0

    def take(self, arrival: Arrival) -> None:
        """A message of /clock has come."""
        from actors.interfaces import decode
        from actors.interfaces.rosgraph_msgs.msg import Clock

        told = decode(Clock, arrival.payload).clock
        self._seconds = told.sec + told.nanosec / 1e9

    def seconds(self) -> float:
        """The time now; 0 until /clock tells it."""
        return self._seconds


class Sizes:
    """The sizes of the newest messages, and when these came."""

    def __init__(self, size: int) -> None:
        self._arrivals: deque[tuple[float, int]] = deque(maxlen=size)
        self.fresh = False

    def arrived(self, now: float, size: int) -> None:
        self._arrivals.append((now, size))
        self.fresh = True

    def spread(self, now: float) -> tuple[float, Spread] | None:
        """The bytes a second since the first of them, and the spread of the sizes; None with fewer than two messages."""
        if len(self._arrivals) < 2:
            return None
        self.fresh = False
        sizes = [size for _, size in self._arrivals]
        first = self._arrivals[0][0]
        mean = sum(sizes) / len(sizes)
        return sum(sizes) / (now - first), Spread(mean, min(sizes), max(sizes), 0.0, len(sizes))


async def hz(options: argparse.Namespace) -> Exit:
    """Print every second how often messages are sent. Intervals are measured where they arrive; the rate counts those that did not."""
    if options.filter:
        return await _filtered_hz(options)
    windows: dict[str, Intervals] = {}
    sim = SimTime() if options.use_sim_time and not options.wall_time else None
    clock = time.perf_counter if sim is None else sim.seconds

    def receiver(name: str) -> Callable[[Arrival], None]:
        window = windows[name] = Intervals(options.window)

        def take(arrival: Arrival) -> None:
            step = window.step(arrival.publisher, arrival.sequence_number)
            if now := clock():
                window.arrived(now, step)

        return take

    return await _every_second(options, receiver, lambda: _print_rates(options, windows), sim=sim)


async def _filtered_hz(options: argparse.Namespace) -> Exit:
    """The same for messages that a filter lets through, which have to be decoded."""
    from cli.graph.seen import seen
    from cli.verbs.topic.echo import chosen_filter, topic_of

    wanted = chosen_filter(options.filter)
    if len(options.topic_name) != 1:
        raise CommandFailed("--filter is for one topic")
    options.topic_name = options.topic_name[0]
    simulated = options.use_sim_time and not options.wall_time
    async with seen(options) as graph:
        graph.node.set_parameter("use_sim_time", simulated)
        topic = await topic_of(graph, options)
        windows = {topic.name: Intervals(options.window)}
        async with graph.node.subscribe(topic) as messages, _printing(lambda: _print_rates(options, windows)):
            async for message in messages:
                now = graph.node.clock.wall_ns() / 1e9 if simulated else time.perf_counter()
                if wanted(message) and now:
                    windows[topic.name].arrived(now)
    return Exit.DONE


def _print_rates(options: argparse.Namespace, windows: dict[str, Intervals]) -> None:
    found = [(name, spread) for name, window in windows.items() if window.fresh and (spread := window.spread())]
    if options.json:
        for name, spread in found:
            rates = {"rate": windows[name].rate(spread), "received": 1 / spread.mean if spread.mean else 0.0}
            print_json({"topic": name, **rates, **_json(spread), "lost": windows[name].lost})
    elif len(windows) == 1:
        for name, spread in found:
            print(f"average rate: {windows[name].rate(spread):.3f}\n{_line(spread)}")
    elif found:
        if options.all_topics:
            clear_screen()
        rows = [
            (name, f"{windows[name].rate(each):.3f}", f"{each.least:.3f}", f"{each.most:.3f}", f"{each.deviation:.5f}", str(each.number))
            for name, each in found
        ]  # fmt: skip
        print(table(("topic", "rate", "min_delta", "max_delta", "std_dev", "window"), rows))
    for name, spread in found:
        window = windows[name]
        if window.lost > window.told and not options.json:
            received = f"{1 / spread.mean if spread.mean else 0:.3f} a second come here"
            complain(f"{name}: {window.lost} messages have not arrived, by the numbers of the publisher; {received}")
            window.told = window.lost


def _line(spread: Spread) -> str:
    return (
        f"\tmin: {spread.least:.3f}s max: {spread.most:.3f}s std dev: {spread.deviation:.5f}s window: {spread.number}"
    )


def _json(spread: Spread) -> dict[str, float]:
    return {"min": spread.least, "max": spread.most, "std_dev": spread.deviation, "window": spread.number}


async def bw(options: argparse.Namespace) -> Exit:
    """Print every second how many bytes come."""
    windows: dict[str, Sizes] = {}

    def receiver(name: str) -> Callable[[Arrival], None]:
        window = windows[name] = Sizes(options.window)
        return lambda arrival: window.arrived(time.perf_counter(), len(arrival.payload))

    def subscribed(name: str) -> None:
        if not options.json:
            print(f"Subscribed to [{name}]")

    return await _every_second(options, receiver, lambda: _print_sizes(options, windows), subscribed)


def _print_sizes(options: argparse.Namespace, windows: dict[str, Sizes]) -> None:
    now = time.perf_counter()
    found = [(name, each) for name, window in windows.items() if window.fresh and (each := window.spread(now))]
    if options.json:
        for name, (rate, spread) in found:
            print_json({"topic": name, "bytes_per_second": rate, "mean": spread.mean, "min": spread.least,
                        "max": spread.most, "window": spread.number})  # fmt: skip
    elif len(windows) == 1:
        for _, (rate, spread) in found:
            whole, mean, least, most = bandwidth(rate, spread)
            print(f"{whole} from {spread.number} messages\n\tMessage size mean: {mean} min: {least} max: {most}")
    elif found:
        rows: list[Sequence[str]] = []
        for name, (rate, spread) in found:
            whole, *rest = bandwidth(rate, spread)
            rows.append((name, whole, str(spread.number), *rest))
        print(table(("topic", "bandwidth", "window", "mean", "min", "max"), rows))


def bandwidth(rate: float, spread: Spread) -> tuple[str, str, str, str]:
    """A rate and the mean, least and largest size, all in the unit that suits the rate: B, KB or MB of 1000."""
    if rate < 1000:
        form: Callable[[float], str] = "{:.0f} B".format
    elif rate < 1000000:
        form = lambda size: f"{size / 1000:.2f} KB"  # noqa: E731
    else:
        form = lambda size: f"{size / 1000000:.2f} MB"  # noqa: E731
    return f"{form(rate)}/s", form(spread.mean), form(spread.least), form(spread.most)


async def delay(options: argparse.Namespace) -> Exit:
    """Print every second how old messages are when they come, by the time in their headers."""
    from cli.graph.seen import seen
    from cli.verbs.topic.echo import topic_of

    window = Window(options.window)

    def show() -> None:
        if not window.fresh:
            if window.spread() is not None:
                complain("no new messages")
            return
        spread = window.spread()
        assert spread is not None
        if options.json:
            print_json({"delay": spread.mean, **_json(spread)})
        else:
            print(f"average delay: {spread.mean:.3f}\n{_line(spread)}")

    async with seen(options) as graph:
        graph.node.set_parameter("use_sim_time", options.use_sim_time)
        topic = await topic_of(graph, options)
        if not any(field.name == "header" for field in topic.type.__ros_fields__):
            raise CommandFailed(
                f"msg does not have header: {topic.type.__ros_type__}, the type of {topic.name}, has none"
            )
        async with graph.node.subscribe(topic) as messages, _printing(show):
            async for message in messages:
                stamp: Any = message.header.stamp
                now = graph.node.clock.wall_ns() if options.use_sim_time else time.time_ns()
                if now:  # simulated time is 0 until /clock tells it
                    window.add((now - stamp.sec * 10**9 - stamp.nanosec) / 1e9)
    return Exit.DONE


@asynccontextmanager
async def _printing(show: Callable[[], None]) -> AsyncGenerator[None]:
    """Call `show` every second while the block lasts; an error of it ends the block and is raised there."""
    failed: list[BaseException] = []
    block = asyncio.current_task()
    assert block is not None

    async def run() -> None:
        try:
            while True:
                await asyncio.sleep(PERIOD)
                show()
        except (Exception, KeyboardInterrupt) as error:
            failed.append(error)
            block.cancel()

    task = asyncio.ensure_future(run())
    try:
        yield
    except asyncio.CancelledError:
        if failed:
            raise failed[0] from None
        raise
    finally:
        task.cancel()


async def _every_second(
    options: argparse.Namespace,
    receiver: Callable[[str], Callable[[Arrival], None]],
    show: Callable[[], None],
    subscribed: Callable[[str], None] = lambda name: None,
    sim: SimTime | None = None,
) -> Exit:
    """Take the messages of all topics that the options name, and call `show` every second; `sim` takes those of /clock."""
    async with listening(options) as (view, ear):
        with ExitStack() as stack:
            if sim is not None:
                stack.enter_context(ear.subscribe("/clock", await ear.ends("/clock"), options, sim.take))
            for name in topic_names(options, view):
                stack.enter_context(ear.subscribe(name, await ear.ends(name), options, receiver(name)))
                subscribed(name)
            while True:
                await asyncio.sleep(PERIOD)
                show()

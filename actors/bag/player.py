"""`Player`: a node that plays a bag: it publishes what was recorded, at the times of the recording."""

from __future__ import annotations

import asyncio
import math
import os
from collections.abc import Callable, Mapping
from functools import partial
from typing import Any, Final

from actors.bag.contents import BagError, BagMessage, BagTopic
from actors.bag.control_services import serve_player
from actors.bag.conversion import here
from actors.bag.options import PlayOptions
from actors.bag.qos_text import parse_qos_profiles
from actors.bag.read_ahead import ReadAhead
from actors.bag.reader import BagReader
from actors.bag.requests import Requests, nothing
from actors.bag.selection import action_of, service_of
from actors.contracts.contracts import Topic
from actors.interfaces.errors import InterfaceError
from actors.interfaces.rosgraph_msgs.msg import Clock as ClockMessage
from actors.qos import DEFAULT, InvalidQoS
from actors.qos.policies import QoS
from actors.runtime.declarations import background
from actors.runtime.incarnation import incarnation_of
from actors.runtime.node import Node
from actors.runtime.sim_time import CLOCK
from actors.supervision.reasons import ExitReason
from actors.time.values import stamp_of
from actors.topics.publisher import Publisher

MOST_SECONDS: Final = 1e8
"""What is longer, such as a rate of 1e308 makes it, counts as so long: no bag has three years."""


def nanoseconds(seconds: float) -> int:
    """A duration in nanoseconds."""
    return round(min(seconds, MOST_SECONDS) * 1e9)


class PlayClock:
    """Maps the time of a clock that always runs, in seconds, to the time of a bag, in nanoseconds.

    Invariants: at `_anchor`, the bag's time was `_bag_ns`. Since then it has run at `rate`, or stood still while `paused`.
    """

    __slots__ = ("_anchor", "_bag_ns", "paused", "rate")

    def __init__(self, now: float, bag_ns: int, rate: float, *, paused: bool) -> None:
        self._anchor = now
        self._bag_ns = bag_ns
        self.rate = rate
        self.paused = paused

    def bag_ns(self, now: float) -> int:
        """The time of the bag at the instant `now`."""
        if self.paused:
            return self._bag_ns
        return self._bag_ns + nanoseconds((now - self._anchor) * self.rate)

    def instant(self, bag_ns: int) -> float:
        """When the bag's time will be `bag_ns`, if nothing changes and it is not paused."""
        return self._anchor + (bag_ns - self._bag_ns) / 1e9 / self.rate

    def pause(self, now: float) -> None:
        self.seek(now, self.bag_ns(now))
        self.paused = True

    def unpause(self, now: float) -> None:
        self.seek(now, self.bag_ns(now))
        self.paused = False

    def set_rate(self, now: float, rate: float) -> None:
        """Run at another rate from `now` on. Raises `ValueError` if it is not above 0."""
        if not 0 < rate < float("inf"):
            raise ValueError(f"a bag cannot be played at the rate {rate:g}: it must be above 0")
        self.seek(now, self.bag_ns(now))
        self.rate = rate

    def seek(self, now: float, bag_ns: int) -> None:
        """Let the bag's time be `bag_ns` at the instant `now`."""
        self._anchor, self._bag_ns = now, bag_ns


TURN: Final = 64
"""How many messages are played at most before others have their turn."""

PARTIAL: Final = frozenset(("tf2_msgs/msg/TFMessage", "rcl_interfaces/msg/Log", "diagnostic_msgs/msg/DiagnosticArray"))
"""The types of messages that tell a part each: what holds at a time is in the last ones of all publishers."""

RECALLED: Final = 100
"""The most messages of a topic that are played after a seek, and so many of a partial type: half a second of transforms by four publishers at 50 Hz."""


class Player(Node):
    """Plays a bag, with the quality of service that was offered, on the real clock or the virtual one.

    Playing begins with the node and ends with the bag; `wait` waits for that. The node stays, so that its services can start again:
    those of `ros2 bag play`, `~/pause`, `~/resume`, `~/toggle_paused`, `~/is_paused`, `~/set_rate`, `~/get_rate`, `~/play_next`, `~/burst`,
    `~/seek`, `~/stop`. A message that cannot be decoded is logged and left out, and so is a topic that cannot be played, such as one that is
    not in CDR. If the bag and this process define a type differently, messages are published as this process has it: with the fields that
    both have, by name, and a warning that names the others.

    Raises `BagError` at its start for a bag that cannot be read, or of which nothing can be played. It fails with `BagError` where the bag is damaged.
    """

    # Invariants:
    # * `_time` is the time of the bag. A message is played when its receive time is reached, or by `play_next` and `burst`.
    # * `_changed` is set when `_time` has changed other than by running.
    # * `_recall` is the time of a seek, with `PlayOptions.scrub`, until what was shown then has been played; `_recalling` is held meanwhile.

    node_name = "rosbag2_player"
    no_replay = "reads files, which no journal carries"

    def __init__(self, bag: str | os.PathLike[str], options: PlayOptions | None = None) -> None:
        self.options = options = options or PlayOptions()
        self.bag = BagReader(bag)
        self.played = 0
        """The number of messages played so far; those that could not be decoded are not among them."""
        self.seeks = 0
        """How often `seek` has changed the time."""
        self.message_ns: int | None = None
        """While a message is published: when it was received, in nanoseconds since 1970. Else None."""
        first, last = self.bag.metadata.start_ns, self.bag.metadata.end_ns
        self._begin_ns = first + nanoseconds(options.start_offset)
        ends = [last] if options.duration == math.inf else [last, self._begin_ns + nanoseconds(options.duration)]
        self._end_ns = min(ends if options.until_ns is None else [*ends, options.until_ns])
        self.failure: BagError | None = None
        """Why playing has ended, if the bag could not be read further."""
        self._sinks: dict[BagTopic, Callable[[BagMessage], bool]] = {}
        self._counts: dict[str, int] = {}
        self._latched: list[BagTopic] = []
        self._recall: int | None = None
        self._recalling = asyncio.Lock()
        self._changed = asyncio.Event()
        self._begun = asyncio.Event()
        self._over = asyncio.Event()
        names = {topic.name for topic in self.bag.topics if self._selected(topic)}
        self._messages = ReadAhead(self.bag, names, options.read_ahead, partial(self.offload, thread=True))
        self._requests = Requests(self, options)
        self._time = PlayClock(0.0, self._begin_ns, options.rate, paused=options.paused)

    async def on_start(self) -> None:
        self._tick = self.publisher(CLOCK) if self.options.clock else None
        why: BagError | None = None
        for topic in self.bag.topics:
            if self._selected(topic):
                try:
                    qos = self._qos(topic)
                    self._sinks[topic] = self._requests.sink(topic) or self._publishing(topic, qos)
                    self._counts[topic.name] = max(self._counts.get(topic.name, 0), _recalled(topic, qos))
                    if qos.transient_local:
                        self._latched.append(topic)
                except BagError as error:
                    why = error
                    self._sinks[topic] = nothing
                    self.log.warning("a topic of the bag is not played", topic=topic.name, because=str(error))
        if why is not None and all(sink is nothing for sink in self._sinks.values()):
            raise BagError(f"nothing of {self.bag.path} can be played: {why}")
        self._messages.limit({topic.name for topic, sink in self._sinks.items() if sink is not nothing})
        self._messages.rewind(self._begin_ns)
        serve_player(self)

    async def on_stop(self, reason: ExitReason) -> None:
        self._over.set()
        await self._messages.close()
        self.bag.close()

    # -- for users ----------------------------------------------------------------------------------------------------------

    @property
    def paused(self) -> bool:
        return self._time.paused

    @property
    def over(self) -> bool:
        """Whether playing has ended."""
        return self._over.is_set()

    @property
    def rate(self) -> float:
        """How much faster than recorded the bag is played. Raises `ValueError` when it is set to what is not above 0."""
        return self._time.rate

    @rate.setter
    def rate(self, rate: float) -> None:
        self._time.set_rate(self._now(), rate)
        self._changed.set()

    @property
    def position_ns(self) -> int:
        """The time of the bag now, in nanoseconds since 1970."""
        return min(self._time.bag_ns(self._now()), self._end_ns) if self._begun.is_set() else self._begin_ns

    @property
    def start_ns(self) -> int:
        """Where playing begins, in the time of the bag."""
        return self._begin_ns

    @property
    def end_ns(self) -> int:
        """Where playing ends, in the time of the bag."""
        return self._end_ns

    @property
    def counts(self) -> Mapping[str, int]:
        """How many messages of each topic make up what it shows at one time: what a seek plays with `PlayOptions.scrub`."""
        return self._counts

    def pause(self) -> None:
        """Stand still until `unpause`."""
        self._time.pause(self._now())
        self._changed.set()

    def unpause(self) -> None:
        self._time.unpause(self._now())
        self._changed.set()

    def seek(self, bag_ns: int) -> bool:
        """Go on at this time of the bag, in nanoseconds since 1970; whether the bag has it."""
        if not self._begin_ns <= bag_ns <= self._end_ns:
            return False
        self._time.seek(self._now(), bag_ns)
        self._messages.rewind(bag_ns)
        self.seeks += 1
        self._recall = bag_ns if self.options.scrub else None
        self._changed.set()
        return True

    async def play_next(self) -> bool:
        """While paused: play one message; whether there was one."""
        return await self.burst(1) == 1

    async def burst(self, count: int) -> int:
        """While paused: play the next `count` messages at once, or with 0 all; how many there were."""
        played = 0
        await self._catch_up()
        while self.paused and (not count or played < count):
            message = await self._messages.peek()
            if message is None or message.received_ns > self._end_ns:
                break
            self._time.seek(self._now(), message.received_ns)
            self._play(self._messages.advance())
            played += 1
        return played

    def finish(self) -> None:
        """Play no more."""
        self._over.set()
        self._changed.set()

    async def wait(self) -> None:
        """Wait until the bag has been played, or `finish` was called."""
        await self._over.wait()

    # -- playing ------------------------------------------------------------------------------------------------------------

    @background
    async def play(self) -> None:
        """Play the bag, again and again if so told."""
        clock = incarnation_of(self).runtime.clock
        await clock.sleep(self.options.delay)
        try:
            await self._show_latched()
            self._time.seek(self._now(), self._begin_ns)
            self._begun.set()
            await self._play_through()
            while self.options.loop and not self._over.is_set():
                self._messages.rewind(self._begin_ns)
                self._time.seek(self._now(), self._begin_ns)
                await self._play_through()
        except BagError as error:
            self.failure = error
            raise
        await self._requests.ended()
        self.finish()

    async def _show_latched(self) -> None:
        """Publish what latched topics held where playing begins, as a subscriber that came then would have received it."""
        latched = {topic.name: self._counts[topic.name] for topic in self._latched}
        if latched and self._begin_ns > self.bag.metadata.start_ns:
            for message in await self.offload(partial(self.bag.before, self._begin_ns, latched), thread=True):
                self._publish(message)

    async def _play_through(self) -> None:
        """Play until the end of the bag has been reached, in its own time."""
        turn = 0
        while not self._over.is_set():
            self._changed.clear()
            await self._catch_up()
            message = await self._messages.peek()
            if self._recall is not None:
                continue  # a seek while it was read
            due_ns = self._end_ns if message is None else min(message.received_ns, self._end_ns)
            if self.paused or self._time.bag_ns(self._now()) < due_ns:
                await self._until(due_ns)
                turn = 0
            elif message is None or message.received_ns > self._end_ns:
                if not self.options.scrub:
                    return
                self._at_end()
            else:
                self._play(self._messages.advance())
                turn += 1
                if turn % TURN == 0:
                    await asyncio.sleep(0)

    def _at_end(self) -> None:
        """Wait at the end for the next seek, or begin anew."""
        if self.options.loop and self._begin_ns < self._end_ns:
            self.seek(self._begin_ns)
        else:
            self._time.seek(self._now(), self._end_ns)
            self.pause()

    async def _catch_up(self) -> None:
        """After a seek: play what the topics showed at that time. A later seek takes its place."""
        async with self._recalling:
            while self._recall is not None:
                seeks = self.seeks
                messages = await self.offload(partial(self.bag.before, self._recall, self._counts), thread=True)
                if seeks == self.seeks:
                    self._recall = None
                    for message in messages:
                        self._publish(message)

    async def _until(self, bag_ns: int) -> None:
        """Wait until the bag's time is `bag_ns`, or has changed."""
        clock = incarnation_of(self).runtime.clock
        timer = None if self.paused else clock.call_at(self._time.instant(bag_ns), self._changed.set)
        try:
            await self._changed.wait()
        finally:
            if timer is not None:
                timer.cancel()

    def _play(self, message: BagMessage) -> None:
        topics = self.options.clock_topics
        if self._tick is not None and (topics is None or message.topic.name in topics):
            self._tick(ClockMessage(clock=stamp_of(message.received_ns)))
        self.played += self._publish(message)

    def _publish(self, message: BagMessage) -> bool:
        """Publish a message; whether it could be decoded."""
        self.message_ns = message.received_ns
        published = self._sinks[message.topic](message)
        self.message_ns = None
        return published

    @background
    async def tell_time(self) -> None:
        """Publish the time of the bag on `/clock`."""
        if self._tick is None or not self.options.clock_hz:
            return
        await self._begun.wait()
        clock = incarnation_of(self).runtime.clock
        start, k = clock.now(), 0
        while not self._over.is_set():
            self._tick(ClockMessage(clock=stamp_of(self.position_ns)))
            k = max(k, math.floor((clock.now() - start) * self.options.clock_hz)) + 1
            await clock.sleep_until(start + k / self.options.clock_hz)

    def _now(self) -> float:
        return incarnation_of(self).runtime.clock.now()

    def _selected(self, topic: BagTopic) -> bool:
        if topic.name == CLOCK.name and self.options.clock:
            return False
        return self.options.selection.takes(topic.name, topic.type)

    def _publishing(self, topic: BagTopic, qos: QoS) -> Callable[[BagMessage], bool]:
        """What publishes the messages of a topic."""
        kind, decoded, left_out, defaults = here(topic)
        if left_out or defaults:
            self.log.warning(
                "recorded with another definition of its type, and played with the fields that both have",
                topic=topic.name, type=topic.type, left_out=" ".join(left_out) or "-", not_recorded=" ".join(defaults) or "-",
            )  # fmt: skip
        publisher: Publisher[Any] = self.publisher(Topic(kind, self._name(topic.name), qos))

        def publish(message: BagMessage) -> bool:
            try:
                mine = decoded(message.data)
            except InterfaceError as error:
                self.log.warning("a message of the bag cannot be decoded", topic=topic.name, error=str(error))
                return False
            publisher(mine)
            return True

        return publish

    def _name(self, topic: str) -> str:
        """The name under which a topic is played: it may be renamed itself, or the service or action that it belongs to."""
        remap = self.options.remap
        for whole in (topic, service_of(topic), action_of(topic)):
            if whole is not None and whole in remap:
                return remap[whole] + topic.removeprefix(whole)
        return topic

    def _qos(self, topic: BagTopic) -> QoS:
        """What the publishers have offered if they agreed; what is transient local keeps the messages of all of them."""
        told = self.options.qos.get(topic.name)
        if told is not None:
            return told
        try:
            offered = parse_qos_profiles(topic.offered_qos_profiles)
        except InvalidQoS as error:
            self.log.warning("the quality of service of a topic cannot be read", topic=topic.name, error=str(error))
            return DEFAULT
        if not offered:
            return DEFAULT
        if len(set(offered)) > 1:
            self.log.warning("played with the first of several qualities of service", topic=topic.name)
        first = offered[0]
        keeps = first.transient_local and not first.keep_all
        return first.replace(depth=sum(one.depth for one in offered)) if keeps else first


def _recalled(topic: BagTopic, qos: QoS) -> int:
    """How many messages of a topic make up what it shows at one time."""
    if topic.type in PARTIAL:
        return RECALLED
    return min(qos.limit, RECALLED) if qos.transient_local else 1

"""Random lives of a topic, its publishers and its readers, against a model of lists."""

from __future__ import annotations

import asyncio
import warnings
from collections.abc import Coroutine
from contextlib import AsyncExitStack
from typing import Any, TypeAlias, TypeVar

import pytest
from hypothesis import settings
from hypothesis import strategies as st
from hypothesis.stateful import RuleBasedStateMachine, initialize, invariant, precondition, rule

from actors import CallTimeout, QoS, open_node
from actors.errors import Ended
from actors.interfaces.std_msgs.msg import Int32
from actors.qos import QoSWarning
from actors.time.virtual_loop import VirtualLoop
from actors.typing import Publisher, Stream
from tests.stage import NUMBERS, number

T = TypeVar("T")
Profile: TypeAlias = tuple[str, str, bool, int]

reliable_or_not = st.sampled_from(["reliable", "reliable", "best_effort"])
durabilities = st.sampled_from(["volatile", "transient_local"])
bounds = st.integers(1, 3)
profiles = st.tuples(reliable_or_not, durabilities, st.booleans(), bounds)
"""Reliability, durability, whether all is kept, and how many at most."""
picks = st.integers(0, 11)
"""Which publisher or reader a rule is about."""


def made_of(reliability: str, durability: str, keep_all: bool, bound: int) -> QoS:
    kept: dict[str, Any] = {"history": "keep_all", "limit": bound} if keep_all else {"depth": bound}
    with warnings.catch_warnings():  # best effort with KEEP_ALL is odd, but possible
        warnings.simplefilter("ignore", QoSWarning)
        return QoS(**kept, reliability=reliability, durability=durability)  # type: ignore[arg-type]


class Writer:
    """A publisher, and what the model knows of it."""

    def __init__(self, real: Publisher[Int32], qos: QoS, bound: int) -> None:
        self.real = real
        self.qos = qos
        self.bound = bound
        self.count = 0
        self.latched: list[int] = []
        self.open = True
        self.active = True

    def __repr__(self) -> str:
        return repr(self.real)

    def reaches(self, reader: Reader) -> bool:
        """ROS 2's rules: a reader gets no less than it asks for."""
        return (
            self.open
            and reader.open
            and (self.qos.reliable or not reader.qos.reliable)
            and (self.qos.transient_local or not reader.qos.transient_local)
        )


class Reader:
    """A stream, and what the model knows of it."""

    def __init__(self, real: Stream[Int32], qos: QoS, bound: int) -> None:
        self.real = real
        self.qos = qos
        self.bound = bound
        self.waiting: list[int] = []
        self.received = 0
        self.dropped = 0
        self.latest: int | None = None
        self.open = True
        self.task: asyncio.Task[Int32] | None = None
        """Somebody who waits for the next message."""

    def __repr__(self) -> str:
        return repr(self.real)

    def deliver(self, value: int) -> None:
        self.received += 1
        self.latest = value
        if len(self.waiting) < self.bound:
            self.waiting.append(value)
            return
        self.dropped += 1
        if not self.qos.keep_all:
            self.waiting = [*self.waiting[1:], value]

    @property
    def full(self) -> bool:
        """Whether a reliable sender has to wait for it."""
        return self.open and self.qos.keep_all and self.qos.reliable and len(self.waiting) >= self.bound


class Sender:
    """A `send` that waits for room: at most one at a time, so that the order of several is no question here."""

    def __init__(self, task: asyncio.Task[None], writer: Writer, value: int, blocker: Reader) -> None:
        self.task = task
        self.writer = writer
        self.value = value
        self.blocker = blocker


class Channel(RuleBasedStateMachine):
    """Publishers and readers of all kinds come and go; what each reader gets is what the model says."""

    def __init__(self) -> None:
        super().__init__()
        self.loop = VirtualLoop()
        self.stack = AsyncExitStack()
        self.node = self.run(self.stack.enter_async_context(open_node("machine", sinks=())))
        self.all_writers: list[Writer] = []
        self.all_readers: list[Reader] = []
        self.sender: Sender | None = None
        self.next = 0

    def run(self, work: Coroutine[Any, Any, T]) -> T:
        return self.loop.run_until_complete(work)

    def teardown(self) -> None:
        for reader in self.all_readers:
            while reader.task is None and reader.waiting:  # whatever the rules left is there, too
                self.take_from(reader, 1)
        tasks = [reader.task for reader in self.all_readers if reader.task is not None]
        tasks += [self.sender.task] if self.sender is not None else []  # type: ignore[list-item]
        self.run(self.abandon(tasks))
        self.run(self.stack.aclose())
        self.loop.close()

    @staticmethod
    async def abandon(tasks: list[asyncio.Task[Any]]) -> None:
        for task in tasks:
            task.cancel()
        await asyncio.gather(*tasks, return_exceptions=True)

    # -- the model ----------------------------------------------------------------------------------------------------------

    def publish_in_model(self, writer: Writer, value: int) -> None:
        if not writer.active:
            return
        writer.count += 1
        if writer.qos.transient_local:
            writer.latched = [*writer.latched, value][-writer.bound :]
        for reader in self.all_readers:
            if writer.reaches(reader):
                reader.deliver(value)

    def blocker_of(self, writer: Writer) -> Reader | None:
        """The first reader that has no room, if that matters to the writer."""
        reached = [reader for reader in self.all_readers if writer.reaches(reader)] if writer.qos.reliable else []
        return next((reader for reader in reached if reader.full), None)

    def settle(self) -> None:
        """Let those who wait do what they can: in reality, and in the model."""

        async def turns() -> None:
            for _ in range(12):
                await asyncio.sleep(0)

        self.run(turns())
        while self.somebody_moves():
            pass

    def somebody_moves(self) -> bool:
        for reader in self.all_readers:
            if reader.task is not None and (reader.waiting or not reader.open):
                self.arrived(reader)
                return True
        sender = self.sender
        if sender is None or sender.blocker.full:
            return False
        other = self.blocker_of(sender.writer)
        if other is not None:
            sender.blocker = other
            return False
        self.sender = None
        assert sender.task.done()
        if sender.writer.open:
            self.publish_in_model(sender.writer, sender.value)
            sender.task.result()
        else:
            with pytest.raises(Ended):
                sender.task.result()
        return True

    @staticmethod
    def arrived(reader: Reader) -> None:
        task, reader.task = reader.task, None
        assert task is not None
        assert task.done()
        if reader.waiting:
            assert task.result().data == reader.waiting.pop(0)
        else:
            with pytest.raises(Ended):
                task.result()

    # -- publishers ---------------------------------------------------------------------------------------------------------

    @initialize(writers=st.lists(profiles, min_size=1, max_size=2), readers=st.lists(profiles, min_size=1, max_size=4))
    def begin(self, writers: list[Profile], readers: list[Profile]) -> None:
        for profile in writers:
            self.advertise(profile)
        for profile in readers:
            self.subscribe(profile)

    @precondition(lambda self: len(self.all_writers) < 4)
    @rule(profile=profiles)
    def advertise(self, profile: Profile) -> None:
        qos = made_of(*profile)
        writer = Writer(self.run(self.made(lambda: self.node.publisher(NUMBERS, qos=qos))), qos, profile[-1])
        self.all_writers.append(writer)

    def writer(self, pick: int) -> Writer:
        return self.all_writers[pick % len(self.all_writers)]

    def reader(self, pick: int) -> Reader:
        return self.all_readers[pick % len(self.all_readers)]

    @staticmethod
    async def made(make: Any) -> Any:
        return make()

    @rule(pick=picks, count=st.integers(1, 5))
    def publish(self, pick: int, count: int) -> None:
        writer = self.writer(pick)
        for _ in range(count):
            self.next += 1
            if not writer.open:
                with pytest.raises(Ended):
                    writer.real.publish(number(self.next))
                return
            writer.real.publish(number(self.next))
            self.publish_in_model(writer, self.next)
        self.settle()

    @precondition(lambda self: self.sender is None)
    @rule(pick=picks, count=st.integers(1, 5))
    def send(self, pick: int, count: int) -> None:
        while count and self.sender is None:
            self.send_one(self.writer(pick))
            count -= 1

    def send_one(self, writer: Writer) -> None:
        self.next += 1
        task = self.loop.create_task(writer.real.send(number(self.next)))
        self.run(asyncio.sleep(0))
        blocker = self.blocker_of(writer)
        if writer.open and writer.active and blocker is not None:
            assert not task.done()
            self.sender = Sender(task, writer, self.next, blocker)
            return
        if writer.open:
            task.result()
            self.publish_in_model(writer, self.next)
        else:
            with pytest.raises(Ended):
                task.result()
        self.settle()

    @precondition(lambda self: self.sender is not None)
    @rule()
    def give_up_sending(self) -> None:
        assert self.sender is not None
        self.run(self.abandon([self.sender.task]))
        assert self.sender.task.cancelled()
        self.sender = None

    @rule(pick=picks)
    def close_publisher(self, pick: int) -> None:
        writer = self.writer(pick)
        self.run(self.made(writer.real.close))
        writer.open, writer.active = False, True
        self.settle()

    @rule(pick=picks, active=st.booleans())
    def as_a_lifecycle_node_does(self, pick: int, active: bool) -> None:
        writer = self.writer(pick)
        if writer.open:
            self.run(self.made(writer.real.resume if active else writer.real.suspend))
            writer.active = active

    # -- readers ------------------------------------------------------------------------------------------------------------

    @precondition(lambda self: len(self.all_readers) < 8)
    @rule(profile=profiles)
    def subscribe(self, profile: Profile) -> None:
        qos = made_of(*profile)
        reader = Reader(self.run(self.made(lambda: self.node.subscribe(NUMBERS, qos=qos))), qos, profile[-1])
        for writer in self.all_writers:
            if writer.reaches(reader) and reader.qos.transient_local:
                for value in writer.latched[-reader.bound :]:
                    reader.deliver(value)
        self.all_readers.append(reader)
        self.settle()

    @rule(pick=picks, count=st.integers(1, 3))
    def take(self, pick: int, count: int) -> None:
        self.take_from(self.reader(pick), count)

    def take_from(self, reader: Reader, count: int) -> None:
        for _ in range(count):
            if reader.task is not None:
                with pytest.raises(RuntimeError, match="two tasks wait on one stream"):
                    self.run(reader.real.next(timeout=0.0))
                return
            if reader.waiting:
                assert self.run(reader.real.next(timeout=0.0)).data == reader.waiting.pop(0)
            else:
                with pytest.raises(CallTimeout if reader.open else Ended):
                    self.run(reader.real.next(timeout=0.0))
            self.settle()

    @rule(pick=picks)
    def wait(self, pick: int) -> None:
        reader = self.reader(pick)
        if reader.task is None:
            reader.task = self.loop.create_task(reader.real.next())
            self.settle()

    @rule(pick=picks)
    def give_up_waiting(self, pick: int) -> None:
        reader = self.reader(pick)
        if reader.task is not None:
            self.run(self.abandon([reader.task]))
            assert reader.task.cancelled()
            reader.task = None

    @rule(pick=picks)
    def close_reader(self, pick: int) -> None:
        """What waits in it can still be taken; nothing new comes."""
        reader = self.reader(pick)
        self.run(self.made(reader.real.close))
        reader.open = False
        self.settle()

    # -- what always holds --------------------------------------------------------------------------------------------------

    @invariant()
    def publishers_and_readers_say_what_the_model_says(self) -> None:
        for writer in self.all_writers:
            matched = sum(writer.reaches(reader) for reader in self.all_readers)
            assert (writer.real.count, writer.real.subscription_count) == (writer.count, matched)
        for reader in self.all_readers:
            latest = reader.real.latest
            assert (reader.real.received, reader.real.dropped) == (reader.received, reader.dropped)
            assert (None if latest is None else latest.data) == reader.latest
            if reader.open:
                matched = sum(writer.reaches(reader) for writer in self.all_writers)
                assert reader.real.publisher_count == matched

    @invariant()
    def a_sender_waits_only_for_room(self) -> None:
        assert self.sender is None or not self.sender.task.done()


TestChannel = Channel.TestCase
TestChannel.settings = settings(deadline=None, stateful_step_count=40)
